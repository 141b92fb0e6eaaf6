"""Where the compute backend keeps its numbers: textures of rods and of grids, and buffers."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.errors import RenderError
from hairkit.render.context import Renderer, renderer
from hairkit.stored import Float32Array, Float64Array

WIDTH = 4096
"""Rods side by side in a texture; more of them stand below."""


class Store:
    """Named textures and buffers of one OpenGL context; use it inside `renderer()`."""

    def __init__(self, gl: Renderer, count: int) -> None:
        self._gl, self._count = gl, count
        self.width = min(1 << (count - 1).bit_length(), WIDTH)
        """Rods side by side: powers of two, for which drivers compile once."""
        self._named: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        """Return the moderngl texture or buffer of this name."""
        return self._named[name]

    def put_rods(self, name: str, values: npt.ArrayLike) -> None:
        """Write values (S, R, up to 4) of rods to a texture (see `pbd_layout.glsl`)."""
        some = np.asarray(values)
        tall = -(-self._count // self.width)
        full = np.zeros((tall * self.width, some.shape[1], 4), np.float32)
        full[: self._count, :, : some.shape[2]] = some
        words = np.moveaxis(full.reshape(tall, self.width, -1, 4), 1, 2)
        self._texture(name, (self.width, tall * some.shape[1]), np.ascontiguousarray(words))

    def rods(self, name: str) -> Float64Array:
        """Return what `put_rods` wrote, or shaders since, (S, R, 4)."""
        words = np.frombuffer(self._named[name].read(), np.float32)
        tall = -(-self._count // self.width)
        rows = np.moveaxis(words.reshape(tall, -1, self.width, 4), 2, 1)
        return rows.reshape(tall * self.width, -1, 4)[: self._count].astype(np.float64)

    def put_grid(self, name: str, values: Float32Array) -> None:
        """Write a grid (X, Y, Z) or (X, Y, Z, 4) to a texture along z, y, x."""
        x, y, z = values.shape[:3]
        self._texture(name, (z, y, x), np.ascontiguousarray(values, np.float32))

    def put_words(self, name: str, values: npt.NDArray[Any]) -> None:
        """Write values to a buffer, made anew where the size is another one."""
        old = self._named.get(name)
        if old is None or old.size != values.nbytes:
            self._forget(name)
            self._named[name] = self._gl.context.buffer(np.ascontiguousarray(values))
        else:
            old.write(np.ascontiguousarray(values))

    def words(self, name: str) -> Float32Array:
        """Return the float32 words of a buffer."""
        return np.frombuffer(self._named[name].read(), np.float32)

    def release(self) -> None:
        """Free everything, if its context is still the process's."""
        with renderer() as gl:
            for name in list(self._named):
                if gl is self._gl:
                    self._forget(name)
        self._named.clear()

    def _texture(self, name: str, size: tuple[int, ...], words: Float32Array) -> None:
        old = self._named.get(name)
        if old is not None and old.size == size:
            old.write(words)
            return
        context = self._gl.context
        limit = "GL_MAX_TEXTURE_SIZE" if len(size) == 2 else "GL_MAX_3D_TEXTURE_SIZE"
        if max(size) > int(context.info[limit]):
            raise RenderError(
                f"{name} of the hair takes a texture of {size}, the renderer has at most"
                f" {context.info[limit]}; simulate fewer guides, or with pbd.backend=fast"
            )
        self._forget(name)
        parts = words.size // int(np.prod(size))
        make: Any = context.texture if len(size) == 2 else context.texture3d
        self._named[name] = make(size, parts, words, dtype="f4")

    def _forget(self, name: str) -> None:
        if name in self._named:
            self._named.pop(name).release()
