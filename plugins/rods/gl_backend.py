"""The compute backend: substeps in GLSL compute shaders, float32, on a graphics card or Mesa's CPU.

Each invocation simulates one rod in local arrays. Constants stay in a texture; the state goes there
and back in every run, so that neighbours and drawn points are the same code as elsewhere.
"""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import RenderError
from hairkit.rendering.context import Renderer, is_current, on_graphics_card, renderer
from hairkit.rendering.gl_camera import set_uniforms
from hairkit.simulation.substeps import StepArrays

from .backend import Engine
from .block import Contact, constants, settings_of
from .linear_system import System
from .rods import Rods

WIDTH = 4096
"""Rods in a row of a texture; further rods go into further rows."""
GROUP, MOST_GROUPS = 64, 65535
"""Invocations of a work group; work groups along an axis that every OpenGL 4.3 supports."""
MOST_STEPS, STEP = 64, 256
"""Most substeps in one dispatch of the shader; bytes of one, see `rods_substep_schedule.glsl`."""
UNROLLED = 16
"""Nodes up to which compilers unroll the shader's loops, see `rods_layout.glsl`."""
LOOPS = 20
"""Loops over the nodes in a substep of the shader, at most."""
MOST_TURNS = 64_000
"""Most loop iterations in one dispatch: Mesa's llvmpipe leaves all loops after 65536 in all."""


class ComputeEngine(Engine):
    """Rods in textures of the process's OpenGL context."""

    def __init__(self, rods: Rods, contact: Contact) -> None:
        super().__init__(rods, contact)
        self._system: System | None = None
        self._textures: dict[str, Any] = {}
        count, fields = len(rods.mass), contact.bodies.fields
        # a power of two, so that drivers compile few variants
        self._width = min(1 << (count - 1).bit_length(), WIDTH)
        self._grids: dict[str, Any] = {
            "u_cells": [field.distance.shape for field in fields],
            "u_grid": [(*field.first, 1 / field.spacing) for field in fields],
        }
        with renderer() as gl:
            self._texture("u_head_distances", faces(fields.head.distance))
            self._texture("u_torso_distances", faces(fields.torso.distance))
            self._put("u_state", self.rows)
            self._words = gl.context.buffer(reserve=MOST_STEPS * STEP)
        weakref.finalize(self, _release, gl, self._textures, self._words).atexit = False

    def _keep(self, rows: Float64Array) -> None:
        super()._keep(rows.astype(np.float32))

    def run(self, system: System, steps: StepArrays, outer: Float64Array) -> None:
        """Do the substeps; `outer` is `block.acting`."""
        count, nodes = self.rods.mass.shape
        words = np.concatenate([part.reshape(len(part), -1) for part in steps], axis=1)
        settings = settings_of(system, self.contact, np.float32)._asdict()
        with renderer() as gl:
            if self._system is not system:
                self._put("u_constants", *constants(self.rods, system, self.contact))
                self._system = system
            self._put("u_state", self.rows)
            self._put("u_acting", np.pad(outer, ((0, 0), (0, 0), (0, 2))))
            program = gl.compute("rods_substeps", NODES=nodes)
            set_uniforms(program, **{f"u_{name}": settings[name] for name in settings})
            set_uniforms(program, u_rods=count, u_nodes=nodes, u_width=self._width, **self._grids)
            set_uniforms(program, u_even=outer.shape[1] == 1)
            for unit, name in enumerate(n for n in self._textures if n in program):
                program[name] = unit
                self._textures[name].use(unit)
            self._textures["u_state"].bind_to_image(0, read=False, write=True)
            most = steps_at_once(nodes)
            for first in range(0, len(words), most):
                some = words[first : first + most].astype(np.float32)
                self._words.orphan()
                self._words.write(some)
                self._words.bind_to_uniform_block(0)
                set_uniforms(program, u_substeps=len(some))
                groups = -(-count // GROUP)
                deep = -(-groups // MOST_GROUPS)
                program.run(-(-groups // deep), deep)
                gl.context.memory_barrier()
            words = np.frombuffer(self._textures["u_state"].read(), np.float32)
            rods = words.reshape(-1, 4 * nodes, self._width, 4).swapaxes(1, 2)
            self.rows = rods.reshape(-1, *self.rows.shape[1:])[:count].copy()

    def _put(self, name: str, *parts: npt.NDArray[Any]) -> None:
        """Write values (S, ...) of rods to a texture (see `rods_layout.glsl`)."""
        rows = np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1)
        high = -(-rows.shape[1] // 4)
        tall = -(-len(rows) // self._width)
        words = np.zeros((tall * self._width, high * 4), np.float32)
        words[: len(rows), : rows.shape[1]] = rows
        self._texture(name, words.reshape(tall, self._width, high, 4).swapaxes(1, 2), flat=True)

    def _texture(self, name: str, values: Float32Array, flat: bool = False) -> None:
        """Write (Z, Y, X, 4) to a texture, with the first two axes in one where `flat`."""
        deep, high, wide = values.shape[:3]
        size = (wide, deep * high) if flat else (wide, high, deep)
        words, old = np.ascontiguousarray(values), self._textures.get(name)
        if old is not None and old.size == size:
            old.write(words)
            return
        with renderer() as gl:
            context: Any = gl.context
            most = int(context.info["GL_MAX_TEXTURE_SIZE" if flat else "GL_MAX_3D_TEXTURE_SIZE"])
            if max(size) > most:
                raise RenderError(
                    f"a texture's side for {name} would be {max(size)}, expected at most {most} on"
                    " this renderer; simulate fewer guides, or with rods.backend=fast"
                )
            make = context.texture if flat else context.texture3d
            self._textures[name] = make(size, 4, words, dtype="f4")


def steps_at_once(nodes: int) -> int:
    """Return how many substeps the shader may do in one dispatch."""
    if nodes <= UNROLLED or on_graphics_card():
        return MOST_STEPS
    segments = nodes - 1
    # the factor of the lengths takes four entries in a turn, a row for each segment before
    turns = segments**3 // 6 // 4 + segments**2 + 5 * segments + LOOPS * nodes
    return min(max(MOST_TURNS // turns, 1), MOST_STEPS)


def faces(distance: Float32Array) -> Float32Array:
    """Return (X, Y, Z, 4) distances of the corners (y, z), (y, z + 1), (y + 1, z), both + 1."""
    if not distance.size:
        return np.zeros((1, 1, 1, 4), np.float32)
    full = np.pad(distance, ((0, 0), (0, 1), (0, 1)), mode="edge")
    parts = [full[:, :-1, :-1], full[:, :-1, 1:], full[:, 1:, :-1], full[:, 1:, 1:]]
    return np.stack(parts, axis=-1)


def _release(owner: Renderer, textures: dict[str, Any], words: Any) -> None:
    """Free the textures, if their context is still that of the process."""
    if is_current(owner):
        with renderer():
            for one in (*textures.values(), words):
                one.release()
