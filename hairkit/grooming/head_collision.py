"""Strands lifted out of the head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit, prange

from hairkit.field.sampling_kernels import gradient_at, sample_at
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull

ROUNDS = 3
"""Times that a point is moved along the gradient of the sampled distance."""


def kept_outside(strands: Strands, hull: Hull, clearance: float) -> Strands:
    """Return strands whose points, but for the roots, keep `clearance` metres from the head."""
    points = strands.points.copy()
    free = np.ones(len(points), bool)
    free[strands.offsets[:-1]] = False
    distance = hull.head_distance[..., None]
    _lift(hull.grid.origin, hull.grid.spacing, distance, clearance, free, points)
    return replace(strands, points=points)


@njit(cache=True, parallel=True)
def _lift(origin, spacing, distance, clearance, free, points):  # type: ignore[no-untyped-def]
    """Move free points (P, 3) along the distance's gradient until they are `clearance` off."""
    for i in prange(len(points)):
        if free[i]:
            p, level, normal = np.empty(3), np.empty(1), np.empty(3)
            p[:] = points[i]
            for _ in range(ROUNDS):
                sample_at(origin, spacing, distance, p, level)
                lack = clearance - level[0]
                if lack <= 0:
                    break
                gradient_at(origin, spacing, distance, p, normal)
                for axis in range(3):
                    p[axis] += lack * normal[axis]
                    points[i, axis] = p[axis]
