"""Push strand points out of the head along the gradient of its signed distance."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.field.sampling_kernels import copy_point, gradient_at, sample_at
from hairkit.parallel import compiled, parallel_for
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull

ROUNDS = 3
"""Times that a point is moved along the gradient of the sampled distance."""
MIN_POINTS = 2048
"""Least number of points that are worth another thread."""


def push_out_of_head(strands: Strands, hull: Hull, clearance: float) -> Strands:
    """Return strands whose points, but for the roots, keep `clearance` metres from the head."""
    points = strands.points.copy()
    free = np.ones(len(points), bool)
    free[strands.offsets[:-1]] = False
    field = _HeadDistance(hull.grid.origin, float(hull.grid.spacing), hull.head_distance[..., None])
    parallel_for(
        _push_points, len(points), field, float(clearance), free, points, min_chunk=MIN_POINTS
    )
    return replace(strands, points=points)


class _HeadDistance(NamedTuple):
    """Signed distance to the head on a grid."""

    origin: Float64Array
    """(3,) corner of the grid, metres."""
    spacing: float
    """Edge of a cell, metres."""
    values: Float32Array
    """(X, Y, Z, 1) metres, negative inside."""


@compiled
def _push_points(
    first: int,
    last: int,
    head: _HeadDistance,
    clearance: float,
    free: BoolArray,
    points: Float32Array,
) -> None:
    """Move free points (P, 3) along the distance's gradient until they are `clearance` off."""
    p, level, normal = np.empty(3), np.empty(1), np.empty(3)
    for i in range(first, last):
        if not free[i]:
            continue
        copy_point(points[i], p)
        for _ in range(ROUNDS):
            sample_at(head.origin, head.spacing, head.values, p, level)
            lack = clearance - level[0]
            if lack <= 0:
                break
            gradient_at(head.origin, head.spacing, head.values, p, normal)
            for axis in range(3):
                p[axis] += lack * normal[axis]
                points[i, axis] = p[axis]
