"""Points that keep a distance from each other, taken in turn: a step of the dart throwing of roots.

McCool and Fiume 1992. Taken points are kept in chains, one for each cell of a grid.
"""

from __future__ import annotations

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
    following = np.full(len(taken), -1, np.int32)
    return int(_take_free(points, low, edge, apart, radius, heads, following, taken, found))


@compiled
def _take_free(
    points: Float64Array,
    low: Float64Array,
    edge: float,
    apart: Float64Array,
    radius: float,
    heads: Int32Array,
    following: Int32Array,
    taken: Int64Array,
    found: int,
) -> int:  # pragma: no cover - compiled
    """Do the work of `take_free` with chains of the taken points of each cell."""
    for n in range(found):
        _link(n, _cell_of(points[taken[n]], low, edge), heads, following)
    for i in range(len(points)):
        if apart[i] < radius:
            continue
        if found == len(taken):
            break
        cell = _cell_of(points[i], low, edge)
        apart[i] = _distance_to_taken(points, i, cell, heads, following, taken)
        if apart[i] >= radius:
            apart[i] = 0.0
            taken[found] = i
            _link(found, cell, heads, following)
            found += 1
    return found


@compiled
def _cell_of(
    point: Float64Array, low: Float64Array, edge: float
) -> tuple[int, int, int]:  # pragma: no cover - compiled
    """Return the cell of a point; there is an empty one before the first and after the last."""
    x, y, z = (point[0] - low[0]) / edge, (point[1] - low[1]) / edge, (point[2] - low[2]) / edge
    return int(x) + 1, int(y) + 1, int(z) + 1


@compiled
def _link(
    n: int, cell: tuple[int, int, int], heads: Int32Array, following: Int32Array
) -> None:  # pragma: no cover - compiled
    """Put taken point n in front of the chain of its cell."""
    following[n] = heads[cell[0], cell[1], cell[2]]
    heads[cell[0], cell[1], cell[2]] = n


@compiled
def _distance_to_taken(
    points: Float64Array,
    i: int,
    cell: tuple[int, int, int],
    heads: Int32Array,
    following: Int32Array,
    taken: Int64Array,
) -> float:  # pragma: no cover - compiled
    """Return the distance of point i to the nearest taken one of the 27 cells around it."""
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    nearest = np.inf
    for a in range(cell[0] - 1, cell[0] + 2):
        for b in range(cell[1] - 1, cell[1] + 2):
            for c in range(cell[2] - 1, cell[2] + 2):
                n = heads[a, b, c]
                while n >= 0:
                    at = points[taken[n]]
                    apart = (at[0] - x) ** 2 + (at[1] - y) ** 2 + (at[2] - z) ** 2
                    nearest = min(nearest, apart)
                    n = following[n]
    return float(np.sqrt(nearest))
