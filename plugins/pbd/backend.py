"""What all backends share, and the compiled ones, on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation.hair_grid import HairGrid
from hairkit.simulation.obstacle_kernels import NO_FIELDS

from . import block
from .embedding import Embedding, drawn_points
from .kernels import run_substeps
from .linear_system import System
from .rods import Rods
from .state import Contact, Load, State, rest_state, transform_points


class Engine:
    """A backend: how the state is kept; subclasses advance it."""

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
        raise NotImplementedError

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

    kind: block.Kind = np.float32

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        blocks = -(-len(rods.mass) // block.LANES)
        self._planes = np.zeros((blocks, rods.nodes, block.PLANES, block.LANES), self.kind)
        self.rows = np.moveaxis(self._planes[:, :, : block.CONSTANT], -1, 1)
        super().__init__(rods, contact)
        self._system: System | None = None
        self.mass = np.moveaxis(block.pack_lanes(rods.mass, self.kind), -1, 1)
        self.mass[-1, (len(rods.mass) - 1) % block.LANES + 1 :] = 0.0  # only fills the block

    def _keep(self, rows: Float64Array) -> None:
        self._planes[:, :, : block.CONSTANT] = 0.0
        self._planes[:, :, : rows.shape[2]] = block.pack_lanes(rows, self.kind)

    def run(self, system: System, loads: Sequence[Load]) -> None:
        """Do one substep for each load."""
        contact, kind = self.contact, self.kind
        if self._system is not system:
            nodes, metric = block.constants(self.rods, system, contact)
            self._planes[:, :, block.CONSTANT :] = block.pack_lanes(nodes, kind)
            self._system, self._metric = system, block.pack_lanes(metric, kind)
        settings = block.Settings(
            kind(system.step),
            kind(system.rates.damping),
            kind(0.0 if contact is None else contact.friction),
            kind(0.0 if contact is None else contact.fastest),
            -1 if contact is None else contact.rounds,
        )
        work = np.zeros(self.rods.nodes + 2, block.WORK[kind])
        parallel_for(
            run_substeps,
            len(self._planes),
            block.Packed(block.records(self._planes, block.NODE[kind]), self._metric, work),
            block.steps_of(loads, system.step, kind),
            block.acting(self.rods, loads[0], kind),
            NO_FIELDS if contact is None else contact.bodies.fields,
            settings,
        )


class PreciseEngine(FastEngine):
    """The same in float64, which tells what is rounding."""

    kind = np.float64
