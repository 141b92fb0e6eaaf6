"""Segments as ribbons on the grid: widened along the hull's surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import ndimage

from hairkit import Hull, Strands
from hairkit.arrays import BoolArray, Float32Array
from hairkit.field.sampling_kernels import sample_at
from hairkit.types.volume import cell_slopes

SURFACE = 2.0
"""Gaussian in cells of the hull's occupancy, whose slope is the surface's normal."""


@dataclass(frozen=True, eq=False)
class Band:
    """Ribbons on the grid."""

    cells: BoolArray
    """(X, Y, Z) loose cells that a ribbon runs through."""
    direction: Float32Array
    """(X, Y, Z, 3) mean signed tangent, not longer than 1; 0 elsewhere."""


def ribbons(segments: Strands, hull: Hull, reach: float) -> Band:
    """Return the cells of all ribbons and their mean signed tangents.

    A ribbon is a segment widened by `reach` metres to both sides, along the hull's surface and
    square to the segment.
    """
    grid = hull.grid
    steps = max(int(np.ceil(reach / (0.5 * grid.spacing))), 1) if reach > 0 else 0
    share = np.arange(-steps, steps + 1) / max(steps, 1)
    row = np.full(grid.shape, -1, np.int32)
    row[hull.loose] = np.arange(np.count_nonzero(hull.loose))
    total = np.zeros((row.max() + 1, 4))
    _draw(
        grid.origin,
        grid.spacing,
        cell_slopes(ndimage.gaussian_filter(hull.dense.astype(np.float32), SURFACE)),
        segments.points,
        segments.tangents(),
        reach * share,
        np.exp(-0.5 * (2 * share) ** 2),
        row,
        total,
    )
    on = total[:, 3] > 0
    cells = np.zeros(grid.shape, bool)
    cells[hull.loose] = on
    direction = np.zeros((*grid.shape, 3), np.float32)
    direction[cells] = total[on, :3] / total[on, 3:]
    return Band(cells, direction)


@njit(cache=True)
def _draw(origin, spacing, slopes, points, tangents, shifts, weights, row, total):  # type: ignore[no-untyped-def]
    """Add weighted tangents (P, 3), and the weights, to total (N, 4) at every shift to the side,
    metres; row (X, Y, Z) says which of N a cell is, -1 for none."""
    nx, ny, nz = row.shape
    slope, side = np.empty(3), np.empty(3)
    for i in range(len(points)):
        sample_at(origin, spacing, slopes, points[i], slope)
        _across(tangents[i], slope, side)
        for k in range(len(shifts)):
            x = _cell(origin[0], spacing, nx, points[i, 0] + shifts[k] * side[0])
            y = _cell(origin[1], spacing, ny, points[i, 1] + shifts[k] * side[1])
            z = _cell(origin[2], spacing, nz, points[i, 2] + shifts[k] * side[2])
            n = row[x, y, z]
            if n >= 0:
                for axis in range(3):
                    total[n, axis] += weights[k] * tangents[i, axis]
                total[n, 3] += weights[k]


@njit(cache=True, inline="always")
def _across(along, slope, side):  # type: ignore[no-untyped-def]
    """Write the unit vector square to both, or 0 where they are parallel, into side (3,)."""
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        side[axis] = along[c] * slope[b] - along[b] * slope[c]
    length = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
    for axis in range(3):
        side[axis] /= max(length, 1e-9)


@njit(cache=True, inline="always")
def _cell(origin, spacing, count, at):  # type: ignore[no-untyped-def]
    """Return the cell along one axis that holds a coordinate, clamped to the grid."""
    return min(max(int(np.rint((at - origin) / spacing - 0.5)), 0), count - 1)
