"""3D orientation field: planes of all views fused by confidence, the rest of the hair filled by tensor diffusion.

A 2D orientation and the ray through its pixel span a plane that holds the strand; with plane normals N_i the
direction D minimises `sum w_i (N_i . D)^2` (Wei et al. 2005; thesis 5.3 with the weights the right way round).
Every view may speak about a cell, with a weight that falls with the cell's depth behind the first hair the view
sees ("see-through"). D D^T is diffused with its certainty (Paris et al. 2008; thesis 5.4); near the scalp, where
photos say nothing, a weak combing prior says how hair leaves the head. A potential that grows with the way
through the hair from the scalp settles later which end of a strand is the tip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit, prange
from scipy import ndimage

from hairkit import Hull, Mask, OrientationField, OrientationMap, Scene, hookimpl
from hairkit.combing import combing_direction
from hairkit.diffusion import solve_screened
from hairkit.options import option
from hairkit.projection import pack_cameras, project_row, splat_depth
from hairkit.stored import BoolArray, Float32Array, Float64Array
from hairkit.volume import outer_products, symmetric_matrices

DEPTH_SHRINK = 3
"""Depth maps of the hull are this much smaller than the pictures: cells are larger than pixels."""


@dataclass(frozen=True)
class Options:
    """Settings of fusion and diffusion."""

    see_through: float = option(
        0.02, low=0, high=0.2, unit="m", doc="Depth behind the first hair at which a view's weight falls to 1/e; 0 for visible cells only."
    )
    free_depth: float = option(
        0.006, low=0, high=0.05, unit="m", doc="Depth behind the first hair that costs no weight."
    )
    min_views: int = option(1, low=1, high=8, doc="Views a cell needs to be fused.")
    tangency: float = option(
        0.0, low=0, high=2, doc="Weight of the hull's tangent plane beside the views' planes."
    )
    smoothness: float = option(0.2, low=1e-4, high=100, doc="Weight of the diffusion.")
    scalp_weight: float = option(
        0.03, low=0, high=100, doc="Weight of the combing prior at the scalp; large values fix it."
    )
    scalp_reach: float = option(
        0.010, low=0, high=0.1, unit="m", doc="Distance from the scalp within which the prior acts."
    )
    scalp_lift: float = option(
        0.6, low=0, high=5, doc="Outward part of the prior against its tangential part."
    )
    tolerance: float = option(1e-3, low=1e-8, high=0.1, doc="Relative residual of the solver.")


@hookimpl
def solve_field(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    options: Options,
) -> OrientationField:
    """Fuse, add the scalp prior, diffuse over the loose hull, and measure the way from the scalp."""
    planes, views = _fuse(scene, masks, orientations, hull, options)
    tensor, certainty = _directions(planes, views, options)
    data, weight = _with_prior(scene, hull, tensor, certainty, options)
    solved = solve_screened(
        hull.loose, data, weight, options.smoothness, tolerance=options.tolerance
    )
    field = np.zeros((*hull.grid.shape, 6), np.float32)
    field[hull.loose] = solved
    confidence = np.zeros(hull.grid.shape, np.float32)
    confidence[hull.loose] = np.clip(weight, 0, 1)
    return OrientationField(hull.grid, field, confidence, scalp_way(scene, hull))


def _fuse(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    options: Options,
) -> tuple[Float64Array, npt.NDArray[np.int64]]:
    """Return `sum w N N^T` (N, 6) of every loose cell and the number of views that spoke (N,)."""
    points = hull.grid.centres()[hull.loose]
    inner = hull.dense[hull.loose]
    surface = hull.grid.centres()[hull.dense & ~ndimage.binary_erosion(hull.dense)]
    planes = np.zeros((len(points), 6))
    count = np.zeros(len(points), np.int64)
    for row, mask, found in zip(pack_cameras(scene.cameras), masks, orientations, strict=True):
        height, width = found.angle.shape
        front = np.full((height // DEPTH_SHRINK, width // DEPTH_SHRINK), np.inf, np.float32)
        splat_depth(row, surface, 0.75 * hull.grid.spacing, front)
        certainty = found.confidence * mask.hair
        _add_planes(
            row, points, inner, found.angle, certainty, front,
            options.see_through, options.free_depth, planes, count,
        )
    return planes, count


@njit(cache=True, parallel=True)  # type: ignore[untyped-decorator]
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
    values, vectors = np.linalg.eigh(symmetric_matrices(planes[rows]))
    tensor[rows] = outer_products(vectors[:, :, 0])
    certainty[rows] = values[:, 1] - values[:, 0]
    return tensor, certainty


def _with_prior(
    scene: Scene, hull: Hull, tensor: Float32Array, certainty: Float32Array, options: Options
) -> tuple[Float32Array, Float32Array]:
    """Return wanted tensors and weights after adding the combing prior near the scalp."""
    distance = hull.head_distance[hull.loose]
    near = distance < options.scalp_reach
    if not options.scalp_weight or not near.any():
        return tensor, certainty
    points = hull.grid.centres()[hull.loose][near]
    normals = distance_gradient(hull, points)
    comb = combing_direction(scene.head, points, normals, options.scalp_lift)
    data, weight = tensor.copy(), certainty.copy()
    weight[near] += options.scalp_weight
    share = (options.scalp_weight / weight[near])[:, None]
    data[near] = (1 - share) * tensor[near] + share * outer_products(comb)
    return data, weight


def distance_gradient(hull: Hull, points: npt.ArrayLike) -> Float64Array:
    """Return the unit gradient (N, 3) of the head's distance at points (N, 3): away from the head."""
    at = np.asarray(points, np.float64)
    h = hull.grid.spacing
    gradient = np.stack(
        [
            hull.grid.sample(hull.head_distance, at + h * axis)
            - hull.grid.sample(hull.head_distance, at - h * axis)
            for axis in np.eye(3)
        ],
        axis=1,
    ).astype(np.float64)
    result: Float64Array = gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-9)
    return result


def scalp_way(scene: Scene, hull: Hull) -> Float32Array:
    """Return (X, Y, Z) the shortest way from the scalp through loose cells, metres; 0 outside them.

    Sweeps of the chamfer distance in alternating orders (Borgefors 1986) until nothing changes.
    """
    start = np.zeros(hull.grid.shape, bool)
    cells = hull.grid.nearest_cell(scene.head.vertices[scene.head.scalp > 0.5])
    start[tuple(cells.T)] = True
    start = ndimage.binary_dilation(start, iterations=2)
    way = _chamfer(hull.loose, start & hull.loose, np.float32(hull.grid.spacing))
    return np.where(np.isfinite(way), way, 0).astype(np.float32)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _chamfer(occupied, start, spacing):  # type: ignore[no-untyped-def]
    nx, ny, nz = occupied.shape
    way = np.full(occupied.shape, np.inf, np.float32)
    for ix in range(nx):
        for iy in range(ny):
            for iz in range(nz):
                if start[ix, iy, iz]:
                    way[ix, iy, iz] = 0
    for _ in range(12):
        changed = False
        for turn in range(8):
            sx = 1 if turn & 1 else -1
            sy = 1 if turn & 2 else -1
            sz = 1 if turn & 4 else -1
            for kx in range(nx):
                ix = kx if sx > 0 else nx - 1 - kx
                for ky in range(ny):
                    iy = ky if sy > 0 else ny - 1 - ky
                    for kz in range(nz):
                        iz = kz if sz > 0 else nz - 1 - kz
                        if not occupied[ix, iy, iz]:
                            continue
                        best = way[ix, iy, iz]
                        for corner in range(1, 8):
                            jx = ix - sx * (corner & 1)
                            jy = iy - sy * (corner >> 1 & 1)
                            jz = iz - sz * (corner >> 2 & 1)
                            if jx < 0 or jy < 0 or jz < 0 or jx >= nx or jy >= ny or jz >= nz:
                                continue
                            if occupied[jx, jy, jz]:
                                steps = (corner & 1) + (corner >> 1 & 1) + (corner >> 2 & 1)
                                best = min(best, way[jx, jy, jz] + spacing * np.sqrt(np.float32(steps)))
                        if best < way[ix, iy, iz] - 1e-7:
                            way[ix, iy, iz] = best
                            changed = True
        if not changed:
            break
    return way
