"""The compiled engine: blocks of rods on all cores."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation.lanes import LANES, Kind, pack_lanes
from hairkit.simulation.substeps import StepArrays, Steps

from . import block
from .block import Blocks, Contact
from .kernels import run_substeps
from .linear_system import System
from .rods import Rods, State, rest_state


class Engine:
    """Keeps the state of rods in blocks of lanes, of float32 or float64, and advances it."""

    def __init__(self, rods: Rods, contact: Contact, kind: Kind = np.float32) -> None:
        self.rods, self.contact, self._kind = rods, contact, kind
        blocks = -(-len(rods.mass) // LANES)
        self._planes = np.zeros((blocks, rods.nodes, block.PLANES, LANES), kind)
        self.rows = np.moveaxis(self._planes[:, :, : block.CONSTANT], -1, 1)
        """(B, L, n, 16) `block.NodeState` of B times L rods; the last ones may be void."""
        self.mass = np.moveaxis(pack_lanes(rods.mass, kind), -1, 1)
        """(B, L, n) kilograms; 0 of void rods."""
        self.mass[-1, (len(rods.mass) - 1) % LANES + 1 :] = 0.0  # only fills the block
        self._system: System | None = None
        self.state = rest_state(rods)

    @property
    def state(self) -> State:
        """The present state; setting it moves the rods."""
        rows = self.rows.reshape(-1, *self.rows.shape[2:])[: len(self.rods.mass)]
        return block.state_of(rows.astype(np.float64))

    @state.setter
    def state(self, value: State) -> None:
        rows = block.state_rows(self.rods, value)
        self._planes[:, :, : block.CONSTANT] = 0.0
        self._planes[:, :, : rows.shape[2]] = pack_lanes(rows, self._kind)

    def run(self, system: System, steps: StepArrays, outer: Float64Array) -> None:
        """Do the substeps; `outer` is `block.acting`."""
        contact, kind = self.contact, self._kind
        if self._system is not system:
            nodes, metric = block.constants(self.rods, system, contact)
            self._planes[:, :, block.CONSTANT :] = pack_lanes(nodes, kind)
            self._system, self._metric = system, pack_lanes(metric, kind)
        parallel_for(
            run_substeps,
            len(self._planes),
            Blocks(
                block.records(self._planes, block.NODE[kind]),
                self._metric,
                block.records(pack_lanes(outer, kind), block.ACTING[kind]),
            ),
            np.zeros((1, self.rods.nodes + 2), block.WORK[kind]),
            Steps(*(part.astype(kind) for part in steps)),
            contact.bodies.fields,
            block.settings_of(system, contact, kind),
        )
