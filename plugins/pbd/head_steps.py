"""How finely a frame is divided for a fast head."""

from __future__ import annotations

import math

import numpy as np

from hairkit.arrays import Float64Array

FARTHEST, WIDEST = 0.12, 1.2
"""Way of a root in a frame, metres, and turn, radians, from which the head is cut to its new place:
more than 7 m/s, 4,100 degrees a second."""
SUBSTEPS, FINEST = 4, 8
"""Substeps of a frame that a root's way is compared with, and how many times as many there are at
most, for a fast head."""
SHORTEST_WAY = 1e-3
"""Metres that a root may go in a substep however short the hair is."""


def finer_steps(start: Float64Array, end: Float64Array, roots: Float64Array, segment: float) -> int:
    """Return how many times as many substeps a frame needs; 0 where the head is cut to its place.

    In a substep a root goes no farther than half of `segment`, a usual length between nodes in
    metres: beyond, the directions that lengths are linearised about are those of other segments.
    `roots` (S, 3) are in head axes.
    """
    if (start == end).all() or not len(roots):
        return 1
    change = end - start
    way = float(np.linalg.norm(roots @ change[:3, :3].T + change[:3, 3], axis=1).max())
    cosine = 0.5 * (float(np.trace(end[:3, :3] @ start[:3, :3].T)) - 1)
    if way > FARTHEST or cosine < math.cos(WIDEST):
        return 0
    most = SUBSTEPS * max(0.5 * segment, SHORTEST_WAY)
    return min(1 << math.ceil(math.log2(max(way / most, 1.0))), FINEST)
