"""Run under Xvfb by test_window.py: opens the window, plays mouse and keys, keeps screens.

drive_window.py GROOM FRAMEBUFFER_FOLDER OUT_FOLDER
"""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import swaying

from hairkit.manager import Manager
from hairkit.viewer.session import Session
from hairkit.viewer.window.window import Window, open_window

SIZE = (320, 240)


def main() -> None:
    """Do what a user does."""
    groom, screen, out = map(Path, sys.argv[1:4])
    manager = Manager()
    manager.register(swaying, "swaying")
    make = lambda size: Session(manager, groom, size=size, hairs=800)  # noqa: E731
    with open_window(make, SIZE, 0.0) as window:
        window.session.shown.panel = window.session.shown.numbers = False
        window.session.message = ""  # the greeting, which goes with the first action
        drive(window, lambda name: keep(window, screen, out / f"{name}.xwd"))


def keep(window: Window, screen: Path, path: Path) -> None:
    """Show some pictures, then copy what is on the screen."""
    for _ in range(14):  # light is brought up to date in turns
        window._glfw.poll_events()
        window.picture(1 / 30)
    time.sleep(0.2)
    shutil.copy(screen / "Xvfb_screen0", path)


def drive(window: Window, screen: Any) -> None:
    """Press, drag and look."""
    glfw, handle = window._glfw, window._window
    press = lambda key, mods=0: window.on_key(handle, key, 0, glfw.PRESS, mods)  # noqa: E731
    screen("start")
    press(glfw.KEY_W)
    press(glfw.KEY_UP)
    screen("wind")
    press(glfw.KEY_W)
    screen("calm")
    window.on_move(handle, 160, 120)
    window.on_button(handle, glfw.MOUSE_BUTTON_LEFT, glfw.PRESS, 0)
    window.on_move(handle, 240, 120)
    window.on_button(handle, glfw.MOUSE_BUTTON_LEFT, glfw.RELEASE, 0)
    screen("orbit")
    press(glfw.KEY_HOME)
    grab(window, screen)
    comb(window, screen, press)
    window.on_scroll(handle, 0.0, 4.0)
    screen("near")
    press(glfw.KEY_H)
    screen("help")
    window.on_drop(handle, ["no-such-file.npz"])
    print("message:", window.session.message)
    press(glfw.KEY_ESCAPE)
    print("finished:", window.session.finished)


def comb(window: Window, screen: Any, press: Any) -> None:
    """Take the first brush, comb hair on top to the right, undo that, and put the brush away."""
    glfw, handle, session = window._glfw, window._window, window.session
    press(glfw.KEY_M)
    screen("brush")
    x, y = session.camera().project(np.array([0, 0.115, 0.03])).tolist()
    window.on_move(handle, x, y)
    window.on_button(handle, glfw.MOUSE_BUTTON_LEFT, glfw.PRESS, 0)
    for step in range(1, 7):
        window.on_move(handle, x + 5 * step, y)
    window.on_button(handle, glfw.MOUSE_BUTTON_LEFT, glfw.RELEASE, 0)
    screen("combed")
    print("brush:", session.brushing.told)
    press(glfw.KEY_Z, glfw.MOD_CONTROL)
    screen("undone")
    window.perform("brush", {"name": "none"})


def grab(window: Window, screen: Any) -> None:
    """Take the front-most tip, drag it to the right, and tell where it went."""
    glfw, handle, session = window._glfw, window._window, window.session
    camera, simulator = session.camera(), session.simulation.simulator
    tips = simulator.strands.offsets[1:] - 1
    tip = tips[camera.depth(simulator.points[tips]).argmin()]
    x, y = camera.project(simulator.points[tip]).tolist()
    window.on_move(handle, x, y)
    window.on_button(handle, glfw.MOUSE_BUTTON_LEFT, glfw.PRESS, glfw.MOD_CONTROL)
    window.on_move(handle, x + 60, y - 20)
    screen("grab")
    assert session.grabbed_lock is not None
    seen = camera.project(simulator.points[session.grabbed_lock.points]).tolist()
    print("pulled:", min(abs(px - x - 60) + abs(py - y + 20) for px, py in seen) < 2)
    window.on_button(handle, glfw.MOUSE_BUTTON_LEFT, glfw.RELEASE, 0)


if __name__ == "__main__":
    main()
