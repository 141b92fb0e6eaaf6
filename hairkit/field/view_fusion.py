"""2D orientations of all views fused into 3D: planes of view rays and strands, intersected.

A 2D orientation and the ray through its pixel span a plane that holds the strand; with plane
normals N_i the direction D minimises `sum w_i (N_i . D)^2` (Wei et al. 2005; thesis 5.3 with the
weights the right way round). Every view may speak about a cell, with a weight that falls with the
cell's depth behind the first hair the view sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from scipy import ndimage

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.cameras.projection_kernels import pack_cameras, project_row, splat_depth
from hairkit.field.symmetric_eigen import smallest_eigenvectors
from hairkit.imaging.waves import Waves, measure_waves, without_slant
from hairkit.options import option
from hairkit.types.camera import Camera
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.volume import Hull, outer_products

DEPTH_SHRINK = 3
"""Depth maps of the hull are this much smaller than the pictures: cells are larger than pixels."""
POOL_CELLS = 2
"""Planes are pooled on cells this many times as large."""


@dataclass(frozen=True)
class FusionOptions:
    """Options of every field method that fuses views; plugins inherit them."""

    see_through: float = option(
        0.02,
        low=0,
        high=0.2,
        unit="m",
        doc="Depth behind the first hair at which a view's weight falls to 1/e; 0: visible only.",
    )
    free_depth: float = option(
        0.006, low=0, high=0.05, unit="m", doc="Depth behind the first hair that costs no weight."
    )
    unslant: bool = option(
        True, doc="Take off the slant that the near halves of waves show in every view."
    )
    pool: float = option(
        0.15,
        low=0,
        high=1,
        doc="Gaussian, as a share of the waves' pitch, over which planes of wavy hair are pooled.",
    )


@dataclass(frozen=True, eq=False)
class FusedViews:
    """What all views say together."""

    orientations: tuple[OrientationMap, ...]
    """The maps, the waves' slant taken off where it was asked for."""
    tensor: Float32Array
    """(N, 6) D D^T of every loose cell."""
    certainty: Float32Array
    """(N,) gap between the two smallest eigenvalues of the planes."""


def fuse_views(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    hull: Hull,
    options: FusionOptions,
    min_views: int = 1,
) -> FusedViews:
    """Return the directions of all loose cells, waves measured and taken into account."""
    wavy = options.unslant or options.pool > 0
    waves = measure_waves(orientations, masks, cameras) if wavy else Waves()
    maps = tuple(orientations)
    if options.unslant:
        maps = tuple(without_slant(found, waves) for found in orientations)
    planes, views = fuse_planes(cameras, masks, maps, hull, options.see_through, options.free_depth)
    planes = pooled_planes(planes, hull, options.pool * waves.pitch)
    return FusedViews(maps, *plane_directions(planes, views, min_views))


def fuse_planes(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    hull: Hull,
    see_through: float,
    free_depth: float,
) -> tuple[Float64Array, Int64Array]:
    """Return `sum w N N^T` (N, 6) of every loose cell and the number of views that spoke (N,).

    Parameters
    ----------
    see_through
        Depth in metres behind the first hair at which a view's weight falls to 1/e; 0: only what
        it sees.
    free_depth
        Depth in metres behind the first hair that costs no weight.
    """
    points = hull.grid.centres_of(hull.loose)
    inner = hull.dense[hull.loose]
    planes = np.zeros((len(points), 6))
    count = np.zeros(len(points), np.int64)
    fronts = front_depths(cameras, orientations, hull)
    for row, mask, found, front in zip(
        pack_cameras(cameras), masks, orientations, fronts, strict=True
    ):
        certainty = found.confidence * mask.hair
        _add_planes(
            row,
            points,
            inner,
            found.angle,
            certainty,
            front,
            see_through,
            free_depth,
            planes,
            count,
        )
    return planes, count


def front_depths(
    cameras: Sequence[Camera], orientations: Sequence[OrientationMap], hull: Hull
) -> list[Float32Array]:
    """Return for each view the axial depth of the first dense cell, infinite where none is.

    The maps are `DEPTH_SHRINK` times smaller than the views' orientation maps.
    """
    surface = hull.grid.centres_of(hull.dense & ~ndimage.binary_erosion(hull.dense))
    fronts = []
    for row, found in zip(pack_cameras(cameras), orientations, strict=True):
        height, width = found.angle.shape
        front = np.full((height // DEPTH_SHRINK, width // DEPTH_SHRINK), np.inf, np.float32)
        splat_depth(row, surface, 0.75 * hull.grid.spacing, front)
        fronts.append(front)
    return fronts


def pooled_planes(planes: Float64Array, hull: Hull, sigma: float) -> Float64Array:
    """Return the planes (N, 6) averaged over a Gaussian neighbourhood of `sigma` metres.

    Planes of two views 45 degrees apart amplify disagreement into depth, and strands that wave out
    of step disagree. Pooled before they are intersected, their angles average; afterwards the
    amplified error would.
    """
    if sigma <= 0:
        return planes
    shape = tuple(-(-n // POOL_CELLS) for n in hull.grid.shape)
    block = tuple(index // POOL_CELLS for index in np.nonzero(hull.loose))
    flat = np.ravel_multi_index(block, shape)
    result = np.empty_like(planes)
    for component in range(6):
        total = np.bincount(flat, planes[:, component], int(np.prod(shape))).reshape(shape)
        smooth = ndimage.gaussian_filter(total, sigma / (POOL_CELLS * hull.grid.spacing))
        result[:, component] = smooth.ravel()[flat] / POOL_CELLS**3
    return result


@njit(cache=True, parallel=True)
def _add_planes(  # type: ignore[no-untyped-def]
    row, points, inner, angle, certainty, front, see_through, free_depth, planes, count
):
    height, width = angle.shape
    scale = front.shape[0] / row[19]
    for i in prange(len(points)):
        if not inner[i]:
            continue
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        u, v, depth = project_row(row, x, y, z)
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        weight = certainty[int(v), int(u)]
        if weight <= 0:
            continue
        line = min(int(v * scale), front.shape[0] - 1)
        column = min(int(u * scale), front.shape[1] - 1)
        behind = depth - front[line, column] - free_depth
        if behind > 0:
            if see_through <= 0:
                continue
            weight *= np.exp(-behind / see_through)
            if weight < 1e-4:
                continue
        # the strand's direction in the picture, turned into the head frame, and the ray to the cell
        c, s = np.cos(angle[int(v), int(u)]), np.sin(angle[int(v), int(u)])
        dx, dy, dz = c * row[0] + s * row[3], c * row[1] + s * row[4], c * row[2] + s * row[5]
        if row[15] > 0.5:
            rx, ry, rz = row[6], row[7], row[8]
        else:
            rx, ry, rz = x - row[16], y - row[17], z - row[18]
        nx, ny, nz = ry * dz - rz * dy, rz * dx - rx * dz, rx * dy - ry * dx
        norm = nx * nx + ny * ny + nz * nz
        planes[i, 0] += weight * nx * nx / norm
        planes[i, 1] += weight * ny * ny / norm
        planes[i, 2] += weight * nz * nz / norm
        planes[i, 3] += weight * nx * ny / norm
        planes[i, 4] += weight * nx * nz / norm
        planes[i, 5] += weight * ny * nz / norm
        count[i] += 1


def plane_directions(
    planes: Float64Array, views: Int64Array, min_views: int
) -> tuple[Float32Array, Float32Array]:
    """Return D D^T (N, 6) of the smallest eigenvector and its certainty (N,).

    Certainty is the gap between the two smallest eigenvalues: 0 when all views share one plane;
    cells that fewer than `min_views` views speak about have none.
    """
    tensor = np.zeros(planes.shape, np.float32)
    certainty = np.zeros(len(planes), np.float32)
    rows = np.flatnonzero(views >= min_views)
    direction, gap = smallest_eigenvectors(planes[rows])
    tensor[rows] = outer_products(direction)
    certainty[rows] = gap
    return tensor, certainty
