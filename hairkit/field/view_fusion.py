"""2D orientations of all views fused into 3D: planes of view rays and strands, intersected.

A 2D orientation and the ray through its pixel span a plane that holds the strand; with plane
normals N_i the direction D minimises `sum w_i (N_i . D)^2` (Wei et al. 2005; thesis 5.3 with the
weights the right way round). Every view contributes to a cell, with a weight that falls with the
cell's depth behind the first hair the view sees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.cameras.depth_raster import SPLAT_CELLS, splat_depth
from hairkit.cameras.projection_kernels import PackedCamera, Vector, pack_camera, project
from hairkit.field.cell_shells import dense_surface
from hairkit.field.symmetric_eigen import smallest_eigenvectors
from hairkit.field.unseen import add_surface_planes
from hairkit.imaging.waves import remove_slant
from hairkit.options import option
from hairkit.parallel import compiled, compiled_with, parallel_for
from hairkit.types.camera import Camera
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.volume import XX, XY, XZ, YY, YZ, ZZ, Hull, outer_products
from hairkit.types.waves import Waves

DEPTH_SHRINK = 3
"""Depth maps of the hull are this much smaller than the pictures: cells are larger than pixels."""
POOL_CELLS = 2
"""Planes are pooled on cells this many times as large."""
LEAST_WEIGHT = 1e-4
"""Views whose weight fades below this do not contribute to a cell."""
MIN_CELLS = 4096
"""Least number of cells that are worth another thread."""


@dataclass(frozen=True)
class FusionOptions:
    """Options of every field method that fuses views; plugins inherit them."""

    see_through: float = option(
        0.02, low=0, high=0.2, unit="m", doc="Depth at which a view's weight is 1/e; 0: front only."
    )
    free_depth: float = option(
        0.006, low=0, high=0.05, unit="m", doc="Depth behind the first hair that costs no weight."
    )
    unslant: bool = option(
        True, doc="Take off the slant that the near halves of waves show in every view."
    )
    pool: float = option(
        0.15, low=0, high=1, doc="Gaussian over which planes of waves are pooled, in pitches."
    )


@dataclass(frozen=True, eq=False)
class FusedViews:
    """Orientations of all views, fused."""

    orientations: tuple[OrientationMap, ...]
    """The maps, corrected for the slant of waves if enabled."""
    fronts: tuple[Float32Array, ...]
    """(h, w) of each view, see `front_depths`."""
    tensor: Float32Array
    """(N, 6) D D^T of every loose cell."""
    certainty: Float32Array
    """(N,) gap between the two smallest eigenvalues of the planes."""


def fuse_views(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    hull: Hull,
    waves: Waves,
    options: FusionOptions,
    min_views: int = 1,
    surface: float = 0.0,
) -> FusedViews:
    """Return the directions of all loose cells, waves measured and taken into account.

    Photos of one side leave the slope in depth to the hull's surface, by a share in [0, 1].
    """
    maps = tuple(orientations)
    if options.unslant:
        maps = tuple(remove_slant(found, waves) for found in orientations)
    fronts = front_depths(cameras, maps, hull)
    fading = Fading(float(options.see_through), float(options.free_depth))
    planes, views = fuse_planes(cameras, masks, maps, fronts, hull, fading)
    planes = pool_planes(planes, hull, options.pool * waves.pitch)
    if surface > 0:
        planes = add_surface_planes(planes, hull, surface)
    return FusedViews(maps, fronts, *plane_directions(planes, views, min_views))


def fuse_planes(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    fronts: Sequence[Float32Array],
    hull: Hull,
    fading: Fading,
) -> tuple[Float64Array, Int64Array]:
    """Return `sum w N N^T` (N, 6) of every loose cell and the number of contributing views (N,).

    `fronts` are the views' `front_depths`.
    """
    cells = LooseCells(hull.grid.centres_of(hull.loose), hull.dense[hull.loose])
    planes = np.zeros((len(cells.points), 6))
    count = np.zeros(len(cells.points), np.int64)
    for camera, mask, found, front in zip(cameras, masks, orientations, fronts, strict=True):
        view = OrientedView(pack_camera(camera), found.angle, found.confidence * mask.hair, front)
        parallel_for(
            add_planes, len(planes), view, fading, cells, planes, count, min_chunk=MIN_CELLS
        )
    return planes, count


def front_depths(
    cameras: Sequence[Camera], orientations: Sequence[OrientationMap], hull: Hull
) -> tuple[Float32Array, ...]:
    """Return for each view the axial depth of the first dense cell, infinite where none is.

    The maps are `DEPTH_SHRINK` times smaller than the views' orientation maps.
    """
    surface = dense_surface(hull)
    fronts = []
    for camera, found in zip(cameras, orientations, strict=True):
        height, width = found.angle.shape
        front = np.full((height // DEPTH_SHRINK, width // DEPTH_SHRINK), np.inf, np.float32)
        splat_depth(pack_camera(camera), surface, SPLAT_CELLS * hull.grid.spacing, front)
        fronts.append(front)
    return tuple(fronts)


def pool_planes(planes: Float64Array, hull: Hull, sigma: float) -> Float64Array:
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


class OrientedView(NamedTuple):
    """One view's evidence for the direction of hair."""

    camera: PackedCamera
    angle: Float32Array
    """(H, W) 2D orientation, radians."""
    certainty: Float32Array
    """(H, W) its weight, 0 where the view sees no hair."""
    front: Float32Array
    """(h, w) depth of the first hair, metres; see `front_depths`."""


class Fading(NamedTuple):
    """Decay length of a view's weight behind the first hair that it sees, metres."""

    see_through: float
    """Depth at which the weight falls to 1/e; 0: nothing behind counts."""
    free_depth: float
    """Depth that costs no weight."""


class LooseCells(NamedTuple):
    """The cells whose direction is wanted."""

    points: Float32Array
    """(N, 3) centres, metres."""
    dense: BoolArray
    """(N,) cells in the dense hull; views contribute to no others."""


@compiled
def add_planes(
    first: int,
    last: int,
    view: OrientedView,
    fading: Fading,
    cells: LooseCells,
    planes: Float64Array,
    count: Int64Array,
) -> None:
    """Add a view's `w N N^T` to planes (N, 6) and 1 to count (N,), for cells `first` to `last`."""
    height, width = view.angle.shape
    for i in range(first, last):
        if not cells.dense[i]:
            continue
        x, y, z = cells.points[i, 0], cells.points[i, 1], cells.points[i, 2]
        u, v, depth = project(view.camera, x, y, z)
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        weight = _plane_weight(view, fading, u, v, depth)
        if weight <= 0:
            continue
        nx, ny, nz = _plane_normal(view.camera, view.angle[int(v), int(u)], x, y, z)
        norm = nx * nx + ny * ny + nz * nz
        planes[i, XX] += weight * nx * nx / norm
        planes[i, YY] += weight * ny * ny / norm
        planes[i, ZZ] += weight * nz * nz / norm
        planes[i, XY] += weight * nx * ny / norm
        planes[i, XZ] += weight * nx * nz / norm
        planes[i, YZ] += weight * ny * nz / norm
        count[i] += 1


@compiled_with(inside=True)
def _plane_weight(view: OrientedView, fading: Fading, u: float, v: float, depth: float) -> float:
    """Return the weight of the view at pixel u, v for a cell at an axial depth."""
    weight = float(view.certainty[int(v), int(u)])
    if weight <= 0:
        return 0.0
    scale = view.front.shape[0] / view.camera.height
    line = min(int(v * scale), view.front.shape[0] - 1)
    column = min(int(u * scale), view.front.shape[1] - 1)
    behind = depth - view.front[line, column] - fading.free_depth
    if behind <= 0:
        return weight
    if fading.see_through <= 0:
        return 0.0
    weight *= math.exp(-behind / fading.see_through)
    return weight if weight >= LEAST_WEIGHT else 0.0


@compiled_with(inside=True)
def _plane_normal(camera: PackedCamera, angle: float, x: float, y: float, z: float) -> Vector:
    """Return the normal of the plane of the viewing ray and the strand that it meets at x, y, z."""
    right, down, forward = camera.right, camera.down, camera.forward
    c, s = np.cos(angle), np.sin(angle)
    dx, dy, dz = c * right[0] + s * down[0], c * right[1] + s * down[1], c * right[2] + s * down[2]
    if camera.orthographic:
        rx, ry, rz = forward
    else:
        rx, ry, rz = x - camera.position[0], y - camera.position[1], z - camera.position[2]
    return ry * dz - rz * dy, rz * dx - rx * dz, rx * dy - ry * dx


def plane_directions(
    planes: Float64Array, views: Int64Array, min_views: int
) -> tuple[Float32Array, Float32Array]:
    """Return D D^T (N, 6) of the smallest eigenvector and its certainty (N,).

    Certainty is the gap between the two smallest eigenvalues: 0 when all views share one plane;
    cells to which fewer than `min_views` views contribute have none.
    """
    tensor = np.zeros(planes.shape, np.float32)
    certainty = np.zeros(len(planes), np.float32)
    rows = np.flatnonzero(views >= min_views)
    direction, gap = smallest_eigenvectors(planes[rows])
    tensor[rows] = outer_products(direction)
    certainty[rows] = gap
    return tensor, certainty
