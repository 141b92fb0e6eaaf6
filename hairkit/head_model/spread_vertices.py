"""Vertices of a head chosen evenly over a part of it."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Int64Array
from hairkit.types.head import Head


def spread_vertices(head: Head, candidates: Int64Array, count: int) -> Int64Array:
    """Return vertices chosen one by one, each farthest from those before (Gonzalez 1985).

    All `candidates` (N,) where they are fewer than `count`.
    """
    points = np.ascontiguousarray(head.vertices[candidates].T, np.float64)
    chosen, distance = [0], np.full(len(candidates), np.inf)
    while len(chosen) < min(count, len(candidates)):
        x, y, z = points - points[:, chosen[-1:]]
        distance = np.minimum(distance, x * x + y * y + z * z)
        chosen.append(int(distance.argmax()))
    return candidates[chosen]
