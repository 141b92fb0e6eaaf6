"""The window until its first picture: it says what it waits for, and can be closed meanwhile.

Simulators and shaders may be compiled when they are first used, which takes up to a minute. That is
done in a thread of its own, one thing after the other, while the window answers.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from hairkit.errors import HairkitError
from hairkit.rendering.context import renderer
from hairkit.simulation.simulator import Grab, Surroundings
from hairkit.viewer.session import STEP, Session
from hairkit.viewer.window.hud import paper

TITLE = "hairkit"
_PATIENCE = (
    "Only the first time on a machine this takes a minute or two, for all is compiled then.",
    "Esc leaves.",
)
BEAT = 0.05
"""Seconds between two looks at mouse and keys."""
_Made = TypeVar("_Made")


class AbandonedError(HairkitError):
    """The user left before the first picture; a thread may still be at work."""


class Waiting:
    """Does work aside while a window says what is being done."""

    def __init__(self, glfw: Any, window: Any) -> None:
        self._glfw, self._window = glfw, window
        self._left = False
        glfw.set_key_callback(window, self._on_key)

    def until(self, title: str, work: Callable[[], _Made], *, draws: bool = False) -> _Made:
        """Return what `work` makes; the title and the seconds so far are shown until then.

        `draws` tells that the work draws all the time: the seconds are in the window's title only.

        Raises
        ------
        AbandonedError
            The window was closed, or Ctrl-C or Escape pressed.
        """
        made: list[_Made] = []
        failed: list[BaseException] = []

        def try_work() -> None:
            try:
                made.append(work())
            except BaseException as error:  # raised again in the thread that waits
                failed.append(error)

        try:
            self._show(title, 0)
            thread = threading.Thread(target=try_work, daemon=True)
            thread.start()
            self._wait(thread, title, draws)
        except KeyboardInterrupt as error:
            raise AbandonedError("interrupted before the first picture") from error
        if failed:
            raise failed[0]
        return made[0]

    def _wait(self, thread: threading.Thread, title: str, draws: bool) -> None:
        glfw, began, told = self._glfw, time.monotonic(), 0
        while thread.is_alive():
            thread.join(BEAT)
            glfw.poll_events()
            if self._left or glfw.window_should_close(self._window):
                raise AbandonedError("the window was closed before the first picture")
            if int(time.monotonic() - began) > told:
                told = int(time.monotonic() - began)
                glfw.set_window_title(self._window, f"{TITLE}: {title}, {told} s")
                if not draws:
                    self._show(title, told)
        glfw.set_window_title(self._window, TITLE)

    def _on_key(self, window: Any, key: int, scancode: int, event: int, mods: int) -> None:
        self._left = self._left or (key == self._glfw.KEY_ESCAPE and event == self._glfw.PRESS)

    def _show(self, title: str, seconds: int) -> None:
        """Bring words onto the screen, without a shader, which would be compiled first."""
        lines = [f"{title} ... {f'{seconds} s' if seconds else ''}", *_PATIENCE]
        width, height = self._glfw.get_framebuffer_size(self._window)
        with renderer() as gl:
            picture = np.flipud(paper((width, height), lines))
            texture = gl.context.texture((width, height), 4, np.ascontiguousarray(picture))
            drawn = gl.context.framebuffer([texture])
            screen = gl.context.detect_framebuffer(0)
            gl.context.copy_framebuffer(screen, drawn)
            self._glfw.swap_buffers(self._window)
            gl.home.use()
            drawn.release()
            texture.release()
        self._glfw.poll_events()


def warm_up(session: Session) -> None:
    """Let the simulator do once all that a user can ask of it, then put the hair back to rest.

    What is compiled at its first use is compiled now, and not when someone grabs a lock.
    """
    simulator = session.tuned.simulator
    points = simulator.points
    if not len(points):
        return
    x, y, z = points[-1].astype(float).tolist()
    wind = np.array([1.0, 0.0, 0.0])
    for grabs in ((), (Grab(len(points) - 1, (x, y, z)),)):
        around = Surroundings(np.eye(4), wind=wind, turbulence=0.1, grabs=grabs)
        simulator.advance(STEP, around)
    session.measures()
    session.reset()
