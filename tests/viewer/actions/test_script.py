"""Laws of scripts without a window."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from hairkit.errors import HairkitError, InputError, OptionError
from hairkit.rendering.context import renderer
from hairkit.viewer.actions.script import play, read_script
from hairkit.viewer.preview import Preview
from hairkit.viewer.session import Session

SCRIPT = """
size = [160, 120]
hairs = 600
steps = [
    {do = "screenshot", file = "rest.png"},
    {do = "wind", on = true, speed = 8.0, azimuth = 90.0},
    {do = "run", seconds = 0.2},
    {do = "screenshot", file = "wind.png"},
    {do = "orbit", right = 90.0},
    {do = "screenshot", file = "side.png"},
    {do = "record", on = true, file = "frames"},
    {do = "run", seconds = 0.1},
    {do = "record", on = false},
]
"""


def read(path: Path) -> np.ndarray:
    """Return a picture (H, W, 3)."""
    picture = cv2.imread(str(path))
    assert picture is not None
    return np.asarray(picture, int)


def write(folder: Path, text: str) -> Path:
    """Return the path of a new script."""
    path = folder / "steps.toml"
    path.write_text(text)
    return path


def test_a_script_does_what_a_user_would_do(session: Session, tmp_path: Path) -> None:
    """Its pictures show wind and turned camera; its recording has 30 pictures a second."""
    out = tmp_path / "out"
    with renderer() as gl:
        preview = Preview(gl, session)
        play(preview, read_script(write(tmp_path, SCRIPT)), out)
        preview.release()
    rest, wind, side = (read(out / f"{name}.png") for name in ("rest", "wind", "side"))
    assert rest.shape == (120, 160, 3)
    assert np.abs(rest - wind).max() > 60
    assert np.abs(wind - side).max() > 60
    # wind from the subject's left, the picture's right: hair reaches further to the left
    moved = np.abs(rest - wind).max(axis=2) > 30
    assert moved[:, :80].sum() > 0
    frames = sorted(path.name for path in (out / "frames").iterdir())
    assert frames == ["0000.png", "0001.png", "0002.png"]
    assert preview.written == [out / n for n in ("rest.png", "wind.png", "side.png", "frames")]


def test_a_script_run_again_gives_the_same_pictures(session: Session, tmp_path: Path) -> None:
    """Reset and framed, the same steps draw the same, and replace the files."""
    script = read_script(write(tmp_path, SCRIPT))
    with renderer() as gl:
        preview = Preview(gl, session)
        play(preview, script, tmp_path / "a")
        session.reset()
        session.frame()
        session.wind.blowing = False
        play(preview, script, tmp_path / "b")
        preview.release()
    for name in ("rest.png", "wind.png", "side.png"):
        assert (read(tmp_path / "a" / name) == read(tmp_path / "b" / name)).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("steps = 3", "start each step with"),
        ("[[steps]]\ndo = 'fly'", "step 1: no action 'fly'; valid: backdrop"),
        ("[[steps]]\ndo = 'zoom'", "step 1: zoom: missing value of factor"),
        ("[[steps]]\ndo = 'wind'\nspeeed = 3", "step 1: wind: no option 'speeed'"),
        ("[[steps]]\ndo = 'wind'\nspeed = 'fast'", "step 1: wind: option speed is 'fast'"),
        ("size = [3, 3]", "size"),
        ("hears = 3", "did you mean 'hairs'"),
        ("[[steps", "not a TOML file"),
    ],
)
def test_a_wrong_script_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    """The line names the file and what was wanted."""
    with pytest.raises((InputError, OptionError), match=message) as caught:
        read_script(write(tmp_path, text))
    assert "steps.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_step_that_fails_is_numbered(session: Session, tmp_path: Path) -> None:
    """The error of an action names the script's step, the first one being 1."""
    text = "[[steps]]\ndo = 'pause'\n[[steps]]\ndo = 'look'\nname = 'left'"
    script = read_script(write(tmp_path, text))
    with renderer() as gl, pytest.raises(HairkitError, match=r"step 2: no view 'left'"):
        play(Preview(gl, session), script, tmp_path)


def test_both_backends_draw_the_same(session: Session, tmp_path: Path) -> None:
    """OSMesa, in a process of its own, draws what EGL draws."""
    text = SCRIPT.replace('    {do = "run", seconds = 0.2},\n', "")
    script = write(tmp_path, text)
    words = ["view", session.opened.path, "--headless", "--script", script, "--simulator", "none"]
    command = [sys.executable, "-m", "hairkit", *map(str, words), "--out", str(tmp_path / "other")]
    environment = {**os.environ, "HAIRKIT_GL": "osmesa"}
    done = subprocess.run(command, capture_output=True, env=environment, text=True)
    if done.returncode and "no OpenGL" in done.stderr:
        pytest.skip(f"no OSMesa: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    assert "osmesa" in done.stderr
    with renderer() as gl:
        preview = Preview(gl, session)
        play(preview, read_script(script), tmp_path / "own")
        preview.release()
    pictures = [read(tmp_path / name / "rest.png") for name in ("own", "other")]
    assert np.abs(pictures[0] - pictures[1]).mean() < 1
