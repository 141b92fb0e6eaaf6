"""Laws of `hairkit render` and `hairkit synth`."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from hairkit.cli import main
from hairkit.evaluation.truth import read_truth
from hairkit.rendering.framing import framing_cameras
from hairkit.testing import bristle_groom, turn_scene


@pytest.fixture(scope="module")
def groom_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("groom") / "groom.npz"
    bristle_groom().save(path)
    return path


def run(*words: object) -> int:
    return main([str(word) for word in words])


def test_render_writes_a_picture_of_the_size_asked_for(groom_path: Path, tmp_path: Path) -> None:
    """The file has the size given, and shows more than the background."""
    out = tmp_path / "a.png"
    assert run("render", groom_path, "-o", out, "--size", "120x90", "--hairs", "500") == 0
    picture = cv2.imread(str(out))
    assert picture is not None
    assert picture.shape == (90, 120, 3)
    assert np.ptp(np.asarray(picture)[45]) > 40


def test_a_turntable_is_numbered(groom_path: Path, tmp_path: Path) -> None:
    """N pictures all around, their names in order."""
    words = ("--turntable", 3, "--size", "40x40", "--camera", "10,20", "--hairs", 1)
    assert run("render", groom_path, "-o", tmp_path / "t.png", *words) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t_0.png", "t_1.png", "t_2.png"]


def test_a_scene_gives_its_cameras(groom_path: Path, tmp_path: Path) -> None:
    """A view of scene.json is drawn at its own size; an unknown one is answered with the known."""
    scene = turn_scene()
    scene.write_json(tmp_path / "scene.json")
    words = ("--scene", tmp_path / "scene.json", "--view", scene.names[2], "--hairs", 1)
    assert run("render", groom_path, "-o", tmp_path / "v.png", *words) == 0
    picture = cv2.imread(str(tmp_path / "v.png"))
    assert picture is not None
    assert picture.shape[:2] == (scene.cameras[2].height, scene.cameras[2].width)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--camera", "above"], "--camera is 'above', expected azimuth,elevation"),
        (["--camera", "0,90"], "elevation between"),
        (["--size", "12"], "--size is '12', expected WIDTHxHEIGHT"),
        (["--hairs", "0"], "--hairs is 0, expected 1 to"),
        (["--turntable", "0"], "--turntable is 0"),
        (["--view", "front"], "needs --scene"),
        (["-o", "a.gif", "--size", "8x8"], "written as .png or .jpg"),
    ],
)
def test_wrong_words_give_one_line(
    words: list[str],
    said: str,
    groom_path: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit code 2, one line, and nothing written."""
    target = [] if "-o" in words else ["-o", tmp_path / "x.png"]
    assert (
        run("render", groom_path, *target, *words, *(["--size", "8x8"] if "-o" in words else []))
        == 2
    )
    error = capsys.readouterr().err.strip().splitlines()
    assert said in error[-1]
    assert not list(tmp_path.iterdir())


def test_framing_shows_everything_and_no_more() -> None:
    """From any side all points are inside the picture, and some reach its margin."""
    points = np.random.default_rng(0).normal(0, [0.1, 0.3, 0.05], (400, 3))
    for camera in framing_cameras(points, [(0, 0), (70, 30), (200, -40)], 160, 90):
        pixels = camera.project(points) / [160, 90]
        assert pixels.min() > 0
        assert pixels.max() < 1
    alone = framing_cameras(points, [(0, 0)], 160, 90)[0].project(points) / [160, 90]
    assert max(alone.max(), 1 - alone.min()) > 0.93


def test_synth_makes_a_capture_with_its_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Photos and truth are there for the next command, and the folder is printed."""
    out = tmp_path / "short"
    assert run("synth", "short", "-o", out, "--strands", 200, "--size", "72x96") == 0
    assert capsys.readouterr().out.strip() == str(out)
    assert len(list((out / "photos").iterdir())) == 8
    assert len(read_truth(out).strands) == 200
    assert run("synth", "mohawk", "-o", out) == 2
    assert "no style 'mohawk'" in capsys.readouterr().err
