"""Laws of recipes that name commands: their plugins run, are recorded and brought back."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

from hairkit.cli import main
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe, parse_recipe, stage_digest
from hairkit.pipeline.run_record import RECORD, read_record

UPRIGHT = """
import numpy as np
from hairkit.worker import option, serve

def orient(mask, options):
    open("calls", "a").write("x")
    angle = np.full(mask.labels.shape, options.angle, np.float32)
    return {"angle": angle, "confidence": (mask.labels == 255).astype(np.float32)}

if __name__ == "__main__":
    serve(orient, options={"angle": option(1.5, low=0.0, high=3.0, unit="rad")}, version="3")
"""


def write_recipe(folder: Path) -> Path:
    """Write the small recipe with `orient` by a command, and the command."""
    (folder / "upright.py").write_text(UPRIGHT)
    text = RECIPE.replace('[orient]\nplugin = "ball_plugin"', '[orient]\nplugin = "upright"')
    command = f'[plugins.upright]\ncommand = ["{sys.executable}", "upright.py"]\n'
    (folder / "mine.toml").write_text(text + command)
    return folder / "mine.toml"


def test_a_recipe_runs_a_command_and_its_record_brings_it_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command runs once a view, is in run.json, and `rerun` gives the same bytes with it."""
    capture, recipe = write_capture(tmp_path / "capture"), write_recipe(tmp_path)
    words = ["reconstruct", str(capture), "-o", str(tmp_path / "out"), "--recipe", str(recipe)]
    words += ["--plugin", str(PLUGIN_FILE), "--guides", "10", "--no-sheet", "--quiet"]
    assert main([*words, "--set", "upright.angle=1.25"]) == 0
    assert (tmp_path / "calls").read_text() == 8 * "x"
    record = read_record(tmp_path / "out" / RECORD)
    (used,) = [each for each in record.plugins if each.stage == "orient"]
    assert (used.plugin, used.version, used.options) == ("upright", "3", {"angle": 1.25})
    assert record.commands[0].command == (sys.executable, "upright.py")
    assert main([*words, "--set", "upright.angle=1.25"]) == 0
    assert (tmp_path / "calls").read_text() == 8 * "x"
    capsys.readouterr()
    again = ["rerun", str(tmp_path / "out" / RECORD), "-o", str(tmp_path / "again"), "--json"]
    assert main(again) == 0
    assert json.loads(capsys.readouterr().out)["different"] == []
    assert (tmp_path / "calls").read_text() == 16 * "x"


def test_another_command_is_another_result(tmp_path: Path) -> None:
    """Digests of a stage differ when the command's source does."""
    recipe, digests = load_recipe(write_recipe(tmp_path)), []
    for comment in ("", "# changed\n"):
        (tmp_path / "upright.py").write_text(UPRIGHT + comment)
        manager = Manager.loaded([PLUGIN_FILE])
        recipe.check(manager)
        stage = recipe.stage("orient")
        assert stage is not None
        digests.append(stage_digest(manager, stage))
    assert digests[0] != digests[1]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("plugins = 3", "plugins.: expected a table"),
        ("[plugins]\nx = 3", "plugins.x: expected a table"),
        ("[plugins.x]\n", r"\[plugins.x\]: command is None, expected a list of words"),
        ('[plugins.x]\ncommand = "python"', "command is 'python', expected a list"),
        ("[plugins.x]\ncommand = []", r"command is \[\], expected a list of words"),
        ('[plugins.x]\ncommand = ["a"]\nsecond = 3', "did you mean 'seconds'"),
        ('[plugins.x]\ncommand = ["a"]\nseconds = "3"', "seconds is '3', expected a number"),
        ('[plugins.x]\ncommand = ["a"]\nprocesses = 0', "processes is 0, expected 1 or more"),
        ('[plugins.x]\ncommand = ["a"]\nenvironment = {A = 1}', "no table of texts"),
    ],
)
def test_a_wrong_table_is_one_line(text: str, said: str) -> None:
    """What a table of a command must not hold is named with file, table and key."""
    with pytest.raises(InputError, match=f"^mine.toml: .*{said}"):
        parse_recipe(text.encode(), "mine", "mine.toml")


def test_a_command_may_not_take_the_name_of_a_plugin(tmp_path: Path) -> None:
    """A recipe cannot replace an installed plugin by a command of its name."""
    (tmp_path / "upright.py").write_text(UPRIGHT)
    text = f'[plugins.gabor]\ncommand = ["{sys.executable}", "upright.py"]\n'
    recipe = parse_recipe(text.encode(), "mine", "mine.toml", tmp_path)
    with pytest.raises(LookupError, match=r"mine.toml: \[plugins.gabor\].* already loaded from"):
        recipe.check(Manager.loaded())
