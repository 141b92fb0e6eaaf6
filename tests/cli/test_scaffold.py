"""Laws of `hairkit new-plugin`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

from hairkit import hookspecs
from hairkit.cli import main
from hairkit.cli.scaffold import new_plugin
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.stages import OF_TABLE
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache

HOOKS = [name for name, made in vars(hookspecs).items() if hasattr(made, "hairkit_spec")]


def test_every_hook_gives_a_package_whose_test_passes(tmp_path: Path) -> None:
    """The written module obeys the contract as it is, without a warning."""
    folders = [new_plugin(hook, f"my_{hook}", tmp_path / hook) for hook in HOOKS]
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
    assert f"{len(HOOKS)} passed" in done.stdout


@pytest.fixture(scope="module")
def groom_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small groom on disk."""
    path = tmp_path_factory.mktemp("groom") / "groom.npz"
    bristle_groom().save(path)
    return path


def module_of(hook: str, folder: Path) -> Path:
    """Write the package of a hook and return its module, as a user would give it to --plugin."""
    return new_plugin(hook, f"my_{hook}", folder / hook) / f"hairkit_my_{hook}.py"


@pytest.mark.parametrize("table", OF_TABLE)
def test_the_plugin_of_a_stage_runs_in_a_reconstruction(
    table: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`reconstruct --plugin FILE --set STAGE=NAME` makes a groom with it, and its export."""
    module = module_of(OF_TABLE[table].hook, tmp_path)
    recipe = tmp_path / "ball.toml"
    recipe.write_text(RECIPE)
    capture, out = write_capture(tmp_path / "capture", masks=True), tmp_path / "out"
    words = ["--recipe", recipe, "--plugin", PLUGIN_FILE, "--plugin", module, "--no-sheet"]
    words += ["--set", f"{table}={module.stem}", "--guides", "30", "--json", "--quiet"]
    if table == "person":  # found nowhere: the made-up cameras are of whole photos
        words += ["--set", f"{module.stem}.gain=0.1"]
    code = main([str(word) for word in ["reconstruct", capture, "-o", out, *words]])
    printed = capsys.readouterr()
    assert (code, printed.err) == (0, "")
    made = json.loads(printed.out)
    assert f"{table:<12} {module.stem} of" in (out / "hairkit.log").read_text()
    assert len(Groom.load(out / "groom.npz").strands) == made["strands"] > 0
    for path in made["exports"].values():
        assert Path(path).stat().st_size > 0


def test_the_export_plugin_writes_files_of_its_ending(
    tmp_path: Path, groom_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`export` finds it by the ending, `plugins --formats` lists it."""
    module, target = module_of("export_groom", tmp_path), tmp_path / "hair.my_export_groom"
    assert main(["export", str(groom_file), "-o", str(target), "--plugin", str(module)]) == 0
    rows = np.loadtxt(target)
    strands = Groom.load(groom_file).strands
    assert np.array_equal(rows[:, 0], strands.strand_of_point)
    assert np.allclose(rows[:, 1:], strands.points, atol=1e-6)
    assert main(["plugins", "--formats", "--plugin", str(module)]) == 0
    assert "`.my_export_groom`" in capsys.readouterr().out


def test_the_import_plugin_reads_files_of_its_ending(
    tmp_path: Path, groom_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`convert` finds it by the ending and takes its option."""
    module = module_of("import_groom", tmp_path)
    source, target = tmp_path / "hair.my_import_groom", tmp_path / "hair.npz"
    source.write_bytes(groom_file.read_bytes())
    words = [str(source), str(target), "--plugin", str(module), "--set", "reader.every=2"]
    assert main(["convert", *words]) == 0
    whole = Groom.load(groom_file).strands
    assert len(Groom.load(target).strands) == (len(whole) + 1) // 2
    assert main(["plugins", "--formats", "--plugin", str(module)]) == 0
    assert "`.my_import_groom`" in capsys.readouterr().out


def test_the_simulator_moves_the_groom(tmp_path: Path, groom_file: Path) -> None:
    """`simulate --using NAME` writes a cache in which the guides go with the head."""
    module, cache = module_of("make_simulator", tmp_path), tmp_path / "cache.npz"
    words = [str(groom_file), "-o", str(cache), "--plugin", str(module), "--using", module.stem]
    assert main(["simulate", *words, "--shake", "yaw:20:1.5", "--frames", "8", "--quiet"]) == 0
    frames, points = PointCache.load(cache), Groom.load(groom_file).strands.points
    for frame, head in zip(frames.points, frames.head_from_rest, strict=True):
        assert np.allclose(frame, points @ head[:3, :3].T + head[:3, 3], atol=1e-6)
    assert not np.allclose(frames.points[0], frames.points[-1], atol=1e-4)


@pytest.mark.parametrize("table", OF_TABLE)
def test_stages_may_be_named_as_in_a_recipe(table: str, tmp_path: Path) -> None:
    """`hull` and `build_hull` write the same package; its entry point leads to its module."""
    first = new_plugin(table, "mine", tmp_path / "a")
    second = new_plugin(OF_TABLE[table].hook, "mine", tmp_path / "b")
    for path in sorted(first.rglob("*.*")):
        assert path.read_text() == (second / path.relative_to(first)).read_text()
    entries = tomllib.loads((first / "pyproject.toml").read_text())["project"]["entry-points"]
    assert entries == {"hairkit": {"mine": "hairkit_mine"}}
    manager = Manager.loaded([first / "hairkit_mine.py"], autoload=False)
    assert manager.info("hairkit_mine").stages == (OF_TABLE[table].hook,)
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
