"""Laws of the lock: a recipe runs with the versions that it names and with no others."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest
from ball import PLUGIN_FILE, RECIPE

from hairkit.cli import main
from hairkit.errors import InputError, PluginError
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe, parse_recipe

WORKER = """
import numpy as np
from hairkit.worker import serve

def orient(mask):
    ones = np.ones(mask.labels.shape, np.float32)
    return {"angle": ones, "confidence": ones}

if __name__ == "__main__":
    serve(orient, version="3")
"""


def test_a_locked_recipe_runs_with_what_it_was_locked_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Installed plugins, plugin files and commands are locked; changed code is refused."""
    (tmp_path / "mine.py").write_text(PLUGIN_FILE.read_text())
    (tmp_path / "worker.py").write_text(WORKER)
    text = RECIPE.replace("ball_plugin", "mine").replace(
        '[orient]\nplugin = "mine"', '[orient]\nplugin = "upright"'
    )
    text = text.replace('[hull]\nplugin = "mine"', '[hull]\nplugin = "visual_hull"')
    text += f'[plugins.upright]\ncommand = ["{sys.executable}", "worker.py"]\n'
    path = tmp_path / "recipe.toml"
    path.write_text(text)
    words = ["plugins", "--lock", str(path), "--plugin", str(tmp_path / "mine.py")]
    assert main(words) == 0
    lock = capsys.readouterr().out
    found = tomllib.loads(lock)["lock"]
    assert set(found) == {"mine", "upright", "visual_hull"}
    assert found["visual_hull"].startswith("hairkit ")
    assert found["upright"].startswith("3 code ")
    path.write_text(text + lock)
    load_recipe(path).check(Manager.loaded([tmp_path / "mine.py"]))
    for name in ("mine.py", "worker.py"):
        before = (tmp_path / name).read_text()
        (tmp_path / name).write_text(before + "\n# another\n")
        with pytest.raises(PluginError, match=r"recipe.toml: \[lock\] .* was locked to"):
            load_recipe(path).check(Manager.loaded([tmp_path / "mine.py"]))
        (tmp_path / name).write_text(before)


def test_another_version_is_one_line(manager: Manager) -> None:
    """The line names recipe, plugin, both versions and what to do."""
    recipe = parse_recipe(b'[lock]\ngabor = "hairkit 0.0.1"\n', "x", "x.toml")
    with pytest.raises(PluginError, match=r"^x.toml: \[lock\] gabor: hairkit \S+ is installed, .*"
                                          r"locked to hairkit 0.0.1; install that"):  # fmt: skip
        recipe.check(manager)
    with pytest.raises(PluginError, match="no plugin 'nope'"):
        parse_recipe(b'[lock]\nnope = "1"\n', "x", "x.toml").check(manager)
    for text in (b"lock = 3", b"[lock]\ngabor = 3"):
        with pytest.raises(InputError, match="lock: expected a table"):
            parse_recipe(text, "x", "x.toml")
