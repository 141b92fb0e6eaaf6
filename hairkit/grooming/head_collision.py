"""Push strand points out of the head along the gradient of its signed distance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.field.growth_prior import gradient
from hairkit.types.strands import Strands
from hairkit.types.volume import VoxelGrid

ROUNDS = 3
"""Times that a point is moved along the gradient of the sampled distance."""
FULL_AFTER = 0.004
"""Metres from the root after which a strand keeps its whole distance from the head."""


def push_out_of_head(
    strands: Strands, grid: VoxelGrid, distance: Float32Array, clearance: float
) -> Strands:
    """Return strands whose points, but for the roots, keep `clearance` metres from the head.

    `distance` (X, Y, Z) is the signed one to the head in the cells of the grid. The clearance grows
    from 0 at the root: a strand that keeps all of it at once would leave the skin upright.
    """
    points = strands.points.astype(np.float64)
    apart = clearance * np.minimum(strands.arc_lengths() / FULL_AFTER, 1.0)
    apart[strands.offsets[:-1]] = -np.inf
    cell = tuple(grid.nearest_cell(points).T)
    near = np.flatnonzero(apart + grid.spacing > distance[cell])  # a distance changes no faster
    for _ in range(ROUNDS):
        lack = apart[near] - grid.sample(distance, points[near])
        near, lack = near[lack > 0], lack[lack > 0]
        if not len(near):
            break
        points[near] += lack[:, None] * gradient(grid, distance, points[near])
    return replace(strands, points=points.astype(np.float32))
