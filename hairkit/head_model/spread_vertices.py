"""Vertices of a head chosen evenly over a part of it."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Int64Array
from hairkit.types.head import Head


def spread_vertices(head: Head, candidates: Int64Array, count: int) -> Int64Array:
    """Return vertices chosen one by one, each farthest from those before (Gonzalez 1985).

    All `candidates` (N,) where they are fewer than `count`.
    """
    points = head.vertices[candidates].astype(np.float64)
    chosen = [0]
    distance = ((points - points[0]) ** 2).sum(1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, ((points - points[chosen[-1]]) ** 2).sum(1))
    return candidates[chosen]
