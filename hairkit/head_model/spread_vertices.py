"""Points chosen evenly, one by one, each farthest from those before (Gonzalez 1985)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.types.head import Head


def spread_points(
    points: npt.NDArray[np.floating],
    count: int,
    apart: Float64Array | float = np.inf,
    scale: Float64Array | float = 1.0,
) -> Int64Array:
    """Return the numbers of `count` rows of points (N, F), all where there are fewer.

    `apart` (N,) are squared distances to what is taken already, without any the first row is; they
    and those between points count times a scale (N,).
    """
    chosen = np.empty(min(count, len(points)), np.int64)
    columns, away = np.ascontiguousarray(points.T), np.full(len(points), apart)
    for k in range(len(chosen)):
        chosen[k] = (away * scale).argmax()
        away = np.minimum(away, ((columns - columns[:, chosen[k], None]) ** 2).sum(axis=0))
        away[chosen[k]] = -1.0  # not again, where points lie on each other
    return chosen


def spread_vertices(head: Head, candidates: Int64Array, count: int) -> Int64Array:
    """Return vertices of a head; all `candidates` (N,) where they are fewer than `count`."""
    return candidates[spread_points(head.vertices[candidates].astype(np.float64), count)]
