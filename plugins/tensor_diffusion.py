"""3D orientation field: planes of all views fused by confidence, the rest filled by diffusion.

A 2D orientation and the ray through its pixel span a plane that holds the strand; with plane
normals N_i the direction D minimises `sum w_i (N_i . D)^2` (Wei et al. 2005; thesis 5.3 with the
weights the right way round). Every view may speak about a cell, with a weight that falls with the
cell's depth behind the first hair the view sees ("see-through"). D D^T is diffused with its
certainty (Paris et al. 2008; thesis 5.4); near the scalp, where photos say nothing, a weak combing
prior says how hair leaves the head. A potential that grows with the way through the hair from the
scalp settles later which end of a strand is the tip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit, prange
from scipy import ndimage

from hairkit import Hull, Mask, OrientationField, OrientationMap, Scene, hookimpl
from hairkit.combing import combing_direction, gradient, growth_potential
from hairkit.diffusion import solve_screened
from hairkit.eigen import smallest_eigenvectors
from hairkit.options import option
from hairkit.projection import pack_cameras, project_row, splat_depth
from hairkit.stored import Float32Array, Float64Array
from hairkit.volume import outer_products
from hairkit.waves import Waves, measure_waves, without_slant

DEPTH_SHRINK = 3
"""Depth maps of the hull are this much smaller than the pictures: cells are larger than pixels."""

POOL_CELLS = 2
"""Planes are pooled on cells this many times as large."""
HARD_WEIGHT = 1e3
"""Weight against `smoothness` that keeps a cell as it is."""


@dataclass(frozen=True)
class Options:
    """Settings of fusion and diffusion."""

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
    min_views: int = option(1, low=1, high=8, doc="Views a cell needs to be fused.")
    unslant: bool = option(
        True, doc="Take off the slant that the near halves of waves show in every view."
    )
    pool: float = option(
        0.15,
        low=0,
        high=1,
        doc="Gaussian, as a share of the waves' pitch, over which planes of wavy hair are pooled.",
    )
    smoothness: float = option(0.4, low=1e-4, high=100, doc="Weight of the diffusion.")
    scalp_weight: float = option(
        0.1, low=0, high=100, doc="Weight of the combing prior at the scalp; large values fix it."
    )
    scalp_reach: float = option(
        0.02, low=0, high=0.1, unit="m", doc="Distance from the scalp within which the prior acts."
    )
    scalp: str = option(
        "combed", choices=("combed", "normal"), doc="Direction at the scalp: combed, or its normal."
    )
    hard: bool = option(False, doc="Keep fused cells and the scalp as they are (Dirichlet).")
    scalp_lift: float = option(
        0.6, low=0, high=5, doc="Outward part of the prior against its tangential part."
    )
    tip_share: float = option(
        0.6,
        low=0.05,
        high=1,
        doc="Cells this far along the longest way from the scalp count as tips.",
    )
    tolerance: float = option(2e-2, low=1e-8, high=0.1, doc="Relative residual of the solver.")


@hookimpl
def solve_field(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    options: Options,
) -> OrientationField:
    """Fuse, add the scalp prior, diffuse over the loose hull, and measure the way from the
    scalp."""
    wavy = options.unslant or options.pool > 0
    waves = measure_waves(orientations, masks, scene.cameras) if wavy else Waves()
    if options.unslant:
        orientations = tuple(without_slant(found, waves) for found in orientations)
    growth = growth_potential(scene.head, hull, options.tip_share)
    planes, views = _fuse(scene, masks, orientations, hull, options)
    planes = _pooled(planes, hull, options.pool * waves.pitch)
    tensor, certainty = _directions(planes, views, options)
    data, weight = _with_prior(scene, hull, growth, tensor, certainty, options)
    if options.hard:
        weight = np.where(weight > 0, HARD_WEIGHT, 0).astype(np.float32)
    solved = solve_screened(
        hull.loose, data, weight, options.smoothness, tolerance=options.tolerance
    )
    field = np.zeros((*hull.grid.shape, 6), np.float32)
    field[hull.loose] = solved
    confidence = np.zeros(hull.grid.shape, np.float32)
    confidence[hull.loose] = np.clip(weight, 0, 1)
    return OrientationField(hull.grid, field, confidence, growth)


def _fuse(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    options: Options,
) -> tuple[Float64Array, npt.NDArray[np.int64]]:
    """Return `sum w N N^T` (N, 6) of every loose cell and the number of views that spoke (N,)."""
    points = hull.grid.centres_of(hull.loose)
    inner = hull.dense[hull.loose]
    surface = hull.grid.centres_of(hull.dense & ~ndimage.binary_erosion(hull.dense))
    planes = np.zeros((len(points), 6))
    count = np.zeros(len(points), np.int64)
    for row, mask, found in zip(pack_cameras(scene.cameras), masks, orientations, strict=True):
        height, width = found.angle.shape
        front = np.full((height // DEPTH_SHRINK, width // DEPTH_SHRINK), np.inf, np.float32)
        splat_depth(row, surface, 0.75 * hull.grid.spacing, front)
        certainty = found.confidence * mask.hair
        _add_planes(
            row,
            points,
            inner,
            found.angle,
            certainty,
            front,
            options.see_through,
            options.free_depth,
            planes,
            count,
        )
    return planes, count


def _pooled(planes: Float64Array, hull: Hull, sigma: float) -> Float64Array:
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


def _directions(
    planes: Float64Array, views: npt.NDArray[np.int64], options: Options
) -> tuple[Float32Array, Float32Array]:
    """Return D D^T (N, 6) of the smallest eigenvector and its certainty (N,).

    Certainty is the gap between the two smallest eigenvalues: 0 when all views share one plane.
    """
    tensor = np.zeros(planes.shape, np.float32)
    certainty = np.zeros(len(planes), np.float32)
    rows = np.flatnonzero(views >= options.min_views)
    direction, gap = smallest_eigenvectors(planes[rows])
    tensor[rows] = outer_products(direction)
    certainty[rows] = gap
    return tensor, certainty


def _with_prior(
    scene: Scene,
    hull: Hull,
    growth: Float32Array,
    tensor: Float32Array,
    certainty: Float32Array,
    options: Options,
) -> tuple[Float32Array, Float32Array]:
    """Return wanted tensors and weights after adding the combing prior near the scalp."""
    distance = hull.head_distance[hull.loose]
    near = distance < options.scalp_reach
    if not options.scalp_weight or not near.any():
        return tensor, certainty
    points = hull.grid.centres_of(hull.loose)[near]
    if options.scalp == "normal":
        comb = gradient(hull.grid, hull.head_distance, points)
    else:
        comb = combing_direction(scene.head, hull, growth, points, options.scalp_lift)
    data, weight = tensor.copy(), certainty.copy()
    weight[near] += options.scalp_weight
    share = (options.scalp_weight / weight[near])[:, None]
    data[near] = (1 - share) * tensor[near] + share * outer_products(comb)
    return data, weight
