"""Writes a working plugin package: a module, its entry point, its test and its readme."""

from __future__ import annotations

import keyword
import os
import tempfile
import textwrap
from pathlib import Path

from hairkit.cli.scaffold_sketches import ALWAYS, SKETCHES, STANDARD
from hairkit.errors import InputError
from hairkit.manager import STAGES
from hairkit.options import unknown_name
from hairkit.pipeline.recipe import HOOKS


def new_plugin(stage: str, name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Write a plugin package and return its folder.

    Parameters
    ----------
    stage
        A stage's hook (`build_hull`) or its table in a recipe (`hull`).
    name
        The plugin's name: lower-case letters, digits and underscores.
    folder
        Where to write; `hairkit-NAME` in the current folder by default.

    Raises
    ------
    InputError
        There is no such stage, the name is no plugin's name, or the folder exists.
    """
    hook = HOOKS.get(stage, stage)
    if hook not in STAGES:
        raise InputError(unknown_name("stage", stage, [*HOOKS, *STAGES]))
    if not name.isidentifier() or keyword.iskeyword(name) or name != name.lower():
        raise InputError(
            f"plugin name is {name!r}, expected lower-case letters, digits and underscores"
        )
    target = Path(folder) if folder is not None else Path(f"hairkit-{name.replace('_', '-')}")
    if target.exists():
        raise InputError(f"{target}: exists already; remove it or choose another name or -o FOLDER")
    if not target.absolute().parent.is_dir():
        raise InputError(f"{target.absolute().parent}: no such folder")
    with tempfile.TemporaryDirectory(dir=target.absolute().parent, prefix=".hairkit-") as work:
        draft = Path(work) / "package"
        for path, text in _files(hook, name).items():
            (draft / path).parent.mkdir(parents=True, exist_ok=True)
            (draft / path).write_text(text, encoding="utf-8")
        draft.rename(target)
    return target


def _files(hook: str, name: str) -> dict[str, str]:
    distribution, module = f"hairkit-{name.replace('_', '-')}", f"hairkit_{name}"
    words = {"NAME": name, "DISTRIBUTION": distribution, "MODULE": module, "HOOK": hook}
    use = _COMMANDS.get(hook, "hairkit reconstruct photos/ -o out/ --set TABLE=NAME")
    use = use.replace("TABLE", next((t for t, stage in HOOKS.items() if stage == hook), ""))
    texts = {
        "pyproject.toml": _PYPROJECT,
        f"{module}.py": _module(hook),
        f"tests/test_{name}.py": _TEST,
        "README.md": _README.replace("USE", use),
    }
    for key, word in words.items():
        texts = {path: text.replace(key, word) for path, text in texts.items()}
    return texts


def _module(hook: str) -> str:
    sketch = SKETCHES[hook]
    standard = sorted(line for line in sketch.imports if line.startswith(STANDARD))
    if not any("dataclasses" in line for line in standard):
        standard.insert(0, "from dataclasses import dataclass")
    others = {*sketch.imports, *ALWAYS} - set(standard)
    ordered = sorted(others, key=lambda line: (line.startswith("from"), line))
    words = {
        "SUMMARY": sketch.summary,
        "IMPORTS": "\n".join([*standard, "", *ordered]),
        "OPTION": sketch.option,
        "SIGNATURE": sketch.signature,
        "BODY": textwrap.indent(sketch.body.strip(), "    "),
        "BEFORE": sketch.before,
    }
    text = _MODULE
    for key, word in words.items():
        text = text.replace(key, word)
    return text


_COMMANDS = {
    "make_simulator": "hairkit simulate out/groom.npz -o cache.npz --using NAME",
    "export_groom": "hairkit export out/groom.npz -o hair.NAME",
    "import_groom": "hairkit convert hair.NAME hair.abc",
}
"""Commands that use plugins of hooks which a recipe alone does not choose."""

_PYPROJECT = """\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "DISTRIBUTION"
version = "0.1.0"
description = "A hairkit plugin: NAME"
requires-python = ">=3.11"
dependencies = ["hairkit"]

[project.entry-points.hairkit]
NAME = "MODULE"

[tool.setuptools]
py-modules = ["MODULE"]
"""

_README = """\
# DISTRIBUTION

The hairkit plugin `NAME` for the stage `HOOK`.

    pip install -e .                      # hairkit finds it by its entry point
    python -m pytest                      # it obeys the contract
    USE

While you write it, `--plugin MODULE.py` loads the file without installing it (under the file's
name, `MODULE`).
"""

_TEST = '''\
"""Laws of the plugin `NAME`."""

from pathlib import Path

from hairkit.manager import Manager
from hairkit.testing import stage_arguments

import MODULE


def test_obeys_the_contract(tmp_path: Path) -> None:
    """On a small made-up head the plugin returns what the stage `HOOK` asks for."""
    manager = Manager()
    manager.register(MODULE, "NAME")
    arguments = stage_arguments("HOOK", tmp_path)
    assert manager.call("HOOK", "NAME", **arguments) is not None
'''

_MODULE = '''\
"""SUMMARY"""

from __future__ import annotations

IMPORTS
BEFORE

@dataclass(frozen=True)
class Options:
    """Settings of NAME."""

    OPTION


@hookimpl
def HOOK(SIGNATURE:
    """Replace this body by your method; what comes in and goes out is in docs/plugins.md."""
BODY
'''
