"""The fast backend: compiled kernels on all cores, float32."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation import quaternion
from hairkit.simulation.obstacle_kernels import NO_FIELDS

from . import block
from .embedding import Embedding, drawn_points
from .hair_grid import HairGrid
from .kernels import run_substeps
from .linear_system import System
from .reference import Contact, Load, State, rest_state
from .rods import Rods
from .simd import LANES

WORTH = 64 // LANES
"""Blocks that are worth another thread's while."""


class FastEngine:
    """Rods in blocks of lanes while they move, one by one between runs."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self._rods, self._contact = rods, contact
        self._unit = rods.mass.mean(axis=1)[:, None, None]
        self._mass = rods.mass.astype(np.float32)
        self._system: System | None = None
        self.torso_from_head = np.eye(4)
        self.state = rest_state(rods)

    @property
    def state(self) -> State:
        """The present state as float64; setting it moves the rods."""
        place, speed, gain, frame, _ = (part.astype(np.float64) for part in self._state)
        return State(place, speed, quaternion.normalize(frame), gain)

    @state.setter
    def state(self, value: State) -> None:
        parts = (value.position, value.velocity, value.acceleration, value.frames)
        place, speed, gain, frame = (part.astype(np.float32) for part in parts)
        slack = np.zeros((*place.shape[:2], 2), np.float32)
        self._state = block.State(place, speed, gain, frame, slack)

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        contact = self._contact
        if self._system is not system:
            nodes, metric = block.constants(self._rods, system, contact)
            fields = block.pack_lanes(nodes).view(block.CONSTANT)[..., 0]
            self._system, self._packed = system, block.Packed(fields, block.pack_lanes(metric))
        settings = block.Settings(
            np.float32(system.step),
            np.float32(system.rates.damping),
            np.float32(0.0 if contact is None else contact.friction),
            np.float32(0.0 if contact is None else contact.fastest),
            iterations,
            -1 if contact is None else contact.rounds,
        )
        air, force = loads[0].air, loads[0].force
        pushed = np.zeros((1, 1, 3)) if force is None else force / self._unit
        parallel_for(
            run_substeps,
            len(self._packed.nodes),
            self._state,
            self._packed,
            block.steps_of(loads, system.step),
            (air if air.ndim > 1 else air[None, None]).astype(np.float32),
            pushed.astype(np.float32),
            NO_FIELDS if contact is None else contact.bodies.fields,
            settings,
            min_chunk=WORTH,
        )

    def apply_hair_grid(
        self, hair_grid: HairGrid, head_step: Float64Array, rates: tuple[float, float, float]
    ) -> None:
        """Apply hair-hair interaction."""
        hair_grid.mix(self._state.place, self._state.speed, self._mass, head_step, rates)

    def points(self, embedding: Embedding, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        state, torso = self._state, self.torso_from_head
        local = drawn_points(embedding, state.place, state.frame, self._contact, torso)
        motion = head.astype(np.float32)
        result: Float32Array = local @ motion[:3, :3].T + motion[:3, 3]
        return result
