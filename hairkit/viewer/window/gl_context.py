"""A GLFW window with OpenGL 4.3 as a context for moderngl."""

from __future__ import annotations

from typing import Any

from hairkit.errors import RenderError
from hairkit.system import gl_cure
from hairkit.viewer.window.panel import load_windowing
from hairkit.viewer.window.splash import TITLE

_CURE = f"{gl_cure()}; without a screen run it under xvfb-run, or use --headless"


class WindowContext:
    """A GLFW window in the form in which moderngl accepts a context."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.glfw = load_windowing()
        failures: list[str] = []
        self.glfw.set_error_callback(lambda code, text: failures.append(_text(text)))
        if not self.glfw.init():
            raise RenderError(f"no window: {'; '.join(failures) or 'GLFW cannot start'}; {_CURE}")
        self.window = self._create(size)
        if not self.window:
            raise RenderError(f"no window with OpenGL 4.3: {'; '.join(failures)}; {_CURE}")
        self.glfw.make_context_current(self.window)
        self.glfw.swap_interval(0)
        self._depth = 0

    def _create(self, size: tuple[int, int]) -> Any:
        glfw = self.glfw
        for api in (glfw.NATIVE_CONTEXT_API, glfw.EGL_CONTEXT_API):
            glfw.default_window_hints()
            glfw.window_hint(glfw.CONTEXT_CREATION_API, api)
            glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 4)
            glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
            glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
            window = glfw.create_window(*size, TITLE, None, None)
            if window:
                return window
        return None

    @property
    def refresh_rate(self) -> int:
        """Pictures a second of the screen, 0 if unknown."""
        monitor = self.glfw.get_primary_monitor()
        mode = self.glfw.get_video_mode(monitor) if monitor else None
        return int(mode.refresh_rate) if mode else 0

    @property
    def settings(self) -> Any:
        """Keyword arguments for `moderngl.create_context`."""
        return {"context": self}

    def load(self, name: str) -> int:
        """Return the address of an OpenGL function, 0 if there is none."""
        return self.glfw.get_proc_address(name) or 0

    def release(self) -> None:
        """Do nothing: the window stays open until `close`."""

    def close(self) -> None:
        """Close the window."""
        self.glfw.terminate()

    def __enter__(self) -> WindowContext:
        self._depth += 1
        self.glfw.make_context_current(self.window)
        return self

    def __exit__(self, *exception: object) -> None:
        self._depth -= 1
        if not self._depth:  # an outer block still needs the context
            self.glfw.make_context_current(None)


def _text(text: bytes | str) -> str:
    return text.decode(errors="replace") if isinstance(text, bytes) else text
