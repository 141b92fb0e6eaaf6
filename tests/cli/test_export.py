"""`hairkit export` and `hairkit info`: formats by ending, facts of every kind of file."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ball import PLUGIN_FILE, write_capture

from hairkit.cli import main
from hairkit.testing import bristle_groom, turn_scene


@pytest.fixture
def groom_file(tmp_path: Path) -> Path:
    """A small groom on disk."""
    bristle_groom().save(tmp_path / "groom.npz")
    return tmp_path / "groom.npz"


def test_the_ending_picks_the_plugin(groom_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file is written by the plugin of its ending and named on stdout."""
    target = groom_file.with_name("b.ball")
    assert main(["export", str(groom_file), "-o", str(target), "--plugin", str(PLUGIN_FILE)]) == 0
    assert capsys.readouterr().out == f"{target}\n"
    assert target.read_bytes() == bristle_groom().strands.points.tobytes()


def test_native_copies_are_equal(groom_file: Path) -> None:
    """Exporting the native groom as native changes no byte."""
    target = groom_file.with_name("b.npz")
    assert main(["export", str(groom_file), "-o", str(target)]) == 0
    assert target.read_bytes() == groom_file.read_bytes()


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["none.npz", "-o", "b.npz"], "no such file"),
        (["groom.npz", "-o", "b.xyz"], "no plugin writes this suffix; known: "),
        (["groom.npz", "-o", "none/b.npz"], "no such folder"),
        (["groom.npz", "-o", "b.npz", "--using", "gabor"], "implements 'export_groom'"),
        (["groom.npz", "-o", "b.npz", "--set", "native.x=1"], "no option 'x'"),
        (["groom.npz", "-o", "b.npz", "--set", "x"], "expected plugin.option=value"),
        (["groom.npz", "--for", "unreal", "-o", "groom.npz"], "groom.npz: not a folder"),
        (["groom.npz", "--for", "unreal", "-o", "b", "--using", "fbx"], "leave --using out"),
        (["none.npz", "--for", "unreal", "-o", "b"], "no such file"),
        (["groom.npz", "--for", "unreal", "-o", ""], "an argument is empty"),
        (["", "-o", "b.npz"], "an argument is empty"),
        (["groom.npz", "-o", "groom.npz"], "groom.npz: is the input file"),
    ],
)
def test_wrong_words_get_one_line(
    groom_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    reason: str,
) -> None:
    """What cannot be exported is said in one line, exit code 2, and nothing is written."""
    monkeypatch.chdir(groom_file.parent)
    assert main(["export", *words]) == 2
    printed = capsys.readouterr().err
    assert reason in printed
    assert printed.count("\n") == 1
    assert not (groom_file.parent / "b.npz").exists()


@pytest.mark.parametrize("words", [["-o", "web/hair.glb"], ["--for", "web", "-o", "web"]])
def test_what_is_read_is_not_written_over(
    groom_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
) -> None:
    """A file of bare strands would come back with a head that it never had."""
    monkeypatch.chdir(groom_file.parent)
    assert main(["export", "groom.npz", "--for", "web", "-o", "web"]) == 0
    before = Path("web/hair.glb").read_bytes()
    assert main(["export", "web/hair.glb", *words]) == 2
    assert "web/hair.glb: is the input file" in capsys.readouterr().err
    assert Path("web/hair.glb").read_bytes() == before


def info(capsys: pytest.CaptureFixture[str], path: Path) -> dict[str, object]:
    """What `hairkit info --json` prints; the text for people must work too."""
    assert main(["info", str(path)]) == 0
    assert capsys.readouterr().out.startswith("kind: ")
    assert main(["info", str(path), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert isinstance(facts, dict)
    return facts


def test_info_on_our_own_file_loads_no_plugin(groom_file: Path) -> None:
    """hairkit's own groom is read without plugins, compilers and SciPy: it takes a moment."""
    heavy = ("numba", "cv2", "scipy", "hairkit_plugins")
    code = (
        f"import sys; from hairkit.cli import main; main(['info', {str(groom_file)!r}]);"
        f"print('loaded', [m for m in {heavy} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("kind: groom")
    assert done.stdout.splitlines()[-1] == "loaded []"


def test_info_tells_what_a_groom_holds(
    groom_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Counts, lengths and bounds are those of the groom."""
    facts, strands = info(capsys, groom_file), bristle_groom().strands
    assert facts["strands"] == len(strands)
    assert facts["points"] == len(strands.points)
    assert facts["mean_length_m"] == pytest.approx(strands.lengths().mean(), abs=1e-4)
    assert facts["bounds_m"] == [
        pytest.approx(strands.points.min(axis=0), abs=1e-4),
        pytest.approx(strands.points.max(axis=0), abs=1e-4),
    ]


def test_info_tells_what_a_capture_and_a_scene_hold(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A capture's views and a scene's cameras are listed by name."""
    capture = info(capsys, write_capture(tmp_path / "c", masks=True))
    assert capture["kind"] == "capture"
    turn_scene().write_json(tmp_path / "scene.json")
    scene = info(capsys, tmp_path / "scene.json")
    assert list(scene["views"]) == list(capture["views"]) == list(turn_scene().names)
    angles = [view["azimuth_deg"] for view in scene["views"].values()]
    assert np.mod(angles, 360) == pytest.approx(45 * np.arange(8))


def test_info_names_what_it_cannot_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A missing file, an unknown ending and a file that is something else get one line."""
    (tmp_path / "a.npz").write_text("x")
    (tmp_path / "a.json").write_text("x")
    (tmp_path / "a.txt").write_text("x")
    for name in ("none", "a.npz", "a.json", "a.txt"):
        assert main(["info", str(tmp_path / name)]) == 2
        assert capsys.readouterr().err.count("\n") == 1
