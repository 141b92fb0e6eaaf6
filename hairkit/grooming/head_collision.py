"""Push strand points out of the head along the gradient of its signed distance."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.field.sampling_kernels import copy_point, gradient_at, sample_at
from hairkit.parallel import compiled_with, parallel_for
from hairkit.types.strands import Strands
from hairkit.types.volume import VoxelGrid

ROUNDS = 3
"""Times that a point is moved along the gradient of the sampled distance."""
FULL_AFTER = 0.004
"""Metres from the root after which a strand keeps its whole distance from the head."""
MIN_POINTS = 2048
"""Least number of points that are worth another thread."""


def push_out_of_head(
    strands: Strands, grid: VoxelGrid, distance: Float32Array, clearance: float
) -> Strands:
    """Return strands whose points, but for the roots, keep `clearance` metres from the head.

    `distance` (X, Y, Z) is the signed one to the head in the cells of the grid. The clearance grows
    from 0 at the root: a strand that keeps all of it at once would leave the skin upright.
    """
    points = strands.points.copy()
    apart = clearance * np.minimum(strands.arc_lengths() / FULL_AFTER, 1.0)
    apart[strands.offsets[:-1]] = -np.inf
    field = _HeadDistance(grid.origin, float(grid.spacing), distance[..., None])
    parallel_for(_push_points, len(points), field, apart, points, min_chunk=MIN_POINTS)
    return replace(strands, points=points)


class _HeadDistance(NamedTuple):
    """Signed distance to the head on a grid."""

    origin: Float64Array
    """(3,) corner of the grid, metres."""
    spacing: float
    """Edge of a cell, metres."""
    values: Float32Array
    """(X, Y, Z, 1) metres, negative inside."""


@compiled_with(allocates=True)
def _push_points(
    first: int,
    last: int,
    head: _HeadDistance,
    apart: Float64Array,
    points: Float32Array,
) -> None:
    """Move points (P, 3) along the distance's gradient until they are `apart` (P,) off."""
    p, level, normal = np.empty(3), np.empty(1), np.empty(3)
    for i in range(first, last):
        copy_point(points[i], p)
        for _ in range(ROUNDS):
            sample_at(head.origin, head.spacing, head.values, p, level)
            lack = apart[i] - level[0]
            if lack <= 0:
                break
            gradient_at(head.origin, head.spacing, head.values, p, normal)
            for axis in range(3):
                p[axis] += lack * normal[axis]
                points[i, axis] = p[axis]
