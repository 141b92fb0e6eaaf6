"""The wait screen of the window: shows the current task and its time; it can be closed.

Simulators and shaders are compiled at their first use, which takes up to a minute. That runs in a
thread while the window handles events.
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
from hairkit.viewer.window.hud import message_page

TITLE = "hairkit"
_ADVICE = (
    "The first start on a machine takes a minute or two to compile everything.",
    "Esc quits.",
)
POLL_INTERVAL = 0.05
"""Seconds between two polls for events."""
WARM_UP_WIND, WARM_UP_TURBULENCE = (1.0, 0.0, 0.0), 0.1
"""Air of the step that compiles the simulator, m/s and share: neither is 0, so gusts are run."""
_Made = TypeVar("_Made")


class AbandonedError(HairkitError):
    """The user quit before the first picture; a thread may still be running."""


class WaitScreen:
    """Runs tasks in a thread while a window shows their titles."""

    def __init__(self, glfw: Any, window: Any) -> None:
        self._glfw, self._window = glfw, window
        self._left = False
        glfw.set_key_callback(window, self._on_key)

    def run(self, title: str, work: Callable[[], _Made], *, draws: bool = False) -> _Made:
        """Return the result of `work`; show the title and the elapsed seconds meanwhile.

        If `draws`, the work may hold the OpenGL context: only the window's title is updated.

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
            except BaseException as error:  # raised again in the waiting thread
                failed.append(error)

        try:
            if not draws:
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
            thread.join(POLL_INTERVAL)
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
        """Draw the text without a shader, since a shader would have to be compiled first."""
        lines = [f"{title} ... {f'{seconds} s' if seconds else ''}", *_ADVICE]
        width, height = self._glfw.get_framebuffer_size(self._window)
        with renderer() as gl:
            picture = np.flipud(message_page((width, height), lines))
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
    """Run the simulator once with wind and a grab, then reset it, so that all of it is compiled.

    Otherwise the first grab would wait for the compiler.
    """
    simulator = session.simulation.simulator
    points = simulator.points
    if not len(points):
        return
    x, y, z = points[-1].astype(float).tolist()
    wind = np.array(WARM_UP_WIND)
    for grabs in ((), (Grab(len(points) - 1, (x, y, z)),)):
        around = Surroundings(np.eye(4), wind=wind, turbulence=WARM_UP_TURBULENCE, grabs=grabs)
        simulator.advance(STEP, around)
    session.measures()
    session.reset()
