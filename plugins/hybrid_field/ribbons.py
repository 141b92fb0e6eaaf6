"""Segments as ribbons on the grid: widened along the hull's surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hairkit import Hull, Strands
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from hairkit.field.sampling_kernels import sample_at
from hairkit.field.smooth_volume import smooth_volume
from hairkit.parallel import compiled
from hairkit.types.volume import cell_slopes

SURFACE = 2.0
"""Gaussian in cells of the hull's occupancy, whose gradient is the surface's normal."""
EDGE_SIGMAS = 2
"""Sigmas of the Gaussian weight at a ribbon's edges."""
STEP_CELLS = 0.5
"""Cells at most between the lines that a ribbon is drawn as, so that none is left out."""


@dataclass(frozen=True, eq=False)
class Band:
    """Ribbons on the grid."""

    cells: BoolArray
    """(X, Y, Z) loose cells that a ribbon runs through."""
    direction: Float32Array
    """(N, 3) mean signed tangent of the loose cells, not longer than 1; 0 where none runs."""


def ribbons(segments: Strands, hull: Hull, reach: float) -> Band:
    """Return the cells of all ribbons and their mean signed tangents.

    A ribbon is a segment widened by `reach` metres to both sides, along the hull's surface and
    square to the segment.
    """
    grid = hull.grid
    steps = max(int(np.ceil(reach / (STEP_CELLS * grid.spacing))), 1) if reach > 0 else 0
    share = np.arange(-steps, steps + 1) / max(steps, 1)
    rank = np.full(grid.shape, -1, np.int32)
    rank[hull.loose] = np.arange(np.count_nonzero(hull.loose))
    occupancy = smooth_volume(hull.dense.astype(np.float32), SURFACE)
    cells = Cells(grid.origin, grid.spacing, rank, cell_slopes(occupancy))
    profile = Profile(reach * share, np.exp(-0.5 * (EDGE_SIGMAS * share) ** 2))
    total = np.zeros((rank.max() + 1, 3))
    weight = np.zeros(len(total))
    _draw(segments.points, segments.tangents(), cells, profile, total, weight)
    on = weight > 0
    drawn = np.zeros(grid.shape, bool)
    drawn[hull.loose] = on
    direction = (total / np.where(on, weight, 1.0)[:, None]).astype(np.float32)
    return Band(drawn, direction)


class Cells(NamedTuple):
    """The grid that ribbons are drawn on."""

    origin: Float64Array
    """(3,) lowest corner of the grid, metres, head frame."""
    spacing: float
    """Edge of a cell, metres."""
    rank: Int32Array
    """(X, Y, Z) number of each loose cell, -1 elsewhere."""
    slopes: Float32Array
    """(X, Y, Z, 3) gradient of the hull's smoothed occupancy."""


class Profile(NamedTuple):
    """A ribbon's cross-section."""

    shifts: Float64Array
    """(K,) metres to the side."""
    weights: Float64Array
    """(K,) of the tangents there."""


@compiled
def _draw(
    points: Float32Array,
    tangents: Float32Array,
    cells: Cells,
    profile: Profile,
    total: Float64Array,
    weight: Float64Array,
) -> None:
    """Add weighted tangents (P, 3), and the weights, to the cells (N, 3), (N,) under all ribbons.

    `points` and `tangents` are those of the segments.
    """
    slope, side = np.empty(3), np.empty(3)
    for i in range(len(points)):
        sample_at(cells.origin, cells.spacing, cells.slopes, points[i], slope)
        _across(tangents[i], slope, side)
        for k in range(len(profile.shifts)):
            x = _cell(cells, 0, points[i, 0] + profile.shifts[k] * side[0])
            y = _cell(cells, 1, points[i, 1] + profile.shifts[k] * side[1])
            z = _cell(cells, 2, points[i, 2] + profile.shifts[k] * side[2])
            n = cells.rank[x, y, z]
            if n >= 0:
                for axis in range(3):
                    total[n, axis] += profile.weights[k] * tangents[i, axis]
                weight[n] += profile.weights[k]


@compiled
def _across(along: Float32Array, slope: Float64Array, side: Float64Array) -> None:
    """Write the unit vector square to both, or 0 where they are parallel, into side (3,)."""
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        side[axis] = along[c] * slope[b] - along[b] * slope[c]
    length = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
    for axis in range(3):
        side[axis] /= max(length, 1e-9)


@compiled
def _cell(cells: Cells, axis: int, at: float) -> int:
    """Return the cell along one axis that holds a coordinate, clamped to the grid."""
    nearest = int(np.rint((at - cells.origin[axis]) / cells.spacing - 0.5))
    last = int(cells.rank.shape[axis]) - 1
    return min(max(nearest, 0), last)
