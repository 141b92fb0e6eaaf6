"""Segments as ribbons on the grid: widened along the hull's surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hairkit import Hull, Strands
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.field.sampling_kernels import copy_point, make_unit, sample_at
from hairkit.field.smooth_volume import smooth_volume
from hairkit.parallel import compiled, compiled_with
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

    on: BoolArray
    """(N,) loose cells that a ribbon runs through."""
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
    sums = np.zeros((rank.max() + 1, 4))
    _draw(segments.points, segments.offsets, cells, profile, sums)
    on = sums[:, 3] > 0
    return Band(on, (sums[:, :3] / np.where(on, sums[:, 3], 1.0)[:, None]).astype(np.float32))


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


@compiled_with(allocates=True)
def _draw(
    points: Float32Array, offsets: Int64Array, cells: Cells, profile: Profile, sums: Float64Array
) -> None:
    """Add weighted tangents, and the weights, to the sums (N, 4) of the cells under all ribbons.

    `points` (P, 3) and `offsets` (S + 1,) are those of the segments.
    """
    slope, side, along, at = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    rank, shifts, weights = cells.rank, profile.shifts, profile.weights  # counts references once
    for s in range(len(offsets) - 1):
        for i in range(offsets[s], offsets[s + 1]):
            if i + 1 < offsets[s + 1]:  # the last point has the tangent of the one before
                for axis in range(3):
                    along[axis] = np.float64(points[i + 1, axis]) - points[i, axis]
                make_unit(along)
            copy_point(points[i], at)
            sample_at(cells.origin, cells.spacing, cells.slopes, at, slope)
            _across(along, slope, side)
            for axis in range(3):
                at[axis] = (at[axis] - cells.origin[axis]) / cells.spacing
                side[axis] /= cells.spacing
            for k in range(len(shifts)):
                x = min(max(int(at[0] + shifts[k] * side[0]), 0), rank.shape[0] - 1)
                y = min(max(int(at[1] + shifts[k] * side[1]), 0), rank.shape[1] - 1)
                z = min(max(int(at[2] + shifts[k] * side[2]), 0), rank.shape[2] - 1)
                n = rank[x, y, z]
                if n >= 0:
                    for axis in range(3):
                        sums[n, axis] += weights[k] * along[axis]
                    sums[n, 3] += weights[k]


@compiled
def _across(along: Float64Array, slope: Float64Array, side: Float64Array) -> None:
    """Write the unit vector square to both, or 0 where they are parallel, into side (3,)."""
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        side[axis] = along[c] * slope[b] - along[b] * slope[c]
    length = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
    for axis in range(3):
        side[axis] /= max(length, 1e-9)
