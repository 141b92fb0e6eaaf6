"""The record of a run names everything that the result depends on, and brings it back."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import ball_plugin
import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

import hairkit
from hairkit.cli import main
from hairkit.errors import FormatError, InputError
from hairkit.io.capture_reader import read_capture
from hairkit.io.head_reader import write_head_obj
from hairkit.manager import Manager
from hairkit.pipeline.recipe import parse_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.rerun import changed_versions, rerun
from hairkit.pipeline.run_record import RECORD, input_files, read_record
from hairkit.storage import write_text
from hairkit.testing import ball_head, turn_capture

PARTING = ["--parting", "left"]


def run_in(folder: Path, recipe: str = RECIPE) -> Path:
    """The results of the small capture, with masks, strokes, a head's file and an option."""
    capture = write_capture(folder / "capture", masks=True)
    (folder / "ball.toml").write_text(recipe)
    write_head_obj(folder / "head.obj", ball_head())
    words = ["reconstruct", str(capture), "-o", str(folder / "out"), "--guides", "20"]
    words += ["--recipe", str(folder / "ball.toml"), "--plugin", str(PLUGIN_FILE), "--quiet"]
    words += ["--head", str(folder / "head.obj"), "--set", "ball_plugin.length=0.05"]
    assert main([*words, "--no-sheet", "--seed", "3", "--max-edge", "128", *PARTING]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a run, which tests only read."""
    return run_in(tmp_path_factory.mktemp("run"))


def test_the_record_names_all_that_the_result_depends_on(out: Path) -> None:
    """Inputs and outputs with their SHA-256, plugins, options, versions, times and health."""
    record = read_record(out / RECORD)
    capture = out.parent / "capture"
    wanted = {*capture.glob("photos/*"), *capture.glob("masks/*"), out.parent / "head.obj"}
    assert wanted | {PLUGIN_FILE} <= {Path(file.path) for file in record.inputs}
    for file in record.inputs:
        assert file.sha256 == hashlib.sha256(Path(file.path).read_bytes()).hexdigest()
    assert {file.path for file in record.outputs} == {"groom.npz", "scene.json", "groom.ball"}
    for file in record.outputs:
        assert file.sha256 == hashlib.sha256((out / file.path).read_bytes()).hexdigest()
    assert (record.guides, record.seed, record.max_edge) == (20, 3, 128)
    assert record.parting == "left"
    assert record.hairkit == hairkit.__version__
    assert {"python", "numpy", "cv2"} <= set(record.libraries)
    assert {plugin.plugin for plugin in record.plugins} == {"ball_plugin"}
    assert all(plugin.options == {"delay": 0.0, "length": 0.05} for plugin in record.plugins)
    assert {"segment", "track"} <= {stage.stage for stage in record.stages}
    assert {"strands", "hull"} <= {figure.stage for figure in record.health}


def test_a_rerun_gives_the_same_bytes(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Groom, scene and exports of the second run are those of the first, its record too."""
    again = tmp_path / "again"
    assert main(["rerun", str(out / RECORD), "-o", str(again), "--quiet"]) == 0
    assert capsys.readouterr().out.count(": the same bytes") == 3
    for name in ("groom.npz", "scene.json", "groom.ball"):
        assert (out / name).read_bytes() == (again / name).read_bytes()
    first, second = read_record(out / RECORD), read_record(again / RECORD)
    for field in ("inputs", "outputs", "plugins", "health", "photos", "head", "parting"):
        assert getattr(first, field) == getattr(second, field), field


@pytest.mark.parametrize("name", ["capture/photos/4_back.png", "capture/masks/0_front.png"])
def test_a_changed_input_is_named(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line says which file has changed; --force takes it as it is, a missing one is missing."""
    out = run_in(tmp_path)
    file = out.parent / name
    file.write_bytes(
        file.with_name(file.name.replace("4_back", "3_back-left")).read_bytes() + b"\0"
    )
    words = ["rerun", str(out / RECORD), "-o", str(out.parent / "again"), "--quiet"]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"hairkit: {file}: changed since")
    assert said.count("\n") == 1
    assert main([*words, "--force"]) == 0
    file.unlink()
    assert main([*words, "--force"]) == 2
    assert f"{file}: no such file" in capsys.readouterr().err


def test_the_scene_names_the_photo_of_every_view(out: Path) -> None:
    """Each camera of scene.json says which file it belongs to."""
    views = json.loads((out / "scene.json").read_text())["views"]
    photos = sorted(path.name for path in (out.parent / "capture" / "photos").iterdir())
    assert [view["photo"] for view in views] == photos
    assert all(view["photo"].endswith(f"_{view['name']}.png") for view in views)


def test_files_of_engines_are_recorded_and_made_again(tmp_path: Path) -> None:
    """A recipe's engines have folders of their own; the record names each file in them."""
    made = run_in(tmp_path, RECIPE.replace("[export]", '[export]\nfor = ["maya", "hairworks"]'))
    files = {file.path for file in read_record(made / RECORD).outputs}
    assert files > {"maya/hair.abc", "maya/guides.ma", "maya/head.fbx", "hairworks/hair.apx"}
    assert all((made / file).is_file() for file in files)
    again = rerun(made / RECORD, tmp_path / "again")
    assert (set(again.same), again.different) == (files, ())


def test_other_versions_are_told(out: Path, tmp_path: Path) -> None:
    """Whatever is of another version than in the record has a line."""
    document = json.loads((out / RECORD).read_text())
    document["libraries"]["numpy"] = "1.0"
    document["hairkit"] = "0.0.1"
    write_text(tmp_path / RECORD, json.dumps(document))
    record = read_record(tmp_path / RECORD)
    lines = changed_versions(record, Manager.loaded(record.plugin_files()))
    assert [line.partition(":")[0] for line in lines] == ["hairkit", "numpy"]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"run_record": 99}', '{"run_record": 1}'])
def test_what_is_no_record_is_refused(tmp_path: Path, text: str) -> None:
    """A file of anything else gives one line that names it."""
    (tmp_path / RECORD).write_text(text)
    with pytest.raises(FormatError, match=str(tmp_path / RECORD)):
        read_record(tmp_path / RECORD)


def test_a_run_on_objects_cannot_be_brought_back(tmp_path: Path) -> None:
    """Photos and heads that were never files are said to be missing."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    recipe = parse_recipe(RECIPE.encode(), "ball", "test")
    reconstruct(turn_capture(), tmp_path, recipe, manager, head=ball_head(), sheet=False)
    with pytest.raises(InputError, match="photos of this run were given as objects"):
        rerun(tmp_path / RECORD, tmp_path / "again")


def test_records_name_stages_as_they_were_called(tmp_path: Path) -> None:
    """A record of version 0.2 has `head` for `fit`, and is the same recipe."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    recipe = parse_recipe(RECIPE.encode(), "ball", "test")
    reconstruct(turn_capture(), tmp_path, recipe, manager, head=ball_head(), sheet=False)
    text = (tmp_path / RECORD).read_text()
    assert '"stage": "fit"' in text
    (tmp_path / "old.json").write_text(text.replace('"stage": "fit"', '"stage": "head"'))
    new, old = (read_record(tmp_path / name).as_recipe() for name in (RECORD, "old.json"))
    assert new.stages == old.stages
    assert new.stage("fit") is not None


def test_what_lies_beside_the_photos_is_recorded(tmp_path: Path) -> None:
    """Landmarks, choices and strokes count among the files of a run, where they are."""
    folder = write_capture(tmp_path / "c")
    written = {
        "landmarks.json": '{"views": {}}',
        "capture.toml": "",
        "edits.json": '{"strokes": []}',
    }
    assert not set(written) & {path.name for path in input_files(read_capture(folder))}
    for name, text in written.items():
        (folder / name).write_text(text)
    assert set(written) <= {path.name for path in input_files(read_capture(folder))}
