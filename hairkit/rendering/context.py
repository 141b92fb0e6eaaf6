"""The OpenGL context of the process, offscreen: EGL, or OSMesa if EGL fails."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable, Iterator
from importlib import import_module, resources
from typing import Any, TypeVar

import moderngl
import numpy as np
import numpy.typing as npt

from hairkit.errors import RenderError, one_line
from hairkit.rendering.osmesa import OSMesaContext
from hairkit.system import gl_backends, gl_cure

REQUIRED_VERSION = 430
"""OpenGL 4.3, for compute shaders and storage buffers."""
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swr")
"""Words in the names of renderers that run on the CPU."""

Compiled = TypeVar("Compiled")

BACKENDS = gl_backends()
"""Tried in this order; `HAIRKIT_GL` picks one."""


class Renderer:
    """An offscreen context with its compiled programs; use it through `renderer()`."""

    def __init__(self, context: moderngl.Context, backend: str) -> None:
        self.context = context
        self.backend = backend
        """The one of `BACKENDS` that made the context."""
        self.home = context.simple_framebuffer((1, 1))
        """Bound between pictures, since moderngl rebinds the last one, even if released."""
        self.home.use()
        self._programs: dict[str, moderngl.Program] = {}
        self._computes: dict[str, moderngl.ComputeShader] = {}

    @property
    def description(self) -> str:
        """Backend, renderer and version in one line."""
        info = self.context.info
        return f"{self.backend}: {info['GL_RENDERER']}, OpenGL {info['GL_VERSION']}"

    @property
    def software(self) -> bool:
        """True if the renderer runs on the CPU."""
        name = str(self.context.info["GL_RENDERER"]).lower()
        return any(word in name for word in _SOFTWARE)

    def program(self, name: str, fragment: str | None = None) -> moderngl.Program:
        """Return the program of `name.vert` and `fragment.frag` (None: `name.frag`)."""
        key = f"{name}/{fragment or name}"
        if key not in self._programs:
            self._programs[key] = _compile(
                key,
                lambda: self.context.program(
                    vertex_shader=shader_source(f"{name}.vert"),
                    fragment_shader=shader_source(f"{fragment or name}.frag"),
                ),
            )
        return self._programs[key]

    def recompile_programs(self) -> None:
        """Recompile all shaders in use from their files.

        Raises `RenderError` if one does not compile; then all stay as they are. Old programs are
        not released, since they may still be in use.
        """
        programs, computes = self._programs, self._computes
        self._programs, self._computes = {}, {}
        try:
            for key in programs:
                self.program(*key.split("/"))
            for name in computes:
                self.compute(name)
        except BaseException:
            self._programs, self._computes = programs, computes
            raise

    def compute(self, name: str) -> moderngl.ComputeShader:
        """Return the compute shader `name.comp`."""
        if name not in self._computes:
            source = shader_source(f"{name}.comp")
            self._computes[name] = _compile(name, lambda: self.context.compute_shader(source))
        return self._computes[name]


@contextlib.contextmanager
def renderer() -> Iterator[Renderer]:
    """Make the process's renderer current in the calling thread for a block.

    Blocks of one thread can be nested. Raises `RenderError` if no context can be made, or if the
    block leaves an OpenGL error.
    """
    global _renderer, _depth
    with _lock:
        if _renderer is None or _owner != os.getpid():
            _renderer, _depth = _create(), 0
        _depth += 1
        try:
            # an inner block must not release the context of the outer one
            with _renderer.context if _depth == 1 else contextlib.nullcontext():
                yield _renderer
                error = _renderer.context.error
        finally:
            _depth -= 1
        if error != "GL_NO_ERROR":
            raise RenderError(f"drawing failed with OpenGL error {error} ({_renderer.backend})")


def install(context: moderngl.Context, backend: str) -> Renderer:
    """Make `context`, such as a window's, the renderer of this process.

    Raises `RenderError` if the process has another one already.
    """
    global _renderer, _owner
    with _lock:
        if _renderer is not None and _owner == os.getpid():
            raise RenderError(
                f"this process already has a context ({_renderer.backend}); start a new process"
            )
        _renderer, _owner = Renderer(context, backend), os.getpid()
        return _renderer


def shader_source(name: str) -> str:
    """Return the source of a shader with what some of its lines stand for.

    `#include "other.glsl"` stands for that source, `#constants hairkit.rendering.fibre TILT` for
    constants of a Python module, where their values have units and reasons.
    """
    text = resources.files("hairkit_shaders").joinpath(name).read_text(encoding="utf-8")
    return "\n".join(map(_expand, text.splitlines()))


def _expand(line: str) -> str:
    if line.startswith("#include"):
        return shader_source(line.split('"')[1])
    if not line.startswith("#constants"):
        return line
    _, module, *names = line.split()
    values = vars(import_module(module))
    return "\n".join(f"#define {name} {_literal(values[name])}" for name in names)


def _literal(value: npt.ArrayLike) -> str:
    """Return a number, a vector of three, or an array as GLSL writes it."""
    numbers = np.asarray(value)
    if numbers.ndim == 0:
        return repr(numbers.item())
    parts = ", ".join(map(repr, numbers.tolist()))
    return f"vec3({parts})" if len(numbers) == 3 else f"float[]({parts})"


def _compile(name: str, compile_: Callable[[], Compiled]) -> Compiled:
    try:
        return compile_()
    except moderngl.Error as error:
        raise RenderError(f"shader {name} does not compile: {error}") from error


_lock = threading.RLock()
_renderer: Renderer | None = None
_owner = 0
_depth = 0


def _create() -> Renderer:
    global _owner
    asked = os.environ.get("HAIRKIT_GL")
    if asked is not None and asked not in BACKENDS:
        raise RenderError(f"HAIRKIT_GL is {asked!r}, expected one of {', '.join(BACKENDS)}")
    failures = []
    for backend in BACKENDS if asked is None else (asked,):
        try:
            context = _open(backend)
        except Exception as error:  # drivers fail in many ways; try the next backend
            failures.append(f"{backend}: {one_line(error)}")
        else:
            _owner = os.getpid()
            return Renderer(context, backend)
    raise RenderError(f"no OpenGL 4.3 context ({'; '.join(failures)}); {gl_cure()}")


def _open(backend: str) -> moderngl.Context:
    # moderngl's stubs type its free keyword settings as one dict
    settings: Any = {"backend": backend} if backend == "egl" else {}
    if backend == "osmesa":
        settings["context"] = OSMesaContext()
    return moderngl.create_context(REQUIRED_VERSION, standalone=True, **settings)
