"""The compute backend: rods in GLSL compute shaders, float32, on a graphics card or Mesa's CPU.

Each invocation simulates one rod in local arrays. The state stays in textures between steps; only
requested values are read back, so that the CPU time of a step does not depend on the number of
rods. The hair grid sums integers, so that equal input gives equal motion.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.rendering.context import renderer
from hairkit.simulation import quaternion

from .block import STEP, steps_of
from .embedding import Embedding
from .gl_buffers import Store
from .gl_uniforms import (
    MOST_STEPS,
    Units,
    between_words,
    constant_rows,
    contact_uniforms,
    faces,
    point_words,
    steps_at_once,
)
from .hair_grid import HairGrid
from .linear_system import System
from .reference import Contact, Load, State, obstacles_of, rest_state
from .rods import Rods

_STILL = (0.0, 0.0, 0.0)


class ComputeEngine:
    """Rods in textures of the process's OpenGL context."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self._rods, self._contact = rods, contact
        self._count, self._nodes = rods.mass.shape
        self._unit = rods.mass.mean(axis=1)
        self._system: System | None = None
        self._units: Units | None = None
        self._embedding: Embedding | None = None
        self._before: npt.NDArray[np.integer[Any]] | None = None
        with renderer() as gl:
            self._store = Store(gl, self._count, self._nodes)
            for name, body in zip(("head", "torso"), obstacles_of(contact), strict=True):
                self._store.put_grid(f"u_{name}_distances", faces(body))
            for name in ("u_wind", "u_force"):
                self._store.put_rods(name, np.zeros((self._count, 1, 3)))
        self.state = rest_state(rods)
        self.torso_from_head = np.eye(4)
        weakref.finalize(self, self._store.release).atexit = False

    @property
    def state(self) -> State:
        """The present state, read back; setting it moves the rods."""
        with renderer():
            rows = self._store.rods("u_state")
        ends, gain = 2 * self._nodes, 3 * self._nodes - 1
        frames = _quaternions(rows[:, ends:gain])
        return State(rows[:, 0:ends:2, :3], rows[:, 1:ends:2, :3], frames, rows[:, gain:, :3])

    @state.setter
    def state(self, value: State) -> None:
        ends, gain = 2 * self._nodes, 3 * self._nodes - 1
        rows = np.zeros((self._count, gain + self._nodes, 4), np.float32)
        rows[:, 0:ends:2, :3], rows[:, 1:ends:2, :3] = value.position, value.velocity
        rows[:, ends:gain] = np.roll(value.frames, -1, axis=-1)
        rows[:, gain:, :3] = value.acceleration
        with renderer():
            self._store.put_rods("u_state", rows)

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        with renderer():
            if self._system is not system:
                rows = constant_rows(self._rods, system, self._contact)
                self._store.put_rods("u_constants", rows)
                self._system = system
            settings = self._settings(system, loads[0], iterations)
            most = steps_at_once(self._nodes, iterations)
            for start in range(0, len(loads), MOST_STEPS):
                some, words = loads[start : start + MOST_STEPS], np.zeros(MOST_STEPS, STEP)
                words[: len(some)] = steps_of(some, system.step)
                self._store.put_words("steps", words)
                self._store["steps"].bind_to_uniform_block(0)
                for first in range(0, len(some), most):
                    self._step(first, min(most, len(some) - first), settings)

    def apply_hair_grid(
        self, hair_grid: HairGrid, head_step: Float64Array, rates: tuple[float, float, float]
    ) -> None:
        """Apply hair-hair interaction."""
        with renderer():
            if self._units is None or self._units.hair_grid is not hair_grid:
                self._units = self._upload_hair_grid(hair_grid)
            uniforms = self._units.uniforms(head_step, rates)
            self._store.read_by("filled")
            self._store.dispatch("pbd_hair_grid_splat", self._count * self._nodes, uniforms)
            self._store.written_by("u_means")
            self._store.dispatch("pbd_hair_grid_average", hair_grid.density.size, uniforms)
            self._store.written_by("u_state")
            self._store.dispatch("pbd_hair_grid_apply", self._count * (self._nodes - 1), uniforms)

    def points(self, embedding: Embedding, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        with renderer():
            self.points_buffer(embedding, head)
            return self._store.words("points").reshape(-1, 3)

    def points_buffer(self, embedding: Embedding, head: Float64Array) -> Any:
        """Return the moderngl buffer of the guides' points: (P, 3) float32, world, metres.

        This call writes it and the engine owns it; use it inside `renderer()`.
        """
        with renderer():
            uniforms = self._upload_embedding(embedding)
            self._store.read_by("guides", "starts", "local", "points")
            uniforms["u_head"] = [tuple(row) for row in head[:3]]
            uniforms["u_torso_from_head"] = [tuple(row) for row in self.torso_from_head[:3]]
            self._store.dispatch("pbd_points", self._count, uniforms)
            return self._store["points"]

    def rows_buffer(
        self,
        embedding: Embedding,
        before: npt.NDArray[np.integer[Any]],
        part: npt.NDArray[np.floating[Any]],
    ) -> Any:
        """Return the moderngl buffer (*before.shape, 3) of samples between points, head axes.

        Each is at fraction `part` between point `before` and the next one; both arrays are uploaded
        when `before` is another object than in the last call. Otherwise as `points_buffer`.
        """
        with renderer():
            self.points_buffer(embedding, np.eye(4))
            if self._before is not before:
                self._store.put_words("between", between_words(before, part))
                self._store.make_words("rows", 3 * before.size)
                self._before = before
            self._store.read_by("local", "rows", "between")
            self._store.dispatch("pbd_guide_samples", before.size, {"u_count": before.size})
            return self._store["rows"]

    def _settings(self, system: System, load: Load, iterations: int) -> dict[str, Any]:
        """Return the uniforms of substeps; upload the per-node values of the load."""
        everywhere, force = load.air.ndim == 1, load.force
        if not everywhere:
            self._store.put_rods("u_wind", load.air)
        if force is not None:
            self._store.put_rods("u_force", force / self._unit[:, None, None])
        return {
            "u_iterations": iterations,
            "u_seconds": system.step,
            "u_damping": system.rates.damping,
            "u_air": tuple(load.air) if everywhere else _STILL,
            "u_gusts": not everywhere,
            "u_forced": force is not None,
        } | contact_uniforms(self._contact)

    def _step(self, first: int, count: int, settings: dict[str, Any]) -> None:
        self._store.written_by("u_state")
        uniforms = settings | {"u_first": first, "u_substeps": count}
        self._store.dispatch("pbd_substeps", self._count, uniforms)

    def _upload_hair_grid(self, hair_grid: HairGrid) -> Units:
        units = Units.of(hair_grid)
        self._store.put_rods("u_masses", (self._rods.mass * units.mass)[..., None])
        self._store.put_grid(
            "u_uncrowded_mass", (hair_grid.uncrowded_mass * units.mass).astype(np.float32)
        )
        self._store.put_grid("u_means", np.zeros((*hair_grid.density.shape, 4), np.float32))
        self._store.make_words("filled", 4 * hair_grid.density.size)
        return units

    def _upload_embedding(self, embedding: Embedding) -> dict[str, Any]:
        """Upload the embedding unless it is there; return the uniforms of its points."""
        deepest = None if self._contact is None else self._contact.deepest
        if self._embedding is not embedding:
            self._store.put_words("guides", point_words(embedding, deepest))
            self._store.put_words("starts", embedding.starts.astype(np.int32))
            for name in ("local", "points"):
                self._store.make_words(name, 3 * len(embedding.rod))
            self._embedding = embedding
        if deepest is None:
            return {"u_obstacles": False}
        return contact_uniforms(self._contact)


def _quaternions(frames: Float64Array) -> Float64Array:
    """Convert (x, y, z, w) of the shaders to unit (w, x, y, z)."""
    return quaternion.normalize(np.roll(frames, 1, axis=-1))
