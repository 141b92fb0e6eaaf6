"""The window: passes events to actions and shows the frames that the preview draws.

Its OpenGL context becomes the one that all of hairkit uses in this process.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from hairkit.errors import HairkitError, RenderError, one_line
from hairkit.rendering.context import REQUIRED_VERSION, install, renderer
from hairkit.rendering.gl_camera import set_uniforms
from hairkit.viewer.actions.actions import bindings, perform
from hairkit.viewer.actions.script import Script, run_steps
from hairkit.viewer.draw.frame_budget import Budget
from hairkit.viewer.preview import Preview
from hairkit.viewer.recording import FRAMES_PER_SECOND
from hairkit.viewer.session import Session
from hairkit.viewer.window.file_watcher import FileWatcher, shader_files
from hairkit.viewer.window.gl_context import WindowContext
from hairkit.viewer.window.hud import overlay
from hairkit.viewer.window.keyboard import key_name
from hairkit.viewer.window.mouse import Mouse
from hairkit.viewer.window.panel import Panel
from hairkit.viewer.window.splash import AbandonedError, WaitScreen, warm_up
from hairkit.viewer.window.stillness import Stillness

TEXT_EVERY = 0.25
"""Seconds between two updates of the read-outs; messages appear at once."""
IDLE = 0.1
"""Seconds between pictures while the simulation is paused, and between looks in sleep."""
REFRESH_RATE = 60
"""Pictures a second at most where the screen does not tell its own."""
MAX_FRAME_STEP = 0.1
"""Longest time step of a frame, seconds; slower frames slow the simulation down."""
SIMULATION_SHARE = 0.4
"""Part of the frame budget that the simulation may take; drawing has the rest."""
PACE_SMOOTHING = 0.2
"""Weight of the newest frame in the displayed frame rate."""
PICTURE_UNIT, TEXT_UNIT = 5, 6
"""Texture units that `viewer_blit` reads."""


def show(
    make_session: Callable[[tuple[int, int]], Session],
    size: tuple[int, int],
    *,
    script: Script | None = None,
    budget: float = 1 / 20,
) -> None:
    """Open the window; return when it is closed or interrupted.

    Parameters
    ----------
    make_session
        Makes the session for a picture size; called once OpenGL is ready, which simulators may use.
    size
        Width and height, pixels.
    script
        Actions to perform first.
    budget
        Seconds that a frame may take before the quality is lowered.

    Raises
    ------
    RenderError
        No window can be opened, or it has no OpenGL 4.3; the message says what to install.
    AbandonedError
        The window was closed before its first picture; a thread may still be running.
    """
    with open_window(make_session, size, budget) as window, contextlib.suppress(KeyboardInterrupt):
        window.loop(None if script is None else run_steps(window.session, script, Path()))


@contextlib.contextmanager
def open_window(
    make_session: Callable[[tuple[int, int]], Session], size: tuple[int, int], budget: float
) -> Iterator[Window]:
    """Open a window for a block; see `show`."""
    context = WindowContext(size)
    try:
        install(moderngl.create_context(REQUIRED_VERSION, **context.settings), "window")
        window = _start_window(context, make_session, size, budget)
    except AbandonedError:  # a thread may still use the context, so it stays until the process ends
        context.glfw.hide_window(context.window)
        raise
    except BaseException:
        context.close()
        raise
    try:
        yield window
    finally:
        window.leave()
        context.close()


def _start_window(
    context: WindowContext,
    make_session: Callable[[tuple[int, int]], Session],
    size: tuple[int, int],
    budget: float,
) -> Window:
    """Return the window; it shows guides first, then all hair, then the simulator is made."""
    waiting = WaitScreen(context.glfw, context.window)
    session = waiting.run("opening the groom", lambda: make_session(size))
    window = Window(context, session, budget)
    waiting.run("drawing guides", window.draw_hidden, draws=True)
    window.show_hidden()
    waiting.run("making hair between the guides", session.fill_in, draws=True)
    waiting.run("drawing all hair", window.draw_hidden, draws=True)
    window.show_hidden()
    waiting.run("compiling the simulator", lambda: warm_up(session), draws=True)
    window.listen()
    return window


class Window:
    """The main loop: handles events, simulates, draws."""

    def __init__(self, context: WindowContext, session: Session, budget: float) -> None:
        self._glfw, self._window = context.glfw, context.window
        self.session = session
        self._max_seconds = SIMULATION_SHARE * budget if budget > 0 else None
        self._keys = bindings()
        self.mouse = Mouse(self.perform, session.size[1])
        self._watched = session.opened.path
        self._watch_groom = FileWatcher([self._watched])
        self._watch_shaders = FileWatcher(shader_files())
        self._period = 1 / (context.refresh_rate or REFRESH_RATE)
        self._pace = 0.0
        """Moving average of the frame time, seconds."""
        self._shown_samples = True
        """False once the still picture is complete and shown."""
        self._told: object = None
        self._told_at = 0.0
        with renderer() as gl:
            self._gl = gl
            self.preview = Preview(gl, session, Budget(budget))
            program = gl.program("viewer_screen", "viewer_blit")
            self._blit = gl.context.vertex_array(program, [])
            self._text = gl.context.texture((1, 1), 4, b"\0\0\0\0")
            self._screen = gl.context.detect_framebuffer(0)
            self._panel = Panel(self._window)
        self._stillness = Stillness(session, time.monotonic())
        self._warnings = _Warnings(session)
        logging.getLogger("hairkit").addHandler(self._warnings)
        session.message = session.message or "press H for the keys"

    def perform(self, name: str, values: Mapping[str, object]) -> None:
        """Perform an action; show its error as a message."""
        self._stir()
        self.session.message = ""
        try:
            with renderer():
                perform(self.session, name, values)
        except (HairkitError, OSError) as error:
            self.session.message = one_line(error)
        if name == "panel" and self.session.shown.panel:
            self.session.message = self._panel.missing

    def loop(self, steps: Iterator[None] | None = None) -> None:
        """Draw until the window is closed; `next(steps)` performs an action of a script."""
        before = time.perf_counter()
        self._stir()
        while not (self.session.finished or self._glfw.window_should_close(self._window)):
            if steps is None and self._stillness.asleep(time.monotonic()):
                self._refine_or_sleep()
                self._reload_changed()
                before = time.perf_counter()
                continue
            self._listen_for_events()
            steps = self._next(steps)
            passed = time.perf_counter() - before
            if self.session.recorder is not None:  # a recording has a fixed frame time
                wait, passed = 1 / FRAMES_PER_SECOND - passed, 1 / FRAMES_PER_SECOND
                time.sleep(max(wait, 0.0))
            before = time.perf_counter()
            passed = min(passed, MAX_FRAME_STEP)
            self.picture(passed)
            self.session.pending = max(self.session.pending - passed, 0.0)
            time.sleep(max(before + self._period - time.perf_counter(), 0.0))

    def _refine_or_sleep(self) -> None:
        """Add a sample to the still picture and show it; wait for events once it is complete."""
        with renderer() as gl:
            sampled = self.preview.refine()
            if sampled or self._shown_samples:
                self._present(gl)
        self._shown_samples = sampled
        if sampled:
            self._glfw.poll_events()
        else:
            self._glfw.wait_events_timeout(IDLE)

    def _stir(self, *_: object) -> None:
        """Draw for a while: an event has arrived."""
        self._stillness.stir(time.monotonic())

    def _listen_for_events(self) -> None:
        """Handle mouse and keys; wait for them a little if nothing moves."""
        still = self.session.paused and not self.session.pending
        if self.session.recorder is None and still:
            self._glfw.wait_events_timeout(IDLE)
        self._glfw.poll_events()

    def leave(self) -> None:
        """Finish the recording."""
        logging.getLogger("hairkit").removeHandler(self._warnings)
        if self.session.recorder is not None:
            self.session.recorder.close()

    def draw_hidden(self) -> None:
        """Draw a picture without showing it, so that all shaders are compiled."""
        with renderer():
            self.preview.draw()

    def show_hidden(self) -> None:
        """Show the picture drawn last, without the panel, which may ask for the simulator."""
        with renderer() as gl:
            self._show(gl)
            self._glfw.swap_buffers(self._window)
            gl.home.use()

    def picture(self, seconds: float) -> None:
        """Simulate `seconds` and show a picture."""
        began = time.perf_counter()
        self._fit()
        self._reload_changed()
        filmed = self.session.recorder is not None
        self.session.max_seconds = None if filmed else self._max_seconds
        with renderer() as gl:
            try:
                self.preview.frame(seconds, still=filmed or bool(self.session.screenshots))
            except (HairkitError, OSError) as error:  # for example a full disk
                self.session.message = one_line(error)
                self.session.paused, self.session.recorder = True, None
                self.session.screenshots = []
            self._present(gl)
        self._shown_samples = True
        taken = max(time.perf_counter() - began, self._period)
        self._pace += PACE_SMOOTHING * (taken - self._pace) if self._pace else taken

    def _next(self, steps: Iterator[None] | None) -> Iterator[None] | None:
        """Perform the next action of a script once the last one is finished."""
        session = self.session
        if steps is None or session.pending > 1e-9:
            return steps
        try:
            with renderer():
                next(steps)
        except StopIteration:
            return None
        except (HairkitError, OSError) as error:
            session.message = one_line(error)
            return None
        return steps

    def _present(self, gl: Any) -> None:
        """Show the picture, the text and the panel on the screen."""
        self._show(gl)
        self._panel.draw(self.session, self.preview, self.perform)
        if self._panel.covered != self.session.covered:
            self.session.covered = self._panel.covered
            self._stir()  # the hair moves beside the panel
        self._glfw.swap_buffers(self._window)
        gl.home.use()

    def _show(self, gl: Any) -> None:
        """Draw the picture and the text to the screen."""
        if self._text_is_old():
            self._write_text()
        size = self._glfw.get_framebuffer_size(self._window)
        self._screen.use()
        gl.context.viewport = (0, 0, *size)
        gl.context.enable_only(moderngl.NOTHING)
        self.preview.frame_renderer.texture.use(PICTURE_UNIT)
        self._text.use(TEXT_UNIT)
        program = gl.program("viewer_screen", "viewer_blit")
        set_uniforms(program, u_picture=PICTURE_UNIT, u_text=TEXT_UNIT, u_size=size)
        self._blit.render(moderngl.TRIANGLES, vertices=3)

    def _text_is_old(self) -> bool:
        session, now = self.session, time.monotonic()
        told = (session.message, session.shown.help, session.shown.numbers, session.size)
        if told == self._told and now - self._told_at < TEXT_EVERY:
            return False
        self._told, self._told_at = told, now
        return True

    def _write_text(self) -> None:
        readings = replace(self.preview.readings, fps=1 / max(self._pace, 1e-6))
        image = overlay(self.session.size, self.session, readings)
        image = np.zeros((1, 1, 4), np.uint8) if image is None else image
        size = (image.shape[1], image.shape[0])
        if self._text.size != size:
            self._text.release()
            self._text = self._gl.context.texture(size, 4)
        self._text.write(image.tobytes())

    def _fit(self) -> None:
        width, height = self._glfw.get_framebuffer_size(self._window)
        if width > 0 and height > 0:
            self.session.size = (width, height)
            self.mouse.width, self.mouse.height = width, height
        self.mouse.brush = self.session.brushing is not None
        self.mouse.wipe = self.session.shown.wipe if self.session.shown.through else None

    def _reload_changed(self) -> None:
        now = time.monotonic()
        if self._watched != self.session.opened.path:
            self._watched = self.session.opened.path
            self._watch_groom = FileWatcher([self._watched])
        elif self._watch_groom.changed(now):
            self.perform("reload", {})
        if self._watch_shaders.changed(now):
            self._stir()
            try:
                with renderer() as gl:
                    self.preview.restart()
                    program = gl.program("viewer_screen", "viewer_blit")
                    self._blit = gl.context.vertex_array(program, [])
                    self.preview.draw()
            except RenderError as error:  # for example a half-edited shader: retry at the next save
                self.session.message = one_line(error)

    def listen(self) -> None:
        """Take mouse and keys."""
        glfw, window = self._glfw, self._window
        glfw.set_key_callback(window, self.on_key)
        glfw.set_mouse_button_callback(window, self.on_button)
        glfw.set_cursor_pos_callback(window, self.on_move)
        glfw.set_scroll_callback(window, self.on_scroll)
        glfw.set_drop_callback(window, self.on_drop)
        glfw.set_window_refresh_callback(window, self._stir)
        glfw.set_framebuffer_size_callback(window, self._stir)
        self._panel.listen()

    def on_key(self, window: Any, key: int, scancode: int, event: int, mods: int) -> None:
        """Handle a pressed, released or repeated key."""
        self._stir()
        self._panel.on_key(key, event, mods)
        name = key_name(self._glfw, key, mods)
        if name is not None and name not in self._keys:  # shift does nothing without a binding
            name = name.removeprefix("SHIFT_")
        if event == self._glfw.RELEASE or name not in self._keys or self._panel.wants_keys:
            return
        self.perform(*self._keys[name])

    def on_button(self, window: Any, button: int, event: int, mods: int) -> None:
        """Handle a pressed or released mouse button."""
        self._stir()
        self._panel.on_button(button, event)
        if event == self._glfw.RELEASE:
            self.mouse.release(time.monotonic())
        elif not self._panel.wants_mouse:
            self.mouse.press(button, mods)

    def on_move(self, window: Any, x: float, y: float) -> None:
        """Handle a mouse motion to (x, y), in screen units."""
        self._stir()
        width, height = self._glfw.get_window_size(self._window)
        self._panel.on_move(x, y)
        scale = self.session.size[0] / max(width, 1), self.session.size[1] / max(height, 1)
        self.mouse.move(x * scale[0], y * scale[1])

    def on_scroll(self, window: Any, right: float, up: float) -> None:
        """Handle a turn of the wheel."""
        self._stir()
        self._panel.on_scroll(right, up)
        if not self._panel.wants_mouse:
            self.mouse.scroll(up)

    def on_drop(self, window: Any, paths: list[str]) -> None:
        """Open the first of the dropped files."""
        if paths:
            self.session.message = f"opening {paths[0]}"
            self.picture(0.0)
            self.perform("open_file", {"file": str(paths[0])})


class _Warnings(logging.Handler):
    """Shows warnings in the picture."""

    def __init__(self, session: Session) -> None:
        super().__init__(logging.WARNING)
        self._session = session

    def emit(self, record: logging.LogRecord) -> None:
        """Show the warning until the next action."""
        self._session.message = one_line(record.getMessage())
