"""The compute backend: rods in GLSL compute shaders, float32, on a graphics card or Mesa's CPU.

One rod is one invocation with its work in local arrays; the arrays lie as the fast backend's do.
State stays in buffers between steps: what is read back is what is asked for. Hair among hair is
summed up in whole numbers, so that equal input gives equal motion.
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

from .compute_buffers import LANES, Buffers, blocks, rods_of
from .compute_load import Units, step_words, touching
from .crowd import Crowd
from .fast import _constants
from .guides import Riders
from .reference import Contact, Load, State, at_rest
from .rods import Rods
from .system import System

_STATE = 7
"""Rows of a node: place (3), velocity (3), how far it may go before obstacles are looked up."""
_NO_AIR = (0.0, 0.0, 0.0)


class ComputeEngine:
    """Rods in buffers of the process's OpenGL context."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self._rods, self._contact = rods, contact
        self._count, self._nodes = rods.mass.shape
        self._groups = -(-self._count // LANES)
        self._unit = rods.mass.mean(axis=1)
        self._system: System | None = None
        self._units: Units | None = None
        self._riders: Riders | None = None
        with renderer() as gl:
            self._buffers = Buffers(gl)
            distance = np.zeros(1) if contact is None else contact.obstacles.distance
            self._buffers.put("distances", distance.astype(np.float32))
            for name in ("air", "forces"):
                self._buffers.put(name, np.zeros(1, np.float32))
        self.state = at_rest(rods)
        weakref.finalize(self, self._buffers.release).atexit = False

    @property
    def state(self) -> State:
        """The present state, read back; setting it moves the rods."""
        with renderer():
            nodes = self._buffers.read("nodes").reshape(-1, self._nodes, _STATE, LANES)
            frames = self._buffers.read("frames").reshape(-1, self._nodes - 1, 4, LANES)
        rods = rods_of(nodes, self._count)
        return State(rods[..., :3], rods[..., 3:6], rotation.unit(rods_of(frames, self._count)))

    @state.setter
    def state(self, value: State) -> None:
        slack = np.zeros_like(value.position[..., :1])
        nodes = np.concatenate([value.position, value.velocity, slack], axis=-1)
        with renderer():
            self._buffers.put("nodes", blocks(nodes))
            self._buffers.put("frames", blocks(value.frames))

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        first = loads[0]
        gusts, forced = first.air.ndim > 1, first.force is not None
        with renderer():
            if self._system is not system:
                self._put_constants(system)
            self._buffers.put("steps", step_words(loads, system.step))
            if gusts:
                self._buffers.put("air", blocks(first.air))
            if first.force is not None:
                self._buffers.put("forces", blocks(first.force / self._unit[:, None, None]))
            self._buffers.bind(
                "nodes", "frames", "constants", "steps", "distances", "air", "forces"
            )
            settings = {
                "u_substeps": len(loads),
                "u_iterations": iterations,
                "u_seconds": system.step,
                "u_damping": system.rates.damping,
                "u_air": _NO_AIR if gusts else tuple(first.air),
                "u_gusts": gusts,
                "u_forced": forced,
            }
            self._dispatch("pbd_substeps", self._groups, settings | touching(self._contact))

    def rub(self, crowd: Crowd, ride: Float64Array, rates: tuple[float, float, float]) -> None:
        """Let hair act on hair."""
        with renderer():
            if self._units is None or self._units.crowd is not crowd:
                self._units = self._put_crowd(crowd)
            self._buffers.bind("nodes", "frames", "masses", "filled", "cells", "usual")
            uniforms = self._units.uniforms(ride, rates)
            cells = int(np.prod(crowd.shape))
            self._dispatch("pbd_crowd_fill", self._groups, uniforms)
            self._dispatch("pbd_crowd_mean", -(-cells // LANES), uniforms)
            self._dispatch("pbd_crowd_draw", self._groups, uniforms)

    def rod(self, rod: int) -> tuple[Float64Array, Float64Array]:
        """Return places and velocities (n, 3) of one rod, head axes."""
        block, lane = divmod(rod, LANES)
        size = self._nodes * _STATE * LANES * 4
        with renderer():
            words = self._buffers.read("nodes", size, block * size)
        nodes = words.reshape(self._nodes, _STATE, LANES)[..., lane].astype(np.float64)
        return nodes[:, :3], nodes[:, 3:6]

    def points(self, riders: Riders, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        with renderer():
            self.points_buffer(riders, head)
            return self._buffers.read("points").reshape(-1, 3)

    def points_buffer(self, riders: Riders, head: Float64Array) -> Any:
        """Return the moderngl buffer of the guides' points: (P, 3) float32, world, metres.

        It is written by this call and stays the engine's; use it inside `renderer()`.
        """
        with renderer():
            if self._riders is not riders:
                self._put_riders(riders)
            self._buffers.bind("nodes", "frames", "rods", "offsets", "points")
            count = len(riders.rod)
            settings = {"u_count": count, "u_head": [tuple(row) for row in head[:3]]}
            self._dispatch("pbd_points", -(-count // LANES), settings)
            return self._buffers["points"]

    def _dispatch(self, shader: str, groups: int, uniforms: dict[str, Any]) -> None:
        with renderer() as gl:
            program = gl.compute(shader, NODES=self._nodes)
            set_uniforms(program, **uniforms)
            program.run(groups)
            gl.context.memory_barrier()

    def _put_constants(self, system: System) -> None:
        """One row of words after the other: the root, nodes, elements, the lengths' metric."""
        _, *parts = self._root(), *_constants(self._rods, system, self._contact, self._unit)
        root = blocks(self._root())
        flat = [part.reshape(self._groups, -1, LANES) for part in (root, *parts)]
        self._buffers.put("constants", np.concatenate(flat, axis=1))
        self._system = system

    def _root(self) -> Float64Array:
        held = rotation.third_axis(self._rods.root_frame)
        return np.concatenate([self._rods.root_frame, held], axis=1)

    def _put_crowd(self, crowd: Crowd) -> Units:
        units = Units.of(crowd)
        mass = blocks(self._rods.mass * units.mass)
        mass[-1, :, self._count - (self._groups - 1) * LANES :] = 0.0  # lanes beyond the last rod
        cells = int(np.prod(crowd.shape))
        self._buffers.put("masses", mass)
        self._buffers.put("filled", np.zeros((cells, 4), np.int32))
        self._buffers.put("cells", np.zeros((cells, 4), np.float32))
        self._buffers.put("usual", (crowd.usual * units.mass).astype(np.float32))
        return units

    def _put_riders(self, riders: Riders) -> None:
        rod, segment, share, offset = riders.packed()
        self._buffers.put("rods", np.stack([rod, segment], axis=1).astype(np.int32))
        self._buffers.put("offsets", np.concatenate([offset, share[:, None]], axis=1))
        self._buffers.put("points", np.zeros((len(rod), 3), np.float32))
        self._riders = riders
