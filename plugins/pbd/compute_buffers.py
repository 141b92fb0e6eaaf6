"""Buffers of the compute backend: rods in blocks of lanes, by name, in one OpenGL context."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.errors import RenderError
from hairkit.render.context import Renderer, renderer
from hairkit.stored import Float32Array, Float64Array

LANES = 64
"""Rods of a block, which is a work group."""


class Buffers:
    """Named storage buffers; use them inside `renderer()`."""

    def __init__(self, gl: Renderer) -> None:
        self._gl = gl
        self._named: dict[str, Any] = {}
        self._largest = int(gl.context.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"])

    def __getitem__(self, name: str) -> Any:
        """Return the moderngl buffer of this name."""
        return self._named[name]

    def put(self, name: str, values: npt.NDArray[Any]) -> None:
        """Write values to a buffer, made anew where the size is another one."""
        old = self._named.get(name)
        if old is not None and old.size == values.nbytes:
            old.write(np.ascontiguousarray(values))
            return
        if values.nbytes > self._largest:
            raise RenderError(
                f"{name} of the rods take {values.nbytes} bytes, a buffer here holds at most"
                f" {self._largest}; simulate fewer guides or nodes, or use pbd.backend=fast"
            )
        if old is not None:
            old.release()
        self._named[name] = self._gl.context.buffer(np.ascontiguousarray(values))

    def bind(self, *names: str) -> None:
        """Bind buffers to 0, 1, 2 ... in this order."""
        for binding, name in enumerate(names):
            self._named[name].bind_to_storage_buffer(binding)

    def read(self, name: str, size: int = -1, offset: int = 0) -> Float32Array:
        """Return float32 words; from byte `offset` on, `size` bytes."""
        words = self._named[name].read(size, offset=offset)
        return np.frombuffer(words, np.float32)

    def release(self) -> None:
        """Free all buffers, if their context is still the process's."""
        with renderer() as gl:
            if gl is self._gl:
                for buffer in self._named.values():
                    buffer.release()
        self._named.clear()


def blocks(values: npt.ArrayLike) -> Float32Array:
    """Return values (S, ...) as blocks (B, ..., LANES); the last rod fills the last block."""
    some = np.asarray(values)
    count = -(-len(some) // LANES)
    rows = np.minimum(np.arange(count * LANES), len(some) - 1)
    spread = some[rows].astype(np.float32).reshape(count, LANES, *some.shape[1:])
    return np.ascontiguousarray(np.moveaxis(spread, 1, -1))


def rods_of(values: Float32Array, count: int) -> Float64Array:
    """Return `count` rods (S, ...) of blocks (B, ..., LANES)."""
    spread = np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:-1])
    return spread[:count].astype(np.float64)
