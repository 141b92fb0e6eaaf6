"""Mass and momentum of hair on a grid, compiled: what contact between strands is made of.

Nodes are spread to the corners of their cells, trilinear, and what is there is interpolated back
(particle in cell).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled_with
from hairkit.simulation.vectors import ONE, ZERO, Floats, Vector, inlined

INSIDE = np.float32(1.001)
"""Cells between the last corner and the farthest node that is spread on it."""


class Cells(NamedTuple):
    """Where a grid is."""

    origin: Floats
    """(3,) place of the first corner, metres."""
    over: float
    """1 / metres between corners."""


@inlined
def cell_of(place: Floats, cells: Cells, corners: Floats) -> tuple[int, int, int, Vector]:
    """Return a node's cell, clamped to the grid (X, Y, Z, 4), and its share of the way across."""
    x, y, z = np.float32(corners.shape[0]), np.float32(corners.shape[1]), corners.shape[2]
    a = min(max((place[0] - cells.origin[0]) * cells.over, ZERO), x - INSIDE)
    b = min(max((place[1] - cells.origin[1]) * cells.over, ZERO), y - INSIDE)
    c = min(max((place[2] - cells.origin[2]) * cells.over, ZERO), np.float32(z) - INSIDE)
    i, j, k = int(a), int(b), int(c)
    return i, j, k, (a - np.float32(i), b - np.float32(j), c - np.float32(k))


@inlined
def around(cell: tuple[int, int, int, Vector], corners: Floats) -> tuple[Any, Vector, Vector]:
    """Return the first value of corners (X, Y, Z, 4) at a place in its cell, the others, the slope.

    The slope is that of the first value across a cell.
    """
    i, j, k, (a, b, c) = cell
    value, u, v, w = ZERO, ZERO, ZERO, ZERO
    x, y, z = ZERO, ZERO, ZERO
    for bit in range(8):
        up, over, on = bit >> 2, bit >> 1 & 1, bit & 1
        f, g, h = (a if up else ONE - a), (b if over else ONE - b), (c if on else ONE - c)
        corner, share = corners[i + up, j + over, k + on], f * g * h
        first = corner[0]
        value += share * first
        u += share * corner[1]
        v += share * corner[2]
        w += share * corner[3]
        x += (first if up else -first) * g * h
        y += (first if over else -first) * f * h
        z += (first if on else -first) * f * g
    return value, (u, v, w), (x, y, z)


@inlined
def relative_velocity(place: Floats, velocity: Floats, drift: Floats) -> Vector:
    """Return a node's velocity less that of a point that rides on the head: `drift` (3, 4)."""
    x, y, z = place[0], place[1], place[2]
    return (
        velocity[0] - (drift[0, 0] * x + drift[0, 1] * y + drift[0, 2] * z + drift[0, 3]),
        velocity[1] - (drift[1, 0] * x + drift[1, 1] * y + drift[1, 2] * z + drift[1, 3]),
        velocity[2] - (drift[2, 0] * x + drift[2, 1] * y + drift[2, 2] * z + drift[2, 3]),
    )


def drift_rows(head_step: Float64Array, seconds: float) -> Float64Array:
    """Return rows (..., 3, 4) that map a point to the head's velocity there, head axes, m/s.

    `head_step` (..., 4, 4) is the change of axes in so many seconds.
    """
    return (np.eye(4) - head_step)[..., :3, :] / seconds


@compiled_with(fastmath=True)
def spread_nodes(
    first: int,
    last: int,
    place: Floats,
    velocity: Floats,
    mass: Floats,
    drift: Floats,
    cells: Cells,
    corners: Floats,
) -> None:
    """Add masses and momenta to grids `first` to before `last` of `corners` (T, X, Y, Z, 4).

    `place` and `velocity` are (B, L, n, 3), `mass` (B, L, n), of B times L strands, of which each
    grid takes its share. Momenta are relative to `drift`, see `relative_velocity`.
    """
    count, grids = len(place), len(corners)
    for grid in range(first, last):
        into = corners[grid]
        for block in range(count * grid // grids, count * (grid + 1) // grids):
            for row in range(place.shape[1] * place.shape[2]):
                node, rod = row // place.shape[1], row % place.shape[1]
                here, own = place[block, rod, node], mass[block, rod, node]
                i, j, k, (a, b, c) = cell_of(here, cells, into)
                u, v, w = relative_velocity(here, velocity[block, rod, node], drift)
                for bit in range(8):
                    up, over, on = bit >> 2, bit >> 1 & 1, bit & 1
                    part = own * (a if up else ONE - a)
                    part *= (b if over else ONE - b) * (c if on else ONE - c)
                    corner = into[i + up, j + over, k + on]
                    corner[0] += part
                    corner[1] += part * u
                    corner[2] += part * v
                    corner[3] += part * w
