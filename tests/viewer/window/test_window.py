"""Laws of the real window, opened under Xvfb: keys and mouse change what is on the screen."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from hairkit.testing import bristle_groom
from hairkit.viewer.window.mouse import LEFT, MIDDLE, RIGHT, Mouse

HERE = Path(__file__).parent


@dataclass
class Seen:
    """What the window showed and said."""

    folder: Path
    said: str

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the screen (H, W, 3) kept under a name, from its X window dump."""
        data = (self.folder / f"{name}.xwd").read_bytes()
        header = np.frombuffer(data[:100], ">u4")
        start = int(header[0] + 12 * header[19])
        width, height, line = int(header[4]), int(header[5]), int(header[12])
        rows = np.frombuffer(data[start : start + height * line], np.uint8).reshape(height, line)
        return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1].astype(int)

    def differ(self, first: str, second: str, levels: int = 25) -> np.ndarray:
        """Return (H, W) where two screens differ visibly, by more than so many levels of 255."""
        result: np.ndarray = np.abs(self[first] - self[second]).max(axis=2) > levels
        return result


@pytest.fixture(scope="module")
def screens(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Seen]:
    """A session of mouse and keys in a real window."""
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb; on Debian: apt-get install xvfb")
    folder = tmp_path_factory.mktemp("window")
    bristle_groom().save(folder / "groom.npz")
    numbers, signal = os.pipe()
    command = ["Xvfb", "-screen", "0", "320x240x24", "-fbdir", str(folder), "-nolisten", "tcp"]
    server = subprocess.Popen(
        [*command, "-displayfd", str(signal)], pass_fds=[signal], stderr=subprocess.DEVNULL
    )
    os.close(signal)
    try:
        with os.fdopen(numbers) as reader:
            display = reader.readline().strip()
        words = [HERE / "drive_window.py", folder / "groom.npz", folder, folder]
        paths = os.pathsep.join(
            [str(HERE.parents[1] / "support"), os.environ.get("PYTHONPATH", "")]
        )
        environment = {**os.environ, "DISPLAY": f":{display}", "PYTHONPATH": paths}
        environment.pop("WAYLAND_DISPLAY", None)
        done = subprocess.run(
            [sys.executable, *map(str, words)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
        )
        if done.returncode and "no window" in done.stderr:
            pytest.skip(f"no window here: {done.stderr.strip().splitlines()[-1]}")
        assert done.returncode == 0, done.stderr
        yield Seen(folder, done.stdout)
    finally:
        server.terminate()
        server.wait(timeout=10)


def test_the_screen_shows_hair_on_a_head_before_the_studio(screens: Seen) -> None:
    """Grey at the border, bristles above the head against the grey, skin redder than blue."""
    screen = screens["start"]
    assert np.ptp(screen[:20].reshape(-1, 3), axis=1).max() < 20
    above = screen[44:56, 130:190].mean(axis=2)
    assert above.min() < above.max() - 40
    skin = screen[165:175, 150:170].reshape(-1, 3)
    assert (skin[:, 0] > skin[:, 2] + 25).all()


def test_the_wind_key_moves_the_tips_and_they_come_back(screens: Seen) -> None:
    """Wind from the subject's left blows hair to the picture's left; a second press ends it."""
    moved = screens.differ("start", "wind")
    assert moved.sum() > 100
    columns = np.nonzero(moved)[1]
    assert columns.min() < 110
    assert screens.differ("start", "calm").sum() < 0.1 * moved.sum()


def test_dragging_turns_the_camera_and_home_turns_it_back(screens: Seen) -> None:
    """The picture changes much while turned; the wheel makes everything larger."""
    assert screens.differ("start", "orbit").sum() > 300
    assert screens.differ("start", "near").sum() > 3000


def test_a_brush_combs_and_undo_takes_it_back(screens: Seen) -> None:
    """A left drag with a brush moves hair, not the camera; control and Z bring the picture back."""
    assert "brush comb, 3.0 cm on hair; 1 strokes" in screens.said
    moved = screens.differ("brush", "combed").sum()
    assert moved > 30
    assert screens.differ("brush", "undone").sum() < 0.2 * moved


def test_a_grabbed_strand_follows_the_mouse(screens: Seen) -> None:
    """The held point is where the mouse is, and the screen shows the few thin hairs that follow."""
    assert "pulled: True" in screens.said
    assert screens.differ("start", "grab", levels=6).sum() > 100
    assert not screens.differ("start", "calm", levels=6).any()


def test_the_help_sheet_is_legible(screens: Seen) -> None:
    """Light letters on dark paper cover much of the screen."""
    sheet = screens["help"]
    assert (sheet.min(axis=2) > 215).sum() > 500
    assert screens.differ("near", "help").mean() > 0.3


def test_errors_are_told_and_escape_leaves(screens: Seen) -> None:
    """A dropped file that is not there gives a line, not an end; Escape ends."""
    assert "message: no-such-file.npz: no such file" in screens.said
    assert "finished: True" in screens.said


class Heard:
    """Keeps what a mouse asks for."""

    def __init__(self) -> None:
        self.done: list[tuple[str, dict[str, object]]] = []
        self.mouse = Mouse(lambda name, values: self.done.append((name, dict(values))), 100.0)

    @property
    def names(self) -> list[str]:
        """Names of the actions so far."""
        return [name for name, _ in self.done]


@pytest.mark.parametrize(
    ("button", "mods", "action"),
    [
        (LEFT, 0, "orbit"),
        (LEFT, 1, "pan"),
        (MIDDLE, 0, "pan"),
        (RIGHT, 0, "zoom"),
        (LEFT, 2, "drag"),
    ],
)
def test_each_button_drags_its_own_way(button: int, mods: int, action: str) -> None:
    """A drag does its action, once a move, and no click."""
    heard = Heard()
    heard.mouse.press(button, mods)
    heard.mouse.move(30.0, 10.0)
    heard.mouse.release(time.monotonic())
    heard.mouse.move(50.0, 10.0)
    assert heard.names.count(action) == 1
    assert not {"pick", "recentre"} & set(heard.names)


def test_clicks_pick_and_double_clicks_recentre() -> None:
    """Two clicks count as one double click only when they follow at once."""
    heard = Heard()
    for now in (1.0, 1.1, 5.0):
        heard.mouse.press(LEFT, 0)
        heard.mouse.release(now)
    assert heard.names == ["pick", "recentre", "pick"]


def test_a_grab_is_let_go_with_the_button() -> None:
    """Grab, drag, release: in this order, with the mouse's places."""
    heard = Heard()
    heard.mouse.move(10.0, 20.0)
    heard.mouse.press(LEFT, 2)
    heard.mouse.move(15.0, 20.0)
    heard.mouse.release(1.0)
    assert heard.done == [
        ("grab", {"x": 10.0, "y": 20.0}),
        ("drag", {"x": 15.0, "y": 20.0}),
        ("release", {}),
    ]


def test_a_drag_at_the_line_between_photo_and_hair_moves_it() -> None:
    """Elsewhere it orbits."""
    heard = Heard()
    heard.mouse.width, heard.mouse.wipe = 200.0, 0.5
    heard.mouse.move(103.0, 20.0)
    heard.mouse.press(LEFT, 0)
    heard.mouse.move(150.0, 20.0)
    heard.mouse.release(1.0)
    assert heard.done == [("wipe", {"at": 0.75})]
    heard.mouse.press(LEFT, 0)
    heard.mouse.move(160.0, 20.0)
    assert heard.names[-1] == "orbit"
