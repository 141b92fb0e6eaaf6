"""Contact between strands, for simulators with nodes: density and velocity on a grid.

`HairGrid.mix` changes the velocities of all nodes, once in a frame. Nodes are splatted to a grid in
the head frame and interpolated back (Petrovic, Henne and Anderson 2005; particle-in-cell):
velocities relax to the local mean, which models friction between hairs, and nodes move out of cells
that are denser than in the captured hair. At rest the grid has no effect: nothing moves, and no
cell is denser than captured.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled_with, parallel_for
from hairkit.simulation.hair_cells import (
    Cells,
    around,
    cell_of,
    drift_rows,
    relative_velocity,
    spread_nodes,
)
from hairkit.simulation.vectors import ONE, ZERO, Floats

SPACING = 0.02
"""Edge of a cell, metres: several distances between guides."""
ROOM = 0.1
"""Margin around the captured hair, metres."""
MOST = np.float32(4)
"""Largest crowding of a cell."""
FEW, GRIDS, WORTH = 2000, 4, 256
"""Up to FEW rods are splatted to one grid, more to GRIDS grids in parallel; rods that are worth
another thread's while."""


class Flow(NamedTuple):
    """What happens on the grid."""

    drift: Any
    """(3, 4) rows of the velocity of a point that rides on the head."""
    taken: Any
    """Share by which velocities go to those around."""
    push: Any
    """Velocity, m/s, out of a cell twice as dense as at rest next to one that is not."""


@dataclass(frozen=True, eq=False)
class HairGrid:
    """The grid and its mass at rest."""

    origin: Float64Array
    """(3,) position of the first cell, head frame."""
    density: Float64Array
    """(X, Y, Z) mass of each cell at rest, kilograms."""

    @cached_property
    def uncrowded_mass(self) -> Float64Array:
        """(X, Y, Z) mass up to which a cell is not crowded: at rest, or 1/4 of the densest cell."""
        least = max(0.25 * float(self.density.max(initial=0.0)), 1e-30)
        return np.maximum(self.density, least)

    def mix(
        self, place: Any, speed: Any, mass: Any, head_step: Float64Array, rates: tuple[float, ...]
    ) -> None:
        """Change velocities, world, of nodes at `place`, head axes, in place; roots keep theirs.

        Both are (B, L, n, 3), of B times L strands. `mass` (B, L, n), `head_step` (4, 4) the head's
        motion, `rates` cohesion in 1/s, pressure in m/s^2, seconds.
        """
        cohesion, pressure, seconds = rates
        kind = place.dtype.type
        drift = drift_rows(head_step, seconds).astype(kind)
        cells = Cells(self.origin.astype(kind), kind(1 / SPACING))
        flow = Flow(drift, kind(1 - np.exp(-cohesion * seconds)), kind(pressure * seconds))
        grids = 1 if mass[..., 0].size < FEW else GRIDS
        corners = np.zeros((grids, *self.density.shape, 4), kind)
        parallel_for(spread_nodes, grids, place, speed, mass, drift, cells, corners)
        settle_cells(corners.reshape(grids, -1, 4), self.uncrowded_mass.ravel().astype(kind))
        worth = max(WORTH // place.shape[1], 1)
        parallel_for(draw_nodes, len(place), place, speed, flow, cells, corners[0], min_chunk=worth)


def make_hair_grid(position: Float64Array, mass: Float64Array) -> HairGrid:
    """Return the grid of nodes (S, n, 3) of masses (S, n) at rest."""
    origin = position.min(axis=(0, 1)) - ROOM
    size = np.ceil((position.max(axis=(0, 1)) + ROOM - origin) / SPACING).astype(int) + 1
    corners, place = np.zeros((1, *size, 4)), position[:, None]
    cells, still = Cells(origin, 1 / SPACING), np.zeros((3, 4))
    spread_nodes(0, 1, place, np.zeros_like(place), mass[:, None], still, cells, corners)
    return HairGrid(origin, corners[0, ..., 0].copy())


@compiled_with(fastmath=True)
def settle_cells(corners: Floats, uncrowded_mass: Floats) -> None:
    """Convert masses to crowding and momenta to velocities, in the first of grids (T, C, 4)."""
    for k in range(corners.shape[1]):
        for grid in range(1, len(corners)):
            for c in range(4):
                corners[0, k, c] += corners[grid, k, c]
        if corners[0, k, 0] > ZERO:
            over = ONE / corners[0, k, 0]
            for c in range(1, 4):
                corners[0, k, c] *= over
            corners[0, k, 0] = min(max(corners[0, k, 0] / uncrowded_mass[k] - ONE, ZERO), MOST)


@compiled_with(fastmath=True)
def draw_nodes(
    first: int, last: int, place: Floats, speed: Floats, flow: Flow, cells: Cells, corners: Floats
) -> None:
    """Relax velocities towards the mean around, and push nodes out of crowded cells, in place."""
    for block in range(first, last):
        for row in range(place.shape[1], place.shape[1] * place.shape[2]):
            node, rod = row // place.shape[1], row % place.shape[1]
            here, own = place[block, rod, node], speed[block, rod, node]
            relative = relative_velocity(here, own, flow.drift)
            _, mean, slope = around(cell_of(here, cells, corners), corners)
            for axis in range(3):
                own[axis] += flow.taken * (mean[axis] - relative[axis]) - flow.push * slope[axis]
