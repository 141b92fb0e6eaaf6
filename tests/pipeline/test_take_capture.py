"""Laws of the stage `capture`: which plugin reads what, and that a run can be made again."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

import hairkit
from hairkit.cli import main
from hairkit.errors import InputError, PluginError
from hairkit.io.capture_reader import read_capture
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe, parse_recipe
from hairkit.pipeline.run_record import read_record
from hairkit.pipeline.take_capture import take_capture
from hairkit.viewer.layers import PHOTO_EDGE, Layers

SHELF = '''
"""Captures that lie beside this file."""

from pathlib import Path

from hairkit import Capture, hookimpl
from hairkit.io.capture_reader import read_folder


@hookimpl
def capture(source: str, max_edge: int) -> Capture | None:
    name = source.removeprefix("shelf:")
    return None if name == source else read_folder(Path(__file__).parent / name, max_edge)
'''


@pytest.fixture
def shelf(tmp_path: Path) -> Path:
    """A plugin file whose captures lie beside it, with one, `hero`."""
    write_capture(tmp_path / "hero", masks=True)
    (tmp_path / "shelf.py").write_text(SHELF)
    choice = 'plugin = ["shelf", "turn_video", "photo_folder"]'
    text = RECIPE.replace('[capture]\nplugin = "ball_plugin"', f"[capture]\n{choice}")
    (tmp_path / "shelf.toml").write_text(text)
    return tmp_path


def test_the_first_plugin_that_knows_a_source_reads_it(shelf: Path) -> None:
    """A name is one plugin's, a folder another's; the photos are the same, scaled as asked."""
    manager = Manager.loaded([shelf / "shelf.py", PLUGIN_FILE])
    recipe = load_recipe(shelf / "shelf.toml")
    named = take_capture("shelf:hero", recipe, manager, 64)
    walked = take_capture(shelf / "hero", recipe, manager, 64)
    assert [view.image.tobytes() for view in named.views] == [
        view.image.tobytes() for view in walked.views
    ]
    assert max(named.views[0].image.shape) == 64
    assert (named.asked, walked.asked) == ("shelf:hero", str(shelf / "hero"))


def test_what_the_default_recipe_reads_is_what_read_capture_reads(shelf: Path) -> None:
    """The shipped plugins have the photos, masks and names of the function."""
    first = take_capture(shelf / "hero", load_recipe("default"), Manager.loaded())
    second = read_capture(shelf / "hero")
    assert [(v.name, v.mask_path, v.photo_path) for v in first.views] == [
        (v.name, v.mask_path, v.photo_path) for v in second.views
    ]


def test_a_name_that_nobody_knows_is_no_folder() -> None:
    """The last plugin says what was looked for; without the stage one line says so."""
    manager = Manager.loaded()
    with pytest.raises(InputError, match="asset:hero: no such file, expected a photo or a folder"):
        take_capture("asset:hero", load_recipe("default"), manager)
    only = load_recipe("default").with_set(["capture=turn_video"])
    with pytest.raises(
        PluginError, match=r"plugin 'turn_video' .* returned nothing from 'capture'"
    ):
        take_capture("asset:hero", only, manager)
    bare = parse_recipe(b"capture = false", "bare", "bare.toml")
    with pytest.raises(InputError, match="asset:hero: recipe bare has no stage 'capture'"):
        take_capture("asset:hero", bare, manager)


def test_nobody_reads_a_capture_but_plugins() -> None:
    """Commands, viewer and studio ask the stage; others get `read_capture` for their programs."""
    package = Path(hairkit.__file__).parent
    readers = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if re.search(r"capture_reader import .*read_(capture|folder)", path.read_text())
    }
    assert readers == {"__init__.py", "api.py", "cli/scaffold.py"}


def test_info_tells_of_a_name(shelf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of what only the recipe's plugin knows it says the same as of the folder."""
    recipe = ["--recipe", str(shelf / "shelf.toml"), "--plugin", str(shelf / "shelf.py")]
    told = []
    for words in (["shelf:hero", *recipe, "--plugin", str(PLUGIN_FILE)], [str(shelf / "hero")]):
        assert main(["info", *words, "--json"]) == 0
        told.append(json.loads(capsys.readouterr().out))
    assert told[0] == told[1]
    assert told[0]["kind"] == "capture"


def test_the_viewer_shows_the_photos_of_a_name(shelf: Path) -> None:
    """The layer of photos asks the plugin that the record of the run names."""
    words = ["reconstruct", "shelf:hero", "-o", str(shelf / "out"), "--quiet", "--no-sheet"]
    words += ["--recipe", str(shelf / "shelf.toml"), "--plugin", str(shelf / "shelf.py")]
    assert main([*words, "--plugin", str(PLUGIN_FILE), "--guides", "20"]) == 0
    layers = Layers(Manager.loaded([shelf / "shelf.py"]), shelf / "out")
    shown = layers.billboards("photos")
    photos = {view.name: view.image for view in read_capture(shelf / "hero", PHOTO_EDGE).views}
    assert {name: each.image[..., :3].tobytes() for name, each in shown.items()} == {
        name: image.tobytes() for name, image in photos.items()
    }


def test_a_run_of_a_name_is_made_again(shelf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The record holds the name and the plugin; `rerun` asks it again and finds the same bytes."""
    out = str(shelf / "out")
    words = ["reconstruct", "shelf:hero", "-o", out, "--recipe", str(shelf / "shelf.toml")]
    words += ["--plugin", str(PLUGIN_FILE), "--plugin", str(shelf / "shelf.py"), "--quiet"]
    assert main([*words, "--guides", "20", "--no-sheet"]) == 0
    record = read_record(shelf / "out" / "run.json")
    assert record.photos == "shelf:hero"
    assert next(each.plugin for each in record.plugins if each.stage == "capture") == "shelf"
    capsys.readouterr()
    assert main(["rerun", f"{out}/run.json", "-o", str(shelf / "again"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["different"] == []


def test_a_record_from_before_the_stage_is_made_again(shelf: Path) -> None:
    """A run.json that names no plugin for the photos has those of the default recipe."""
    words = ["reconstruct", str(shelf / "hero"), "-o", str(shelf / "out"), "--quiet"]
    words += ["--recipe", str(shelf / "shelf.toml"), "--plugin", str(shelf / "shelf.py")]
    assert main([*words, "--plugin", str(PLUGIN_FILE), "--guides", "20", "--no-sheet"]) == 0
    path = shelf / "out" / "run.json"
    record = json.loads(path.read_text())
    record["plugins"] = [each for each in record["plugins"] if each["stage"] != "capture"]
    path.write_text(json.dumps(record))
    assert main(["rerun", str(path), "-o", str(shelf / "again"), "--quiet"]) == 0


@pytest.mark.parametrize(("source", "code"), [("shelf:hero", 0), ("asset:hero", 2)])
def test_check_asks_for_a_source(
    source: str, code: int, shelf: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--check --source` tries the contract on a source, which the plugin must know."""
    words = ["plugins", "shelf", "--plugin", str(shelf / "shelf.py"), "--check", "--json"]
    assert main([*words, "--source", source]) == code
    checks = {check["name"]: check for check in json.loads(capsys.readouterr().out)}
    assert checks["capture"]["passed"] == (code == 0)
    assert ("capture twice" in checks) == (code == 0)
