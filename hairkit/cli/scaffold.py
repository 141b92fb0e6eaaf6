"""Writes a working plugin package: a module, its entry point, its test and its readme."""

from __future__ import annotations

import ast
import inspect
import keyword
import os
import re
import tempfile
import textwrap
from pathlib import Path

from hairkit import hookspecs
from hairkit.cli.scaffold_sketches import SKETCHES, Sketch
from hairkit.errors import InputError
from hairkit.options import unknown_name
from hairkit.stages import OF_HOOK, OF_TABLE


def new_plugin(stage: str, name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Write a plugin package and return its folder.

    Parameters
    ----------
    stage
        A hook (`build_hull`, `groom_ready`), or a stage's table in a recipe (`hull`).
    name
        The plugin's name: lower-case letters, digits and underscores.
    folder
        Where to write; `hairkit-NAME` in the current folder by default.

    Raises
    ------
    InputError
        There is no such stage, the name is no plugin's name, or the folder exists.
    """
    hook = OF_TABLE[stage].hook if stage in OF_TABLE else stage
    if hook not in SKETCHES:
        raise InputError(unknown_name("stage", stage, [*OF_TABLE, *SKETCHES]))
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
    run = "hairkit reconstruct photos/ -o out/"
    chosen = f"{run} --set {OF_HOOK[hook].name}=NAME" if hook in OF_HOOK else run
    use = _COMMANDS.get(hook, chosen)
    texts = {
        "pyproject.toml": _PYPROJECT,
        f"{module}.py": _module(hook),
        f"tests/test_{name}.py": _TEST.replace("TRY", _TRIES.get(hook, _TRY)),
        "README.md": _README.replace("USE", use),
    }
    for key, word in words.items():
        texts = {path: text.replace(key, word) for path, text in texts.items()}
    return texts


def _module(hook: str) -> str:
    sketch = SKETCHES[hook]
    signature = _signature(hook, sketch)
    words = {
        "SUMMARY": sketch.summary,
        "IMPORTS": _imports(sketch, signature),
        "OPTIONS": _OPTIONS.replace("OPTION", sketch.option) if sketch.option else "",
        "SIGNATURE": signature,
        "BODY": textwrap.indent(sketch.body.strip(), "    "),
        "BEFORE": sketch.before,
    }
    text = _MODULE
    for key, word in words.items():
        text = text.replace(key, word)
    return text


def _signature(hook: str, sketch: Sketch) -> str:
    """Return the parameters of a hook that a body uses, and its result, as they are written."""
    types = getattr(hookspecs, hook).__annotations__ | {"options": "Options"}
    result = types.pop("return")
    used = [name for name in types if re.search(rf"\b{name}\b", sketch.body)]
    if sketch.option and "options" not in used:
        used.append("options")
    return f"({', '.join(f'{name}: {types[name]}' for name in used)}) -> {result}"


def _imports(sketch: Sketch, signature: str) -> str:
    """Return the imports of a module: of its method, and of the types that the contract names."""
    written = f"hookimpl {signature} {sketch.before} {sketch.body}"
    words = {*re.findall(r"\w+", written + " dataclass option" * bool(sketch.option))}
    homes = _taken(inspect.getsource(hookspecs)) | _taken(_KNOWN)
    modules = []
    for module in sorted({home for name, home in homes.items() if name in words}):
        names = sorted(name for name, home in homes.items() if home == module and name in words)
        modules.append(f"from {module} import {', '.join(names)}")
    standard = [line for line in modules if not line.startswith(("from hairkit", "from scipy"))]
    imported = [line for line in _KNOWN.splitlines() if line.startswith("import")]
    plain = [line for line in imported if line.split()[-1] in words]
    others = [line for line in modules if line not in standard]
    return "\n".join([*standard, "", *plain, *others]).strip()


def _taken(code: str) -> dict[str, str]:
    """Return the names that a source takes out of modules, and these modules."""
    found = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in found for alias in node.names}


_KNOWN = """\
import sys
import cv2
import numpy as np
from dataclasses import dataclass, replace
from scipy.spatial import cKDTree
from hairkit.grooming import brushes
from hairkit.hookspecs import hookimpl
from hairkit.io.capture_reader import read_folder
from hairkit.io.file_format import Feature, FileFormat
from hairkit.options import option
from hairkit.simulation import Measures, Surroundings
from hairkit.storage import write_text
from hairkit.types.camera import Camera
from hairkit.types.finding import Finding
from hairkit.types.head import LANDMARKS
from hairkit.types.mask import HAIR, PERSON
from hairkit.types.orientation import wrap_angle
from hairkit.types.volume import VoxelGrid
"""
"""What sketches use besides the types of their hooks' signatures."""
_COMMANDS = {
    "make_simulator": "hairkit simulate out/groom.npz -o cache.npz --using NAME",
    "export_groom": "hairkit export out/groom.npz -o hair.NAME",
    "import_groom": "hairkit convert hair.NAME hair.abc",
    "validate_groom": "hairkit validate hair.abc --for unreal",
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

from hairkit import testing
from hairkit.manager import Manager

import MODULE


def test_obeys_the_contract(tmp_path: Path) -> None:
    """On a small made-up head the plugin does what the hook `HOOK` asks for."""
    manager = Manager()
    manager.register(MODULE, "NAME")
    TRY
'''
_TRY = """arguments = testing.stage_arguments("HOOK", tmp_path)
    assert manager.call("HOOK", "NAME", **arguments) is not None"""
_TRIES = {
    "validate_groom": 'assert manager.findings(testing.bristle_groom(), tmp_path, "unreal")',
    "stage_finished": 'MODULE.stage_finished("orient", 1.5)',
    "groom_ready": "MODULE.groom_ready(testing.bristle_groom())",
}
"""What a test does with the plugin of a hook that is no stage."""

_MODULE = '''\
"""SUMMARY"""

from __future__ import annotations

IMPORTS
BEFORE
OPTIONS
@hookimpl
def HOOKSIGNATURE:
    """Replace this body by your method; what comes in and goes out is in docs/plugins.md."""
BODY
'''
_OPTIONS = '''
@dataclass(frozen=True)
class Options:
    """Settings of NAME."""

    OPTION

'''
