"""The compute backend: rods in GLSL compute shaders, float32, on a graphics card or Mesa's CPU.

One rod is one invocation with its work in local arrays. State stays in textures between steps: what
is read back is what is asked for, and what a step costs the processor does not grow with the number
of rods. Hair among hair is summed up in whole numbers, so that equal input gives equal motion.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.rendering.context import renderer
from hairkit.simulation import Grab, quaternion

from .gl_buffers import Store
from .gl_constants import constant_rows, offset_words, rider_words, share_words
from .gl_grab import Held
from .gl_obstacles import contact_uniforms, faces
from .gl_uniforms import MOST_STEPS, AirWaves, Units, air_uniforms, step_words, steps_at_once
from .hair_grid import Crowd
from .linear_system import System
from .reference import Contact, Load, State, at_rest
from .resampling import Riders
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
        self._riders: Riders | None = None
        self._before: npt.NDArray[np.integer[Any]] | None = None
        self._gusty = False
        with renderer() as gl:
            self._store = Store(gl, self._count, self._nodes)
            self._store.put_grid("u_distances", faces(contact))
            for name in ("u_wind", "u_force"):
                self._store.put_rods(name, np.zeros((self._count, 1, 3)))
        self._held = Held(self._store)
        self.state = at_rest(rods)
        weakref.finalize(self, self._store.release).atexit = False

    @property
    def state(self) -> State:
        """The present state, read back; setting it moves the rods and lets go of held ones."""
        with renderer():
            rows = self._store.rods("u_state")
        ends = 2 * self._nodes
        return State(rows[:, 0:ends:2, :3], rows[:, 1:ends:2, :3], _quaternions(rows[:, ends:]))

    @state.setter
    def state(self, value: State) -> None:
        ends = 2 * self._nodes
        rows = np.zeros((self._count, 3 * self._nodes - 1, 4), np.float32)
        rows[:, 0:ends:2, :3], rows[:, 1:ends:2, :3] = value.position, value.velocity
        rows[:, ends:] = np.roll(value.frames, -1, axis=-1)
        with renderer():
            self._store.put_rods("u_state", rows)
        self._held.let_go()

    def blow(self, waves: AirWaves | None, wind: Float64Array, head: Float64Array) -> None:
        """Find the gusty air at the nodes, of rods on a head at `head`, for the following runs.

        `waves` are those of `hairkit.simulation.wind.gust_waves`; None: loads tell of the air.
        """
        self._gusty = waves is not None
        if waves is None:
            return
        with renderer():
            self._store.make_rods("u_wind", self._nodes)
            self._store.written_by("u_wind")
            uniforms = air_uniforms(waves, wind, head)
            self._store.dispatch("pbd_wind", self._count, uniforms, WAVES=len(waves[0]))

    def hold(
        self, grabs: tuple[Grab, ...], riders: Riders, back: Float64Array, speed: float
    ) -> None:
        """Pull these points in the following runs, at most at `speed`, m/s.

        `back` (4, 4) brings the world to the head axes before the first substep of the next run.
        """
        with renderer():
            self._held.take(grabs, riders, back, speed)

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        with renderer():
            if self._system is not system:
                rows = constant_rows(self._rods, system, self._contact, self._unit)
                self._store.put_rods("u_constants", rows)
                self._system = system
            settings = self._settings(system, loads[0], iterations)
            most = steps_at_once(self._nodes, iterations)
            for start in range(0, len(loads), MOST_STEPS):
                some = loads[start : start + MOST_STEPS]
                self._store.put_words("steps", step_words(some, system.step))
                self._store["steps"].bind_to_uniform_block(0)
                if self._held:
                    self._run_held(some, settings)
                    continue
                for first in range(0, len(some), most):
                    self._step(first, min(most, len(some) - first), settings)

    def rub(self, crowd: Crowd, ride: Float64Array, rates: tuple[float, float, float]) -> None:
        """Let hair act on hair."""
        with renderer():
            if self._units is None or self._units.crowd is not crowd:
                self._units = self._put_crowd(crowd)
            uniforms = self._units.uniforms(ride, rates)
            self._store.read_by("filled")
            self._store.dispatch("pbd_hair_grid_splat", self._count * self._nodes, uniforms)
            self._store.written_by("u_means")
            self._store.dispatch("pbd_hair_grid_average", int(np.prod(crowd.shape)), uniforms)
            self._store.written_by("u_state")
            self._store.dispatch("pbd_hair_grid_apply", self._count * (self._nodes - 1), uniforms)

    def rod(self, rod: int) -> tuple[Float64Array, Float64Array]:
        """Return places and velocities (n, 3) of one rod, head axes."""
        ends, rows = 2 * self._nodes, 3 * self._nodes - 1
        with renderer():
            self._store.make_words("one", 4 * rows)
            self._store.read_by("one")
            self._store.dispatch("pbd_read_rod", rows, {"u_rod": rod})
            found = self._store.words("one").reshape(-1, 4)[:ends, :3].astype(np.float64)
        return found[0::2], found[1::2]

    def measured(self, gravity: Float64Array) -> tuple[float, float, float, float] | None:
        """Return the largest stretch, and kinetic, gravity's and elastic energy in joules.

        `gravity` (3,) m/s^2 is in head axes. None before the first run, when constants lack.
        """
        if self._system is None:
            return None
        with renderer():
            self._store.make_words("sums", 4 * int(np.prod(self._store.groups(self._count))))
            self._store.read_by("sums")
            self._store.dispatch("pbd_energies", self._count, {"u_gravity": tuple(gravity)})
            sums = self._store.words("sums").reshape(-1, 4).astype(np.float64)
        kinetic, weight, elastic = sums[:, 1:].sum(axis=0).tolist()
        return float(sums[:, 0].max()), kinetic, weight, elastic

    def points(self, riders: Riders, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        with renderer():
            self.points_buffer(riders, head)
            return self._store.words("points").reshape(-1, 3)

    def points_buffer(self, riders: Riders, head: Float64Array) -> Any:
        """Return the moderngl buffer of the guides' points: (P, 3) float32, world, metres.

        It is written by this call and stays the engine's; use it inside `renderer()`.
        """
        count = len(riders.rod)
        with renderer():
            uniforms = self._ridden(riders)
            if "points" not in self._store:
                self._store.make_words("points", 3 * count)
            self._store.read_by("riders", "offsets", "points")
            uniforms |= {"u_count": count, "u_head": [tuple(row) for row in head[:3]]}
            self._store.dispatch("pbd_points", count, uniforms)
            return self._store["points"]

    def rows_buffer(
        self,
        riders: Riders,
        before: npt.NDArray[np.integer[Any]],
        part: npt.NDArray[np.floating[Any]],
    ) -> Any:
        """Return the moderngl buffer (*before.shape, 3) of places between points, head axes.

        Each is `part` of the way from point `before` to the next one; both are looked at when
        `before` is another array than the last time. The buffer is as that of `points_buffer`.
        """
        with renderer():
            uniforms = self._ridden(riders)
            if self._before is not before:
                self._store.put_words("between", share_words(before, part))
                self._store.make_words("rows", 3 * before.size)
                self._before = before
            self._store.read_by("riders", "offsets", "rows", "between")
            self._store.dispatch(
                "pbd_guide_samples", before.size, uniforms | {"u_count": before.size}
            )
            return self._store["rows"]

    def _settings(self, system: System, load: Load, iterations: int) -> dict[str, Any]:
        """Return the uniforms of substeps; put what the load tells of every node."""
        everywhere, force = load.air.ndim == 1 and not self._gusty, load.force
        if load.air.ndim > 1:
            self._store.put_rods("u_wind", load.air)
        if force is not None:
            self._store.put_rods("u_force", force / self._unit[:, None, None])
        return {
            "u_iterations": iterations,
            "u_seconds": system.step,
            "u_damping": system.rates.damping,
            "u_air": tuple(load.air) if everywhere else _STILL,
            "u_gusts": not everywhere,
            "u_forced": force is not None or bool(self._held),
        } | contact_uniforms(self._contact)

    def _run_held(self, loads: Sequence[Load], settings: dict[str, Any]) -> None:
        """Find pulls, then step, load by load: a pull depends on where the node is."""
        for k, load in enumerate(loads):
            self._held.pull(k, load.ride, settings["u_seconds"])
            self._step(k, 1, settings)

    def _step(self, first: int, count: int, settings: dict[str, Any]) -> None:
        self._store.written_by("u_state")
        uniforms = settings | {"u_first": first, "u_substeps": count}
        self._store.dispatch("pbd_substeps", self._count, uniforms)

    def _put_crowd(self, crowd: Crowd) -> Units:
        units = Units.of(crowd)
        self._store.put_rods("u_masses", (self._rods.mass * units.mass)[..., None])
        self._store.put_grid("u_usual", (crowd.usual * units.mass).astype(np.float32))
        self._store.put_grid("u_means", np.zeros((*crowd.shape, 4), np.float32))
        self._store.make_words("filled", 4 * int(np.prod(crowd.shape)))
        return units

    def _ridden(self, riders: Riders) -> dict[str, Any]:
        """Put the riders where they are not yet; return the uniforms of their points."""
        deepest = None if self._contact is None else self._contact.deepest
        if self._riders is not riders:
            self._store.put_words("riders", rider_words(riders, deepest))
            self._store.put_words("offsets", offset_words(riders))
            self._riders = riders
        if deepest is None or riders.identity:
            return {"u_obstacles": False}
        return contact_uniforms(self._contact)


def _quaternions(frames: Float64Array) -> Float64Array:
    """(x, y, z, w) of the shaders as unit (w, x, y, z)."""
    return quaternion.normalize(np.roll(frames, 1, axis=-1))
