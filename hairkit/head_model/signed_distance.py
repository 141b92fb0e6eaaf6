"""Signed distance to a head: on a grid for carving and tracking, or at single points.

Head meshes are often open at the neck, the eyes and the mouth. Every hole is closed with a fan
first. A point is then inside if lines through it along at least two of the three axes have a sum of
signed crossings other than 0 there, which holds for overlapping parts and for inward normals too.
"""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt, label
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.head_model.bvh import TriangleTree, build_tree, inside_surface, nearest_on_surface
from hairkit.types.head import Head
from hairkit.types.preview import Surface
from hairkit.types.volume import VoxelGrid

BAND = 0.006
"""Metres from the surface up to which cells of a grid have exact distances."""
CROSSED = 2.0
"""Cells from a cell that holds surface: neighbours beyond are on one side of it."""


def signed_distance(head: Surface, grid: VoxelGrid) -> Float32Array:
    """Return the signed distance to the head at the cell centres, (X, Y, Z), metres, inside < 0.

    Up to `BAND` from the surface it is exact. Beyond it is the distance to the point of the surface
    that is nearest to the nearest cell within, too large by 0.05 cells on average, at most one.
    """
    vertices, faces = closed_surface(head)
    tree, free = build_tree(vertices, faces), _without_surface(vertices[faces], grid)
    if free.all():
        distance = _distances(tree, grid.centres().reshape(-1, 3)).astype(np.float32)
        return distance.reshape(grid.shape)
    near = _within(~free, (BAND / grid.spacing + CROSSED) ** 2)
    face, weights, exact = nearest_on_surface(tree, grid.centres_of(near))
    feet = np.einsum("nk,nkd->nd", weights, vertices[faces[face]])
    foot, beyond = np.zeros(grid.shape, np.int32), np.ones(grid.shape, np.bool_)
    foot[near], beyond[near] = np.arange(len(feet)), exact > BAND
    nearest = distance_transform_edt(beyond, return_distances=False, return_indices=True)
    distance = _distances_to(feet, foot[tuple(nearest)], grid)
    distance[near] = np.minimum(distance[near], exact)
    inside = _inside(tree, grid, _within(~free, CROSSED**2 + 1))
    np.negative(distance, out=distance, where=inside)
    return distance


def _within(cells: BoolArray, squared: float) -> BoolArray:
    """Return (X, Y, Z) the cells whose steps to one of `cells`, squared, are less than a number."""
    reach, (depth, height, _) = math.isqrt(math.ceil(squared) - 1), cells.shape
    room = np.pad(cells, ((reach, reach), (0, reach), (0, 0))).astype(np.uint8)
    steps = np.square(np.arange(-reach, reach + 1))
    found = np.zeros(cells.shape, np.bool_)
    for step in range(reach + 1):  # a ball is discs, and all layers of the volume are one picture
        disc = (steps[:, None] + steps < squared - step**2).astype(np.uint8)
        wide = cv2.dilate(room.reshape(-1, room.shape[2]), disc).reshape(room.shape) > 0
        for first in (reach - step, reach + step):
            found |= wide[first : first + depth, :height]
    return found


def _distances_to(feet: Float64Array, foot: Int32Array, grid: VoxelGrid) -> Float32Array:
    """Return (X, Y, Z) the distance of each cell's centre to its foot among `feet` (N, 3)."""
    distance = np.empty(grid.shape, np.float32)
    across, up, ahead = grid.axes()
    for layer, x in enumerate(across):
        apart = feet[foot[layer]] - np.stack(np.broadcast_arrays(x, up[:, None], ahead), axis=-1)
        distance[layer] = np.sqrt(np.einsum("yzd,yzd->yz", apart, apart))
    return distance


def distance_to(head: Head, points: npt.ArrayLike) -> Float64Array:
    """Return the exact signed distance (N,) of points (N, 3) to the head, metres, inside < 0."""
    return _distances(_closed_tree(head), points)


def _distances(tree: TriangleTree, points: npt.ArrayLike) -> Float64Array:
    distance = nearest_on_surface(tree, points)[2]
    np.negative(distance, out=distance, where=inside_surface(tree, points))
    return distance


def closed_surface(head: Surface) -> tuple[Float64Array, Int32Array]:
    """Return the head's vertices (V', 3) and faces (F', 3) with every hole closed by a fan.

    Vertices that texture seams repeat are merged first. Each connected run of boundary edges then
    gets a fan to its mean, wound like the mesh around it.
    """
    vertices, faces = head.vertices.astype(np.float64), head.faces
    start, end = _border(faces, len(vertices))
    if not len(start):
        return vertices, faces
    vertices, same = np.unique(vertices, axis=0, return_inverse=True)
    faces = same.reshape(-1).astype(np.int32)[faces]
    count = len(vertices)
    start, end = _border(faces, count)
    if not len(start):
        return vertices, faces
    graph = coo_matrix((np.ones(len(start)), (start, end)), shape=(count, count))
    part = np.unique(connected_components(graph, directed=False)[1][start], return_inverse=True)[1]
    total = np.bincount(part)[:, None]
    middle = np.stack([np.bincount(part, vertices[start, k]) for k in range(3)], axis=1) / total
    fans = np.stack([end, start, count + part.reshape(-1)], axis=1).astype(np.int32)
    return np.concatenate([vertices, middle]), np.concatenate([faces, fans])


def _border(faces: Int32Array, count: int) -> tuple[Int64Array, Int64Array]:
    """Return starts and ends of the directed edges that no other face has in reverse."""
    start = faces.ravel().astype(np.int64)
    end = faces[:, [1, 2, 0]].ravel().astype(np.int64)
    border = ~np.isin(start * count + end, end * count + start)
    return start[border], end[border]


@lru_cache(maxsize=2)
def _closed_tree(head: Head) -> TriangleTree:
    return build_tree(*closed_surface(head))


def _without_surface(corners: Float64Array, grid: VoxelGrid) -> BoolArray:
    """Return (X, Y, Z) False for cells that hold points of triangles (F, 3, 3), a cell apart.

    Triangles are cut into four as long as they are larger than a cell.
    """
    free = np.ones(grid.shape, np.bool_)
    places = (corners - grid.origin) / grid.spacing
    while len(places):
        here = (places.max(axis=1) >= 0) & (places.min(axis=1) < grid.shape)
        places = places[here.all(axis=1)]
        at = np.floor(places.reshape(-1, 3)).astype(np.int64)
        free[tuple(at[((at >= 0) & (at < grid.shape)).all(axis=1)].T)] = False
        edges = np.linalg.norm(places - np.roll(places, 1, axis=1), axis=2)
        large = places[edges.max(axis=1) > 1]
        middles = 0.5 * (large + np.roll(large, -1, axis=1))
        outer = [[large[:, k], middles[:, k], middles[:, k - 1]] for k in range(3)]
        places = np.concatenate([middles, *(np.stack(part, axis=1) for part in outer)])
    return free


def _inside(tree: TriangleTree, grid: VoxelGrid, near: BoolArray) -> BoolArray:
    """Return (X, Y, Z) which cells are inside: one by one where near, the others part by part."""
    inside = np.zeros(near.shape, np.bool_)
    inside[near] = inside_surface(tree, grid.centres_of(near))
    part, count = label(~near)
    some = np.zeros(count + 1, np.int32)
    some[part.ravel()] = np.arange(part.size, dtype=np.int32)  # a cell of each part
    cells = zip(grid.axes(), np.unravel_index(some, near.shape), strict=True)
    at = [axis[cell] for axis, cell in cells]
    inside[~near] = inside_surface(tree, np.stack(at, axis=1))[part[~near]]
    return inside
