"""Strands lifted out of the head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.combing import gradient
from hairkit.strands import Strands
from hairkit.volume import Hull

ROUNDS = 3
"""Times that a point is moved along the gradient of the sampled distance."""


def kept_outside(strands: Strands, hull: Hull, clearance: float) -> Strands:
    """Return strands whose points, but for the roots, keep `clearance` metres from the head."""
    points = strands.points.astype(np.float64)
    free = np.ones(len(points), bool)
    free[strands.offsets[:-1]] = False
    for _ in range(ROUNDS):
        lack = clearance - hull.grid.sample(hull.head_distance, points)
        near = np.flatnonzero((lack > 0) & free)
        points[near] += lack[near, None] * gradient(hull.grid, hull.head_distance, points[near])
    return replace(strands, points=points.astype(np.float32))
