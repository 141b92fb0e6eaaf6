"""The reference backend, what all backends share, and the fast one: compiled, on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation.obstacle_kernels import NO_FIELDS

from . import block
from .embedding import Embedding, drawn_points
from .hair_grid import HairGrid
from .kernels import run_substeps
from .linear_system import System
from .reference import Contact, Load, State, rest_state, substep, transform_points
from .rods import Rods


class Engine:
    """The reference backend, NumPy float64; others override how the state is kept and advanced."""

    rows: Any
    """(B, L, n, 16 or more) `block.STATE` of B times L rods, of which the last ones may be void."""
    mass: Any
    """(B, L, n) kilograms; 0 of void rods."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self.rods, self.contact = rods, contact
        self.torso_from_head = np.eye(4)
        """(4, 4) from the head axes to the torso's, for the points."""
        self.mass = rods.mass[:, None]
        self.state = rest_state(rods)

    @property
    def state(self) -> State:
        """The present state; setting it moves the rods."""
        return block.state_of(self.rows.reshape(-1, *self.rows.shape[2:])[: len(self.rods.mass)])

    @state.setter
    def state(self, value: State) -> None:
        self._keep(block.state_rows(self.rods, value))

    def _keep(self, rows: Float64Array) -> None:
        """Take the state (S, n, 16)."""
        self.rows = rows[:, None]

    def run(self, system: System, loads: Sequence[Load]) -> None:
        """Do one substep for each load."""
        for load in loads:
            self.state = substep(self.rods, system, self.state, load, self.contact)

    def apply_hair_grid(
        self, hair_grid: HairGrid, head_step: Float64Array, rates: tuple[float, float, float]
    ) -> None:
        """Apply hair-hair interaction; `rates` are cohesion, pressure, seconds."""
        hair_grid.mix(self.rows[..., :3], self.rows[..., 4:7], self.mass, head_step, rates)

    def points(self, embedding: Embedding, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        place, frames = self.rows[..., :3], self.rows[..., 1:, 12:16]
        local = drawn_points(embedding, place, frames, self.contact, self.torso_from_head)
        return transform_points(head.astype(local.dtype), local).astype(np.float32)


class FastEngine(Engine):
    """Rods in blocks of lanes."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        blocks = -(-len(rods.mass) // block.LANES)
        self._planes = np.zeros((blocks, rods.nodes, block.PLANES, block.LANES), np.float32)
        self.rows = np.moveaxis(self._planes[:, :, : block.CONSTANT], -1, 1)
        super().__init__(rods, contact)
        self._system: System | None = None
        self.mass = np.moveaxis(block.pack_lanes(rods.mass), -1, 1)
        self.mass[-1, (len(rods.mass) - 1) % block.LANES + 1 :] = 0.0  # only fills the block

    def _keep(self, rows: Float64Array) -> None:
        self._planes[:, :, : block.CONSTANT] = 0.0
        self._planes[:, :, : rows.shape[2]] = block.pack_lanes(rows)

    def run(self, system: System, loads: Sequence[Load]) -> None:
        """Do one substep for each load."""
        contact = self.contact
        if self._system is not system:
            nodes, metric = block.constants(self.rods, system, contact)
            self._planes[:, :, block.CONSTANT :] = block.pack_lanes(nodes)
            self._system, self._metric = system, block.pack_lanes(metric)
        settings = block.Settings(
            np.float32(system.step),
            np.float32(system.rates.damping),
            np.float32(0.0 if contact is None else contact.friction),
            np.float32(0.0 if contact is None else contact.fastest),
            -1 if contact is None else contact.rounds,
        )
        parallel_for(
            run_substeps,
            len(self._planes),
            block.Packed(block.records(self._planes, block.NODE), self._metric),
            block.steps_of(loads, system.step),
            block.acting(self.rods, loads[0]),
            NO_FIELDS if contact is None else contact.bodies.fields,
            settings,
        )
