"""Hair-hair interaction: density and velocity of all nodes on a grid around the head.

Nodes are splatted to a grid in the head frame and interpolated back (Petrovic, Henne and Anderson
2005; particle-in-cell): velocities relax to the local mean, which models friction between hairs,
and nodes move out of cells that are denser than in the captured hair. At rest the grid has no
effect: nothing moves, and no cell is denser than captured.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled_with, parallel_for
from hairkit.simulation.vectors import ONE, inlined

from .block import drift_rows
from .lanes import ZERO

SPACING = 0.02
"""Edge of a cell, metres: several distances between guides."""
ROOM = 0.1
"""Margin around the captured hair, metres."""
MOST, INSIDE = np.float32(4), np.float32(1.001)
"""Largest crowding of a cell; cells between the last value and the farthest node."""
FEW, GRIDS, WORTH = 2000, 4, 256
"""Up to FEW rods are splatted to one grid, more to GRIDS grids in parallel; rods that are worth
another thread's while."""


class Flow(NamedTuple):
    """What happens on the grid."""

    origin: Any
    """(3,) place of the first value, metres, head frame."""
    drift: Any
    """(3, 4) rows of the velocity of a point that rides on the head."""
    over: Any
    """1 / metres between values."""
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
        taken, push = kind(1 - np.exp(-cohesion * seconds)), kind(pressure * seconds)
        flow = Flow(self.origin.astype(kind), drift, kind(1 / SPACING), taken, push)
        grids = 1 if mass[..., 0].size < FEW else GRIDS
        cells = np.zeros((grids, *self.density.shape, 4), kind)
        parallel_for(spread_nodes, grids, place, speed, mass, flow, cells)
        settle_cells(cells.reshape(grids, -1, 4), self.uncrowded_mass.ravel().astype(kind))
        worth = max(WORTH // place.shape[1], 1)
        parallel_for(draw_nodes, len(place), place, speed, flow, cells[0], min_chunk=worth)


def make_hair_grid(position: Float64Array, mass: Float64Array) -> HairGrid:
    """Return the grid of nodes (S, n, 3) of masses (S, n) at rest."""
    origin = position.min(axis=(0, 1)) - ROOM
    size = np.ceil((position.max(axis=(0, 1)) + ROOM - origin) / SPACING).astype(int) + 1
    cells, still = np.zeros((1, *size, 4)), Flow(origin, np.zeros((3, 4)), 1 / SPACING, 0.0, 0.0)
    place = position[:, None]
    spread_nodes(0, 1, place, np.zeros_like(place), mass[:, None], still, cells)
    return HairGrid(origin, cells[0, ..., 0].copy())


@compiled_with(fastmath=True)
def spread_nodes(
    first: int, last: int, place: Any, speed: Any, mass: Any, flow: Flow, cells: Any
) -> None:
    """Add masses and momenta relative to the head to grids `first` to before `last`.

    `cells` (T, X, Y, Z, 4); each grid takes its share of the rods.
    """
    count, grids = len(place), len(cells)
    for grid in range(first, last):
        into = cells[grid]
        for block in range(count * grid // grids, count * (grid + 1) // grids):
            for row in range(place.shape[1] * place.shape[2]):
                rod, node = row // place.shape[2], row % place.shape[2]
                here, own = place[block, rod, node], mass[block, rod, node]
                i, j, k, a, b, c = cell_of(here, flow, into)
                u, v, w = relative(here, speed[block, rod, node], flow.drift)
                for bit in range(8):
                    up, over, on = bit >> 2, bit >> 1 & 1, bit & 1
                    part = own * (a if up else ONE - a)
                    part *= (b if over else ONE - b) * (c if on else ONE - c)
                    cell = into[i + up, j + over, k + on]
                    cell[0] += part
                    cell[1] += part * u
                    cell[2] += part * v
                    cell[3] += part * w


@compiled_with(fastmath=True)
def settle_cells(cells: Any, uncrowded_mass: Any) -> None:
    """Convert masses to crowding and momenta to velocities, in the first of grids (T, C, 4)."""
    for k in range(cells.shape[1]):
        for grid in range(1, len(cells)):
            for c in range(4):
                cells[0, k, c] += cells[grid, k, c]
        if cells[0, k, 0] > ZERO:
            over = ONE / cells[0, k, 0]
            for c in range(1, 4):
                cells[0, k, c] *= over
            cells[0, k, 0] = min(max(cells[0, k, 0] / uncrowded_mass[k] - ONE, ZERO), MOST)


@compiled_with(fastmath=True)
def draw_nodes(first: int, last: int, place: Any, speed: Any, flow: Flow, cells: Any) -> None:
    """Relax velocities towards the mean around, and push nodes out of crowded cells, in place."""
    for block in range(first, last):
        for row in range(place.shape[1] * place.shape[2]):
            rod, node = row // place.shape[2], row % place.shape[2]
            if node == 0:
                continue
            own = speed[block, rod, node]
            i, j, k, a, b, c = cell_of(place[block, rod, node], flow, cells)
            u, v, w = relative(place[block, rod, node], own, flow.drift)
            p, q, r = -flow.taken * u, -flow.taken * v, -flow.taken * w
            for bit in range(8):
                up, over, on = bit >> 2, bit >> 1 & 1, bit & 1
                f, g, h = (a if up else ONE - a), (b if over else ONE - b), (c if on else ONE - c)
                cell = cells[i + up, j + over, k + on]
                share, crowd = flow.taken * f * g * h, flow.push * cell[0]
                p += share * cell[1] - (crowd if up else -crowd) * g * h
                q += share * cell[2] - (crowd if over else -crowd) * f * h
                r += share * cell[3] - (crowd if on else -crowd) * f * g
            own[0] += p
            own[1] += q
            own[2] += r


@inlined
def cell_of(place: Any, flow: Flow, cells: Any) -> Any:
    """Return a node's cell, clamped to the grid, and the shares of the way to the next one."""
    x, y, z = np.float32(cells.shape[0]), np.float32(cells.shape[1]), np.float32(cells.shape[2])
    a = min(max((place[0] - flow.origin[0]) * flow.over, ZERO), x - INSIDE)
    b = min(max((place[1] - flow.origin[1]) * flow.over, ZERO), y - INSIDE)
    c = min(max((place[2] - flow.origin[2]) * flow.over, ZERO), z - INSIDE)
    i, j, k = int(a), int(b), int(c)
    return i, j, k, a - np.float32(i), b - np.float32(j), c - np.float32(k)


@inlined
def relative(place: Any, speed: Any, drift: Any) -> Any:
    """Return the velocity of a node against that of the head there."""
    x, y, z = place[0], place[1], place[2]
    return (
        speed[0] - (drift[0, 0] * x + drift[0, 1] * y + drift[0, 2] * z + drift[0, 3]),
        speed[1] - (drift[1, 0] * x + drift[1, 1] * y + drift[1, 2] * z + drift[1, 3]),
        speed[2] - (drift[2, 0] * x + drift[2, 1] * y + drift[2, 2] * z + drift[2, 3]),
    )
