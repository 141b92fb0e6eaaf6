"""Points that keep a distance from each other, taken in turn: a step of the dart throwing of roots.

McCool and Fiume 1992. Taken points are kept in chains, one for each cell of a grid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array, Int32Array, Int64Array
from hairkit.parallel import compiled

MOST_CELLS = 200
"""Cells a side, at most, of the grid that finds roots nearby."""


def take_free(
    points: Float64Array, apart: Float64Array, radius: float, taken: Int64Array, found: int
) -> int:
    """Append to `taken` in turn the points (M, 3) that have no taken one within the radius.

    Parameters
    ----------
    apart
        (M,) distance to some taken point, infinite where none is known, 0 for taken ones; updated.
    taken
        (N,) indices of taken points, `found` of them known; ends when it is full.

    Returns
    -------
    How many are taken now.
    """
    low = np.array([column.min() for column in points.T])
    size = np.array([column.max() for column in points.T]) - low
    edge = max(radius, float(size.max()) / MOST_CELLS)
    heads = np.full(tuple((size / edge).astype(np.int64) + 3), -1, np.int32)
    chains = Chains(low, edge, heads, np.full(len(taken), -1, np.int32))
    return int(_take_free(points, apart, radius, chains, taken, found))


class Chains(NamedTuple):
    """The taken points of each cell of a grid."""

    low: Float64Array
    """(3,) lowest corner of the points, metres."""
    edge: float
    """Of a cell, metres."""
    heads: Int32Array
    """(X, Y, Z) number of the point that a cell took last, -1 where there is none."""
    following: Int32Array
    """(N,) the one that its cell took before each, -1 for the first."""


@compiled
def _take_free(
    points: Float64Array,
    apart: Float64Array,
    radius: float,
    chains: Chains,
    taken: Int64Array,
    found: int,
) -> int:
    """Do the work of `take_free`."""
    for n in range(found):
        _link(n, _cell_of(points[taken[n]], chains), chains)
    for i in range(len(points)):
        if apart[i] < radius:
            continue
        if found == len(taken):
            break
        cell = _cell_of(points[i], chains)
        apart[i] = _distance_to_taken(points, i, cell, chains, taken)
        if apart[i] >= radius:
            apart[i] = 0.0
            taken[found] = i
            _link(found, cell, chains)
            found += 1
    return found


@compiled
def _cell_of(point: Float64Array, chains: Chains) -> tuple[int, int, int]:
    """Return the cell of a point; there is an empty one before the first and after the last."""
    low, edge = chains.low, chains.edge
    x, y, z = (point[0] - low[0]) / edge, (point[1] - low[1]) / edge, (point[2] - low[2]) / edge
    return int(x) + 1, int(y) + 1, int(z) + 1


@compiled
def _link(n: int, cell: tuple[int, int, int], chains: Chains) -> None:
    """Put taken point n in front of the chain of its cell."""
    chains.following[n] = chains.heads[cell[0], cell[1], cell[2]]
    chains.heads[cell[0], cell[1], cell[2]] = n


@compiled
def _distance_to_taken(
    points: Float64Array, i: int, cell: tuple[int, int, int], chains: Chains, taken: Int64Array
) -> float:
    """Return the distance of point i to the nearest taken one of the 27 cells around it."""
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    nearest = np.inf
    for a in range(cell[0] - 1, cell[0] + 2):
        for b in range(cell[1] - 1, cell[1] + 2):
            for c in range(cell[2] - 1, cell[2] + 2):
                n = chains.heads[a, b, c]
                while n >= 0:
                    at = points[taken[n]]
                    apart = (at[0] - x) ** 2 + (at[1] - y) ** 2 + (at[2] - z) ** 2
                    nearest = min(nearest, apart)
                    n = chains.following[n]
    return float(np.sqrt(nearest))
