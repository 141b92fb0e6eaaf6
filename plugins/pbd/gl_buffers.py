"""Textures and buffers of the compute backend, and the dispatch of its shaders."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import RenderError
from hairkit.rendering.context import Renderer, renderer
from hairkit.rendering.gl_camera import set_uniforms

WIDTH = 4096
"""Rods in a row of a texture; further rods go into further rows."""
GROUP = 64
"""Invocations of a work group."""
MOST_GROUPS = 65535
"""Work groups along an axis that every OpenGL 4.3 supports."""


class Store:
    """Named textures and buffers of one OpenGL context; use it inside `renderer()`."""

    def __init__(self, gl: Renderer, count: int, nodes: int) -> None:
        self._gl, self._count, self._nodes = gl, count, nodes
        self.width = min(1 << (count - 1).bit_length(), WIDTH)
        """Rods in a row of a texture, a power of two, so that drivers compile few variants."""
        self._named: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        """Return the moderngl texture or buffer of this name."""
        return self._named[name]

    def groups(self, invocations: int) -> tuple[int, int]:
        """Return the number of work groups along x and y."""
        count = -(-invocations // GROUP)
        deep = -(-count // MOST_GROUPS)
        return -(-count // deep), deep

    def dispatch(
        self, shader: str, invocations: int, uniforms: dict[str, Any], **definitions: int
    ) -> None:
        """Run a shader; its samplers are bound to the textures of the same names."""
        program = self._gl.compute(shader, NODES=self._nodes, **definitions)
        own = {"u_rods": self._count, "u_nodes": self._nodes, "u_width": self.width}
        set_uniforms(program, **own, **uniforms)
        samplers = [name for name in _SAMPLERS if name in program]
        for unit, name in enumerate(samplers):
            program[name] = unit
            self._named[name].use(unit)
        program.run(*self.groups(invocations))
        self._gl.context.memory_barrier()

    def read_by(self, *names: str) -> None:
        """Bind buffers to the next shader, in this order."""
        for binding, name in enumerate(names):
            self._named[name].bind_to_storage_buffer(binding)

    def written_by(self, name: str) -> None:
        """Bind the texture that the next shader writes."""
        self._named[name].bind_to_image(0, read=False, write=True)

    def put_rods(self, name: str, values: npt.ArrayLike) -> None:
        """Write values (S, R, up to 4) of rods to a texture (see `pbd_layout.glsl`)."""
        some = np.asarray(values)
        tall, rows = -(-self._count // self.width), some.shape[1]
        words = np.zeros((tall, rows, self.width, 4), np.float32)
        for below in range(tall):
            part = some[below * self.width : (below + 1) * self.width]
            words[below, :, : len(part), : some.shape[2]] = part.swapaxes(0, 1)
        self._texture(name, self._size(rows), 4, words)

    def rods(self, name: str) -> Float64Array:
        """Read back values (S, R, 4) that `put_rods` or a shader wrote."""
        words = np.frombuffer(self._named[name].read(), np.float32)
        tall = -(-self._count // self.width)
        rows = np.moveaxis(words.reshape(tall, -1, self.width, 4), 2, 1)
        return rows.reshape(tall * self.width, -1, 4)[: self._count].astype(np.float64)

    def put_grid(self, name: str, values: Float32Array) -> None:
        """Write a grid (X, Y, Z) or (X, Y, Z, 4) to a texture along z, y, x."""
        x, y, z = values.shape[:3]
        parts = values.size // (x * y * z)
        self._texture(name, (z, y, x), parts, np.ascontiguousarray(values, np.float32))

    def make_words(self, name: str, count: int) -> None:
        """Make a buffer of `count` zeroed words of four bytes for a shader to write."""
        old = self._named.get(name)
        if old is None or old.size != 4 * count:
            self._buffer(name, 4 * count)
        self._named[name].clear()

    def put_words(self, name: str, values: npt.NDArray[Any]) -> None:
        """Write values to a buffer, which is reallocated if its size differs."""
        old = self._named.get(name)
        if old is None or old.size != values.nbytes:
            self._buffer(name, values.nbytes)
        else:
            old.orphan()  # a shader may still read the old storage
        self._named[name].write(np.ascontiguousarray(values))

    def words(self, name: str) -> Float32Array:
        """Read back the float32 words of a buffer."""
        found = np.empty(self._named[name].size // 4, np.float32)
        self._named[name].read_into(found)
        return found

    def release(self) -> None:
        """Free all GPU objects, if their context is still that of the process."""
        with renderer() as gl:
            for name in list(self._named):
                if gl is self._gl:
                    self._forget(name)
        self._named.clear()

    def _size(self, rows: int) -> tuple[int, int]:
        return self.width, -(-self._count // self.width) * rows

    def _texture(self, name: str, size: tuple[int, ...], parts: int, words: Float32Array) -> None:
        old = self._named.get(name)
        if old is not None and old.size == size:
            old.write(words)
            return
        limit = "GL_MAX_TEXTURE_SIZE" if len(size) == 2 else "GL_MAX_3D_TEXTURE_SIZE"
        self._must_fit(name, "a texture's side", max(size), limit)
        self._forget(name)
        context: Any = self._gl.context
        make = context.texture if len(size) == 2 else context.texture3d
        self._named[name] = make(size, parts, words, dtype="f4")

    def _buffer(self, name: str, size: int) -> None:
        self._must_fit(name, "a buffer's bytes", size, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE")
        self._forget(name)
        self._named[name] = self._gl.context.buffer(reserve=size)

    def _must_fit(self, name: str, what: str, size: int, limit: str) -> None:
        most = int(self._gl.context.info[limit])
        if size > most:
            raise RenderError(
                f"{what} for {name} would be {size}, expected at most {most} on this renderer;"
                " simulate fewer guides, or with pbd.backend=fast"
            )

    def _forget(self, name: str) -> None:
        if name in self._named:
            self._named.pop(name).release()


_SAMPLERS = (
    "u_state", "u_constants", "u_wind", "u_force", "u_masses",
    "u_uncrowded_mass", "u_means", "u_head_distances", "u_torso_distances",
)  # fmt: skip
