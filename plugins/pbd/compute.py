"""The compute backend: rods in GLSL compute shaders, float32, on a graphics card or Mesa's CPU.

One rod is one invocation with its work in local arrays. State stays in textures between steps: what
is read back is what is asked for. Hair among hair is summed up in whole numbers, so that equal
input gives equal motion.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np

from hairkit.render.context import renderer
from hairkit.render.projection import set_uniforms
from hairkit.simulate import rotation
from hairkit.stored import Float32Array, Float64Array

from .compute_load import MOST_STEPS, Units, faces, step_words, touching
from .compute_store import Store
from .crowd import Crowd
from .guides import Riders
from .packing import banded_factor
from .reference import Contact, Load, State, at_rest
from .rods import Rods
from .system import System

GROUP = 64
"""Invocations of a work group."""
_STILL = (0.0, 0.0, 0.0)


class ComputeEngine:
    """Rods in textures of the process's OpenGL context."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self._rods, self._contact = rods, contact
        self._count, self._nodes = rods.mass.shape
        self._unit = rods.mass.mean(axis=1)
        self._system: System | None = None
        self._units: Units | None = None
        self._riders: Riders | None = None
        with renderer() as gl:
            self._store = Store(gl, self._count)
            self._store.put_grid("u_distances", faces(contact))
            for name in ("u_wind", "u_force"):
                self._store.put_rods(name, np.zeros((self._count, 1, 3)))
        self.state = at_rest(rods)
        weakref.finalize(self, self._store.release).atexit = False

    @property
    def state(self) -> State:
        """The present state, read back; setting it moves the rods."""
        with renderer():
            rows = self._store.rods("u_state")
        ends = 2 * self._nodes
        return State(rows[:, 0:ends:2, :3], rows[:, 1:ends:2, :3], _quaternions(rows[:, ends:]))

    @state.setter
    def state(self, value: State) -> None:
        nodes = np.concatenate([value.position, value.velocity], axis=-1)
        rows = np.zeros((self._count, 3 * self._nodes - 1, 4))
        rows[:, : 2 * self._nodes, :3] = nodes.reshape(self._count, -1, 3)
        rows[:, 2 * self._nodes :] = np.roll(value.frames, -1, axis=-1)
        with renderer():
            self._store.put_rods("u_state", rows)

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        first = loads[0]
        gusts, force = first.air.ndim > 1, first.force
        with renderer():
            if self._system is not system:
                self._store.put_rods("u_constants", self._constants(system))
                self._system = system
            if gusts:
                self._store.put_rods("u_wind", first.air)
            if force is not None:
                self._store.put_rods("u_force", force / self._unit[:, None, None])
            settings = {
                "u_iterations": iterations,
                "u_seconds": system.step,
                "u_damping": system.rates.damping,
                "u_air": _STILL if gusts else tuple(first.air),
                "u_gusts": gusts,
                "u_forced": force is not None,
            }
            settings |= touching(self._contact)
            for start in range(0, len(loads), MOST_STEPS):
                some = loads[start : start + MOST_STEPS]
                self._store.put_words("steps", step_words(some, system.step))
                self._store["steps"].bind_to_uniform_block(0)
                self._write_to("u_state")
                settings["u_substeps"] = len(some)
                self._dispatch("pbd_substeps", self._count, settings)

    def rub(self, crowd: Crowd, ride: Float64Array, rates: tuple[float, float, float]) -> None:
        """Let hair act on hair."""
        with renderer():
            if self._units is None or self._units.crowd is not crowd:
                self._units = self._put_crowd(crowd)
            uniforms = self._units.uniforms(ride, rates)
            self._store["filled"].bind_to_storage_buffer(0)
            self._dispatch("pbd_crowd_fill", self._count, uniforms)
            self._write_to("u_means")
            self._dispatch("pbd_crowd_mean", int(np.prod(crowd.shape)), uniforms)
            self._write_to("u_state")
            self._dispatch("pbd_crowd_draw", self._count, uniforms)

    def rod(self, rod: int) -> tuple[Float64Array, Float64Array]:
        """Return places and velocities (n, 3) of one rod, head axes."""
        ends = 2 * self._nodes
        with renderer():
            self._store.put_words("one", np.zeros((3 * self._nodes - 1, 4), np.float32))
            self._store["one"].bind_to_storage_buffer(0)
            self._dispatch("pbd_rod", 3 * self._nodes - 1, {"u_rod": rod})
            rows = self._store.words("one").reshape(-1, 4)[:ends, :3].astype(np.float64)
        return rows[0::2], rows[1::2]

    def points(self, riders: Riders, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        with renderer():
            self.points_buffer(riders, head)
            return self._store.words("points").reshape(-1, 3).copy()

    def points_buffer(self, riders: Riders, head: Float64Array) -> Any:
        """Return the moderngl buffer of the guides' points: (P, 3) float32, world, metres.

        It is written by this call and stays the engine's; use it inside `renderer()`.
        """
        with renderer():
            if self._riders is not riders:
                self._put_riders(riders)
            for binding, name in enumerate(("rods", "offsets", "points")):
                self._store[name].bind_to_storage_buffer(binding)
            count = len(riders.rod)
            head_rows = [tuple(row) for row in head[:3]]
            self._dispatch("pbd_points", count, {"u_count": count, "u_head": head_rows})
            return self._store["points"]

    def _dispatch(self, shader: str, invocations: int, uniforms: dict[str, Any]) -> None:
        with renderer() as gl:
            program = gl.compute(shader, NODES=self._nodes)
            own = {"u_rods": self._count, "u_nodes": self._nodes, "u_width": self._store.width}
            set_uniforms(program, **own, **uniforms)
            textures = [name for name in _TEXTURES if name in program]
            for unit, name in enumerate(textures):
                program[name] = unit
                self._store[name].use(unit)
            program.run(-(-invocations // GROUP))
            gl.context.memory_barrier()

    def _write_to(self, name: str) -> None:
        self._store[name].bind_to_image(0, read=False, write=True)

    def _constants(self, system: System) -> Float64Array:
        """Rows of four numbers a rod, as the shader reads them; masses as shares of the mean."""
        rods, unit, count = self._rods, self._unit[:, None], self._count
        node = np.zeros((count, self._nodes, 8))
        node[..., :3], node[..., 3] = rods.points, rods.mass / unit
        node[..., 4], node[..., 5] = system.rates.drag, system.rates.shape
        node[..., 6] = -1.0 if self._contact is None else self._contact.clearance
        node[:, 1:, 7] = 1.0 / node[:, 1:, 3]
        element = np.zeros((count, self._nodes - 1, 12))
        element[..., :3] = banded_factor(system.banded / unit[..., None])
        element[..., 3], element[..., 7] = rods.length, 1.0 / rods.length
        element[..., 4], element[..., 5] = rods.bend / unit, rods.twist / unit
        element[..., 6], element[..., 8:11] = rods.natural_twist, rods.curvature
        row, column = np.tril_indices(self._nodes - 1)
        metric = np.zeros((count, -(-len(row) // 4) * 4))
        metric[:, : len(row)] = system.metric[:, row, column] * unit
        parts = (np.roll(rods.root_frame, -1, axis=-1), node, element, metric)
        return np.concatenate([part.reshape(count, -1, 4) for part in parts], axis=1)

    def _put_crowd(self, crowd: Crowd) -> Units:
        units = Units.of(crowd)
        self._store.put_rods("u_masses", (self._rods.mass * units.mass)[..., None])
        self._store.put_grid("u_usual", (crowd.usual * units.mass).astype(np.float32))
        self._store.put_grid("u_means", np.zeros((*crowd.shape, 4), np.float32))
        self._store.put_words("filled", np.zeros((*crowd.shape, 4), np.int32))
        return units

    def _put_riders(self, riders: Riders) -> None:
        rod, segment, share, offset = riders.packed()
        self._store.put_words("rods", np.stack([rod, segment], axis=1).astype(np.int32))
        self._store.put_words("offsets", np.concatenate([offset, share[:, None]], axis=1))
        self._store.put_words("points", np.zeros((len(rod), 3), np.float32))
        self._riders = riders


_TEXTURES = (
    "u_state", "u_constants", "u_wind", "u_force", "u_distances", "u_masses", "u_usual", "u_means",
)  # fmt: skip


def _quaternions(frames: Float64Array) -> Float64Array:
    """(x, y, z, w) of the shaders as unit (w, x, y, z)."""
    return rotation.unit(np.roll(frames, 1, axis=-1))
