"""Signed distance to a head: on a grid for carving and tracking, or at single points.

Heads of the world are open at the neck, the eyes and the mouth. Every hole is closed with a fan
first; a place is then inside where lines through it along two of the three axes say so, by the sum
of the signed crossings, which neither overlapping parts nor inward normals upset.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.head_model.bvh import (
    TriangleTree,
    build_tree,
    inside_surface,
    line_crossing,
    nearest_on_surface,
    triangle_distance,
)
from hairkit.types.head import Head
from hairkit.types.volume import VoxelGrid

_FAR = 1e30


def signed_distance(head: Head, grid: VoxelGrid, band: float | None = None) -> Float32Array:
    """Return the signed distance to the head at the cell centres, (X, Y, Z), metres, inside < 0.

    Cells at the surface find their nearest triangle; every cell inherits one of the points found
    there by a separable transform (after Felzenszwalb and Huttenlocher 2012, with points in place
    of cells). Up to `band` metres from the surface (`None`: 20 mm) a walk along the surface then
    looks for the nearest one, and its triangle is measured: 0.01 mm off on average on a 3 mm grid,
    a fifth of a cell at most. Beyond, distances are too large by up to half a cell.
    """
    vertices, faces = closed_surface(head)
    corners = vertices[faces]
    centre0 = grid.origin + 0.5 * grid.spacing
    shape = np.array(grid.shape, np.int64)
    seed = _seed(corners, centre0, grid.spacing, shape)
    if not (seed >= 0).any():
        return _far_from_surface(head, grid)
    feet, owner, seeds = _feet(corners, centre0, grid.spacing, seed)
    label = seeds
    for axis in range(3):
        label = _nearest_along(label, feet, centre0, grid.spacing, axis)
    reach = 0.02 if band is None else band
    distance = _measured(label, seeds, feet, owner, corners, centre0, grid.spacing, reach)
    votes = np.zeros(grid.shape, np.int8)
    for axis in range(3):
        votes += (
            np.cumsum(_winding(corners, centre0, grid.spacing, shape, axis), axis, np.int8) != 0
        )
    np.negative(distance, out=distance, where=votes >= 2)
    return distance


def distance_to(head: Head, points: npt.ArrayLike) -> Float64Array:
    """Return the exact signed distance (N,) of points (N, 3) to the head, metres, inside < 0."""
    tree = _closed_tree(head)
    distance = nearest_on_surface(tree, points)[2]
    np.negative(distance, out=distance, where=inside_surface(tree, points))
    return distance


def closed_surface(head: Head) -> tuple[Float64Array, Int32Array]:
    """Return the head's vertices (V', 3) and faces (F', 3) with every hole closed by a fan.

    Vertices repeated for texture seams are taken as one first. Each connected run of boundary edges
    is then fanned to its mean, wound as the mesh around it.
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
    """Starts and ends of the directed edges that no other face runs along the other way."""
    start = faces.ravel().astype(np.int64)
    end = faces[:, [1, 2, 0]].ravel().astype(np.int64)
    border = ~np.isin(start * count + end, end * count + start)
    return start[border], end[border]


@lru_cache(maxsize=2)
def _closed_tree(head: Head) -> TriangleTree:
    return build_tree(*closed_surface(head))


def _far_from_surface(head: Head, grid: VoxelGrid) -> Float32Array:
    """No cell is near the surface: the grid lies wholly inside or outside, and is small or far."""
    return distance_to(head, grid.centres().reshape(-1, 3)).reshape(grid.shape).astype(np.float32)


@njit(cache=True)
def _seed(
    corners: Float64Array, centre0: Float64Array, spacing: float, shape: Int64Array
) -> Int32Array:  # pragma: no cover - compiled
    """(X, Y, Z) the nearest triangle if it is at most a cell away from the centre, else -1."""
    seed = np.full((shape[0], shape[1], shape[2]), -1, np.int32)
    nearest = np.full((shape[0], shape[1], shape[2]), spacing * spacing, np.float32)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    at = np.empty(3)
    for face in range(len(corners)):
        for k in range(3):
            a, b, c = corners[face, 0, k], corners[face, 1, k], corners[face, 2, k]
            bottom = (min(a, b, c) - centre0[k]) / spacing
            top = (max(a, b, c) - centre0[k]) / spacing
            low[k] = max(int(np.ceil(max(bottom, -1e9) - 1)), 0)
            high[k] = min(int(np.floor(min(top, 1e9) + 1)), shape[k] - 1)
        for i in range(low[0], high[0] + 1):
            at[0] = centre0[0] + i * spacing
            for j in range(low[1], high[1] + 1):
                at[1] = centre0[1] + j * spacing
                for k in range(low[2], high[2] + 1):
                    at[2] = centre0[2] + k * spacing
                    squared = triangle_distance(at, corners[face])[0]
                    if squared < nearest[i, j, k]:
                        nearest[i, j, k], seed[i, j, k] = squared, face
    return seed


def _feet(
    corners: Float64Array, centre0: Float64Array, spacing: float, seed: Int32Array
) -> tuple[Float64Array, Int32Array, Int32Array]:
    """Nearest surface points (S, 3) of the seeded cells, their faces (S,), and labels (X, Y, Z)."""
    cells = np.argwhere(seed >= 0)
    owner = seed[tuple(cells.T)]
    centres = centre0 + cells * spacing
    feet = _foot_points(corners, centres, owner)
    label = np.full(seed.shape, -1, np.int32)
    label[tuple(cells.T)] = np.arange(len(owner), dtype=np.int32)
    return feet, owner, label


@njit(cache=True)
def _foot_points(
    corners: Float64Array, points: Float64Array, owner: Int32Array
) -> Float64Array:  # pragma: no cover - compiled
    feet = np.empty((len(points), 3))
    for i in range(len(points)):
        triangle = corners[owner[i]]
        _, u, v, w = triangle_distance(points[i], triangle)
        for k in range(3):
            feet[i, k] = u * triangle[0, k] + v * triangle[1, k] + w * triangle[2, k]
    return feet


def _nearest_along(
    label: Int32Array, feet: Float64Array, centre0: Float64Array, spacing: float, axis: int
) -> Int32Array:
    """For each cell the label, among those of its line along `axis`, whose foot is nearest."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    lines = np.ascontiguousarray(label.transpose(b, c, axis))
    order = np.array([axis, b, c])
    _sweep(lines, feet[:, order].copy(), centre0[order], spacing)
    return lines.transpose(np.argsort([b, c, axis]))


@njit(cache=True)
def _sweep(
    lines: Int32Array, feet: Float64Array, centre0: Float64Array, spacing: float
) -> None:  # pragma: no cover - compiled
    """Lower envelope of the parabolas (x - foot)^2 + rest^2 of each line (B, C, A), in place."""
    length = lines.shape[2]
    apex, rest, begins = np.empty(length), np.empty(length), np.empty(length)
    name = np.empty(length, np.int32)
    for i in range(lines.shape[0]):
        at_b = centre0[1] + i * spacing
        for j in range(lines.shape[1]):
            line = lines[i, j]
            at_c = centre0[2] + j * spacing
            count = _parabolas(line, feet, at_b, at_c, apex, rest, name)
            if count == 0:
                continue
            count = _envelope(count, apex, rest, name, begins)
            current = 0
            for k in range(length):
                x = centre0[0] + k * spacing
                while current + 1 < count and begins[current + 1] <= x:
                    current += 1
                line[k] = name[current]


@njit(cache=True)
def _parabolas(
    line: Int32Array,
    feet: Float64Array,
    at_b: float,
    at_c: float,
    apex: Float64Array,
    rest: Float64Array,
    name: Int32Array,
) -> int:  # pragma: no cover - compiled
    """Sort a line's feet by where they lie along it; they nearly are, so by insertion."""
    count = 0
    for which in line:
        if which < 0 or (count and name[count - 1] == which):
            continue
        x = feet[which, 0]
        slot = count
        while slot > 0 and apex[slot - 1] > x:
            apex[slot], rest[slot], name[slot] = apex[slot - 1], rest[slot - 1], name[slot - 1]
            slot -= 1
        apex[slot], name[slot] = x, which
        rest[slot] = (feet[which, 1] - at_b) ** 2 + (feet[which, 2] - at_c) ** 2
        count += 1
    return count


@njit(cache=True)
def _envelope(
    count: int, apex: Float64Array, rest: Float64Array, name: Int32Array, begins: Float64Array
) -> int:  # pragma: no cover - compiled
    """Keep, in place, the parabolas that are lowest somewhere, and from where on each one is."""
    top = 0
    for m in range(count):
        begin = -_FAR
        while top > 0:
            gap = apex[m] - apex[top - 1]
            if gap <= 1e-12:
                # Feet at one place along the line: the nearer to it hides the other.
                begin = _FAR if rest[m] >= rest[top - 1] else -_FAR
            else:
                begin = 0.5 * (apex[m] + apex[top - 1] + (rest[m] - rest[top - 1]) / gap)
            if begin > begins[top - 1]:
                break
            top -= 1
            begin = -_FAR
        if begin < _FAR:
            apex[top], rest[top], name[top], begins[top] = apex[m], rest[m], name[m], begin
            top += 1
    return top


@njit(cache=True)
def _measured(
    label: Int32Array,
    seeds: Int32Array,
    feet: Float64Array,
    owner: Int32Array,
    corners: Float64Array,
    centre0: Float64Array,
    spacing: float,
    reach: float,
) -> Float32Array:  # pragma: no cover - compiled
    """Distance of each cell to its label's foot; within `reach` to the triangles thereabouts."""
    distance = np.empty(label.shape, np.float32)
    at = np.empty(3)
    for i in range(label.shape[0]):
        at[0] = centre0[0] + i * spacing
        for j in range(label.shape[1]):
            at[1] = centre0[1] + j * spacing
            for k in range(label.shape[2]):
                at[2] = centre0[2] + k * spacing
                which = label[i, j, k]
                squared = foot_distance(at, feet[which])
                if squared < (reach + spacing) ** 2:
                    first, second = _nearer_feet(at, which, seeds, feet, centre0, spacing)
                    squared = min(squared, triangle_distance(at, corners[owner[first]])[0])
                    if owner[second] != owner[first]:
                        squared = min(squared, triangle_distance(at, corners[owner[second]])[0])
                distance[i, j, k] = np.sqrt(squared)
    return distance


@njit(cache=True)
def foot_distance(at: Float64Array, foot: Float64Array) -> float:  # pragma: no cover - compiled
    """Return the squared distance of two points (3,)."""
    return float((at[0] - foot[0]) ** 2 + (at[1] - foot[1]) ** 2 + (at[2] - foot[2]) ** 2)


@njit(cache=True)
def _nearer_feet(
    at: Float64Array,
    which: int,
    seeds: Int32Array,
    feet: Float64Array,
    centre0: Float64Array,
    spacing: float,
) -> tuple[int, int]:  # pragma: no cover - compiled
    """The nearest foot and the one before it, walking along the surface from seed to seed."""
    best, second, nearest = which, which, foot_distance(at, feet[which])
    for _ in range(4):
        start = best
        low = ((feet[start] - centre0) / spacing - 0.5).astype(np.int64)
        for x in range(max(low[0], 0), min(low[0] + 3, seeds.shape[0])):
            for y in range(max(low[1], 0), min(low[1] + 3, seeds.shape[1])):
                for z in range(max(low[2], 0), min(low[2] + 3, seeds.shape[2])):
                    other = seeds[x, y, z]
                    if other >= 0 and other != best:
                        squared = foot_distance(at, feet[other])
                        if squared < nearest:
                            best, second, nearest = other, best, squared
        if best == start:
            break
    return best, second


@njit(cache=True)
def _winding(
    corners: Float64Array, centre0: Float64Array, spacing: float, shape: Int64Array, axis: int
) -> npt.NDArray[np.int8]:  # pragma: no cover - compiled
    """(X, Y, Z) signed crossings between a cell's centre and the one before it along `axis`."""
    crossed = np.zeros((shape[0], shape[1], shape[2]), np.int8)
    b, c = (axis + 1) % 3, (axis + 2) % 3
    cell = np.empty(3, np.int64)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for face in range(len(corners)):
        for k in (b, c):
            bottom = min(corners[face, 0, k], corners[face, 1, k], corners[face, 2, k])
            top = max(corners[face, 0, k], corners[face, 1, k], corners[face, 2, k])
            low[k] = max(int(np.ceil(max((bottom - centre0[k]) / spacing, -1e9) - 1e-6)), 0)
            high[k] = min(
                int(np.floor(min((top - centre0[k]) / spacing, 1e9) + 1e-6)), shape[k] - 1
            )
        for i in range(low[b], high[b] + 1):
            for j in range(low[c], high[c] + 1):
                sign, height = line_crossing(
                    corners[face], axis, centre0[b] + i * spacing, centre0[c] + j * spacing
                )
                if sign == 0:
                    continue
                first = max(int(np.floor(min((height - centre0[axis]) / spacing, 1e9))) + 1, 0)
                if first < shape[axis]:
                    cell[axis], cell[b], cell[c] = first, i, j
                    crossed[cell[0], cell[1], cell[2]] += sign
    return crossed
