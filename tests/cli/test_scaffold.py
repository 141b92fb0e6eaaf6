"""Laws of `hairkit new-plugin`."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from hairkit.cli import main
from hairkit.cli.scaffold import new_plugin
from hairkit.errors import InputError
from hairkit.manager import STAGES, Manager
from hairkit.pipeline.recipe import HOOKS


def test_every_stage_gives_a_package_whose_test_passes(tmp_path: Path) -> None:
    """The written module obeys the contract as it is, without a warning."""
    folders = [new_plugin(stage, f"my_{stage}", tmp_path / stage) for stage in STAGES]
    paths = os.pathsep.join(str(folder) for folder in folders)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-W", "error", "-p", "no:cacheprovider", "."],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert f"{len(STAGES)} passed" in done.stdout


@pytest.mark.parametrize(("table", "hook"), HOOKS.items())
def test_stages_may_be_named_as_in_a_recipe(table: str, hook: str, tmp_path: Path) -> None:
    """`hull` and `build_hull` write the same package; its entry point leads to its module."""
    first = new_plugin(table, "mine", tmp_path / "a")
    second = new_plugin(hook, "mine", tmp_path / "b")
    for path in sorted(first.rglob("*.*")):
        assert path.read_text() == (second / path.relative_to(first)).read_text()
    entries = tomllib.loads((first / "pyproject.toml").read_text())["project"]["entry-points"]
    assert entries == {"hairkit": {"mine": "hairkit_mine"}}
    manager = Manager.loaded([first / "hairkit_mine.py"], autoload=False)
    assert manager.info("hairkit_mine").stages == (hook,)
    assert len(manager.info("hairkit_mine").options) == 1


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    """A folder that exists is refused, and left as it is; no rest of a draft remains."""
    (tmp_path / "mine").mkdir()
    with pytest.raises(InputError, match="exists already"):
        new_plugin("orient", "mine", tmp_path / "mine")
    assert list(tmp_path.rglob("*")) == [tmp_path / "mine"]


@pytest.mark.parametrize("name", ["", "My", "a-b", "1a", "class", "a b", "../x"])
def test_a_name_must_be_a_modules_name(name: str, tmp_path: Path) -> None:
    """What cannot be imported is refused before anything is written."""
    with pytest.raises(InputError, match="lower-case letters"):
        new_plugin("orient", name, tmp_path / "x")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_stage_is_answered_with_the_closest(tmp_path: Path) -> None:
    """The error lists the stages."""
    with pytest.raises(InputError, match=r"did you mean 'orient'.*segment, scene"):
        new_plugin("orinet", "mine", tmp_path / "x")
    with pytest.raises(InputError, match="no such folder"):
        new_plugin("orient", "mine", tmp_path / "a" / "b")


def test_the_command_says_what_to_do_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By default the package goes into hairkit-NAME in the current folder."""
    monkeypatch.chdir(tmp_path)
    assert main(["new-plugin", "orient", "my_method"]) == 0
    assert "pip install -e hairkit-my-method" in capsys.readouterr().out
    assert (tmp_path / "hairkit-my-method" / "tests" / "test_my_method.py").is_file()
    assert main(["new-plugin", "orient", "my_method"]) == 2
