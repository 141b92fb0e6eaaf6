"""The patent's four fields and their weighted sum, on the hull's grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from hairkit import Hull, Strands
from hairkit.arrays import BoolArray, Float32Array, read_only, unit_vectors
from hairkit.field.cell_shells import erode_cells
from hairkit.field.diffusion import CellGraph, solve_screened
from hairkit.field.growth_prior import ScalpComb
from hairkit.field.symmetric_eigen import smallest_eigenvectors
from hairkit.types.volume import cell_slopes, outer_products

from .options import Options
from .ribbons import Band

FIXED = 1e3
"""Weight of a cell's data against a smoothness of 1 that fixes its value (Dirichlet)."""
UNIT = 0.01
"""Metres in one unit of the internal distance: a centimetre; the patent names no unit."""
NOWHERE = 1e6
"""Distance in cells in a plane without marked cells, of which OpenCV 5 says the largest float."""
COARSE = 2
"""The internal distance is solved on cells this many times as large, then interpolated."""
NEGLIGIBLE = 6.0
"""Distance from strands, in `surface_reach`, from which S hardly counts: less than 0.003."""
SMOOTHNESS = 0.4
"""Weight of the diffusion of V against its data."""
SCALP_CELLS = 2.0
"""Distance from the head in cells at which the weight of grad(I) falls to 1/e."""


def surface_structure(cells: CellGraph, band: Band, tolerance: float) -> Float32Array:
    """Return S (N, 3) of the loose cells: the ribbons' tangents, spread by diffusion."""
    weight = np.where(band.on, FIXED, 0).astype(np.float32)
    if not weight.any():
        return band.direction
    return solve_screened(cells, band.direction, weight, 1.0, tolerance=tolerance)


def growth_direction(
    cells: CellGraph, band: Band, comb: ScalpComb, tolerance: float
) -> Float32Array:
    """Return O (N, 3) of the loose cells: ribbons and the scalp's comb, diffused as vectors."""
    data = band.direction.copy()
    free = comb.near & ~band.on
    data[free] = comb.direction[free[comb.near]]
    weight = np.where(band.on, FIXED, free).astype(np.float32)
    if not weight.any():
        return data
    return solve_screened(cells, data, weight, 1.0, tolerance=tolerance)


def internal_direction(
    cells: CellGraph, wanted: Float32Array, weight: Float32Array, band: Band, options: Options
) -> Float32Array:
    """Return V (N, 6) of the loose cells: `wanted` by `weight`, and ribbons, diffused."""
    on = band.on
    tangent = band.direction[on].astype(np.float64)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    data, total = wanted.copy(), weight.copy()
    total[on] += options.strand_weight
    share = (options.strand_weight / np.maximum(total[on], 1e-9))[:, None]
    data[on] = (1 - share) * wanted[on] + share * outer_products(tangent)
    return solve_screened(cells, data, total, SMOOTHNESS, tolerance=options.tolerance)


def internal_distance(
    hull: Hull, segments: Strands, tolerance: float, one_sided: bool = False
) -> Float32Array:
    """Return I (X, Y, Z): 0 in the head, 1 on strands, harmonic up to the grid's border.

    The border's value is 1 plus the distance to the nearest strand in `UNIT`. Solved on cells
    `COARSE` times as large. The hull's surface is 1, too, where photos are `one_sided`.
    """
    shape = tuple(-(-n // COARSE) for n in hull.grid.shape)
    strand = np.zeros(shape, bool)
    if len(segments):
        cells = hull.grid.nearest_cell(segments.points) // COARSE
        strand[tuple(cells.T)] = True
    if one_sided or not strand.any():
        strand |= _pool(hull.dense & ~erode_cells(hull.dense), shape)
    away = ndimage.distance_transform_edt(~strand) * (COARSE * hull.grid.spacing / UNIT)
    border = np.ones(shape, bool)
    border[1:-1, 1:-1, 1:-1] = False
    inside = _pool(hull.head_distance < 0, shape) & ~strand
    value = np.where(strand, 1.0, np.where(border, 1 + away, 0.0)).astype(np.float32)
    known = (strand | border | inside).ravel()
    weight = np.where(known, FIXED, 0).astype(np.float32)
    solved = solve_screened(
        CellGraph.of(np.ones(shape, bool)), value.reshape(-1, 1), weight, 1.0, tolerance=tolerance
    ).reshape(shape)
    for axis in range(3):
        solved = _refine(solved, axis)
    return np.ascontiguousarray(solved[tuple(slice(n) for n in hull.grid.shape)])


def _refine(values: Float32Array, axis: int) -> Float32Array:
    """Return values of `COARSE` times as many cells along an axis, interpolated linearly."""
    count = values.shape[axis]
    at = np.clip((np.arange(COARSE * count) + 0.5) / COARSE - 0.5, 0, count - 1)
    low = np.minimum(at.astype(int), max(count - 2, 0))
    share = (at - low).astype(np.float32).reshape(-1, *[1] * (values.ndim - 1 - axis))
    first = values.take(low, axis)
    result: Float32Array = first + share * (
        values.take(np.minimum(low + 1, count - 1), axis) - first
    )
    return result


def _pool(cells: BoolArray, shape: tuple[int, ...]) -> BoolArray:
    """Return which coarse cells hold at least one of `cells`."""
    padded = np.zeros(tuple(COARSE * n for n in shape), bool)
    padded[tuple(slice(n) for n in cells.shape)] = cells
    blocks = padded.reshape(shape[0], COARSE, shape[1], COARSE, shape[2], COARSE)
    return np.asarray(blocks.any(axis=(1, 3, 5)))


@dataclass(frozen=True, eq=False)
class Fields:
    """The four fields of the patent; all but the distance have a row for each loose cell."""

    surface: Float32Array
    """S, (N, 3)."""
    inner: Float32Array
    """V, (N, 6)."""
    distance: Float32Array
    """I, (X, Y, Z)."""
    growth: Float32Array
    """O, (N, 3)."""


def blend(hull: Hull, band: Band, fields: Fields, options: Options) -> Float32Array:
    """Return H (X, Y, Z, 3), 0 outside the loose hull.

    The weights differ from cell to cell: S counts on strands, V away from them, grad(I) at the
    scalp, O a little everywhere. V takes its sign from O.
    """
    spacing = hull.grid.spacing
    off = _distance_to(band.on, hull.loose, NEGLIGIBLE * options.surface_reach / spacing) * spacing
    main = smallest_eigenvectors(-fields.inner.astype(np.float64))[0]  # V's largest eigenvector
    main *= np.where((main * fields.growth).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    slope = cell_slopes(fields.distance, hull.loose)
    slope /= np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
    near_scalp = np.exp(-np.maximum(hull.head_distance[hull.loose], 0) / (SCALP_CELLS * spacing))
    a_s = options.surface * np.exp(-off / options.surface_reach)
    a_v = 1 - np.minimum(a_s, 1)
    a_i = options.outward * near_scalp
    mixed = a_s[:, None] * unit_vectors(fields.surface) + a_v[:, None] * main
    mixed += a_i[:, None] * slope + options.signed * unit_vectors(fields.growth)
    direction = np.zeros((*hull.grid.shape, 3), np.float32)
    direction[hull.loose] = unit_vectors(mixed)
    return read_only(direction)


def _distance_to(on: BoolArray, around: BoolArray, far: float) -> Float32Array:
    """Return the distance (N,) in cells of marked cells to the nearest of those that are `on` (N,).

    Exact up to `far`; larger ones are too large. By Saito and Toriwaki 1994, planes first, which is
    a sixth of `scipy.ndimage.distance_transform_edt`'s time.
    """
    box = tuple(slice(index.min(), index.max() + 1) for index in np.nonzero(around))
    off = np.ones(around.shape, np.uint8)
    off[around] = ~on
    square = np.stack(
        [cv2.distanceTransform(plane, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) for plane in off[box]]
    )
    np.minimum(square, NOWHERE, out=square)
    square *= square
    np.rint(square, out=square)  # whole numbers, whatever the rounding of the roots
    nearest = square.copy()
    for k in range(1, min(math.ceil(far) + 1, len(square))):
        np.minimum(nearest[k:], square[:-k] + np.float32(k * k), out=nearest[k:])
        np.minimum(nearest[:-k], square[k:] + np.float32(k * k), out=nearest[:-k])
    return np.asarray(np.sqrt(nearest[around[box]]), np.float32)
