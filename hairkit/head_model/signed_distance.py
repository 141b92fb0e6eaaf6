"""Signed distance to a head: on a grid for carving and tracking, or at single points.

Head meshes are often open at the neck, the eyes and the mouth. Every hole is closed with a fan
first. A point is then inside if lines through it along at least two of the three axes have a sum of
signed crossings other than 0 there, which holds for overlapping parts and for inward normals too.

On the default head a grid of 25,000 cells takes 0.04 s of processor time, one of 890,000 cells
0.24 s; `trimesh.proximity.signed_distance` would take 17 s for the first (1.3 s for 2,000 cells).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
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
from hairkit.parallel import compiled, compiled_with
from hairkit.types.head import Head
from hairkit.types.preview import Surface
from hairkit.types.volume import VoxelGrid

_FAR = 1e30
"""Beyond all coordinates."""
_FAR_CELLS = 1e9
"""Cells from the grid beyond which a coordinate is clamped, since integers cannot hold it."""
BAND = 0.02
"""Metres from the surface up to which cells are measured to the nearest triangle by default."""
_WALK = 4
"""Steps along the surface at most that look for a nearer foot."""
_SAME_PLACE = 1e-12
"""Metres along a line at which two feet are at one place."""


class Cells(NamedTuple):
    """The centres of a grid's cells."""

    first: Float64Array
    """(3,) centre of the first cell, metres, head frame."""
    spacing: float
    """Metres from one centre to the next."""
    shape: Int64Array
    """(3,) numbers of cells."""


class Feet(NamedTuple):
    """Surface points nearest to the cells at the surface."""

    points: Float64Array
    """(S, 3) metres, head frame."""
    owner: Int32Array
    """(S,) the face that each lies on."""
    label: Int32Array
    """(X, Y, Z) the foot of each cell at the surface, -1 elsewhere."""


def signed_distance(head: Surface, grid: VoxelGrid, band: float | None = None) -> Float32Array:
    """Return the signed distance to the head at the cell centres, (X, Y, Z), metres, inside < 0.

    Each cell at the surface gets the nearest point on its nearest triangle (its foot); every other
    cell gets one of the feet by a separable transform (after Felzenszwalb and Huttenlocher 2012,
    with points in place of cells). Up to `band` metres from the surface (`None`: `BAND`) a walk
    along the surface then looks for the nearest foot, and the distance to its triangle is taken:
    the error is 0.01 mm on average on a 3 mm grid and a third of a cell at most. Farther away,
    distances are too large by up to half a cell.
    """
    vertices, faces = closed_surface(head)
    corners = vertices[faces]
    first = grid.origin + 0.5 * grid.spacing
    cells = Cells(first, grid.spacing, np.array(grid.shape, np.int64))
    seed = _nearest_faces(corners, cells)
    if not (seed >= 0).any():
        return _far_from_surface(head, grid)
    feet = _find_feet(corners, cells, seed)
    label = feet.label
    for axis in range(3):
        label = _nearest_along(label, feet.points, cells, axis)
    reach = BAND if band is None else band
    distance = _measure(label, feet, corners, cells, reach)
    votes = np.zeros(grid.shape, np.int8)
    for axis in range(3):
        votes += np.cumsum(_winding(corners, cells, axis), axis, np.int8) != 0
    np.negative(distance, out=distance, where=votes >= 2)
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


def _far_from_surface(head: Surface, grid: VoxelGrid) -> Float32Array:
    """Return the distances of a grid without cells at the surface: wholly inside or outside."""
    tree, centres = build_tree(*closed_surface(head)), grid.centres().reshape(-1, 3)
    return _distances(tree, centres).reshape(grid.shape).astype(np.float32)


@compiled_with(allocates=True)
def _nearest_faces(corners: Float64Array, cells: Cells) -> Int32Array:
    """Return (X, Y, Z) the nearest face if it is at most a cell away from the centre, else -1."""
    centre0, spacing, shape = cells.first, cells.spacing, cells.shape
    seed = np.full((shape[0], shape[1], shape[2]), -1, np.int32)
    nearest = np.full((shape[0], shape[1], shape[2]), spacing * spacing, np.float32)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    at = np.empty(3)
    for face in range(len(corners)):
        for k in range(3):
            a, b, c = corners[face, 0, k], corners[face, 1, k], corners[face, 2, k]
            bottom = (min(a, b, c) - centre0[k]) / spacing
            top = (max(a, b, c) - centre0[k]) / spacing
            low[k] = max(int(np.ceil(max(bottom, -_FAR_CELLS) - 1)), 0)
            high[k] = min(int(np.floor(min(top, _FAR_CELLS) + 1)), shape[k] - 1)
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


def _find_feet(corners: Float64Array, cells: Cells, face: Int32Array) -> Feet:
    """Return the feet of the cells whose nearest face (X, Y, Z) is known."""
    at = np.argwhere(face >= 0)
    owner = face[tuple(at.T)]
    points = _foot_points(corners, cells.first + at * cells.spacing, owner)
    label = np.full(face.shape, -1, np.int32)
    label[tuple(at.T)] = np.arange(len(owner), dtype=np.int32)
    return Feet(points, owner, label)


@compiled_with(allocates=True)
def _foot_points(corners: Float64Array, points: Float64Array, owner: Int32Array) -> Float64Array:
    """Return (S, 3) the point of each owner's triangle that is nearest to points (S, 3)."""
    feet = np.empty((len(points), 3))
    for i in range(len(points)):
        triangle = corners[owner[i]]
        _, u, v, w = triangle_distance(points[i], triangle)
        for k in range(3):
            feet[i, k] = u * triangle[0, k] + v * triangle[1, k] + w * triangle[2, k]
    return feet


def _nearest_along(label: Int32Array, feet: Float64Array, cells: Cells, axis: int) -> Int32Array:
    """Return for each cell the label on its line along `axis` whose foot (S, 3) is nearest."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    lines = np.ascontiguousarray(label.transpose(b, c, axis))
    order = np.array([axis, b, c])
    turned = Cells(cells.first[order], cells.spacing, cells.shape[order])
    _sweep(lines, feet[:, order].copy(), turned)
    return lines.transpose(np.argsort([b, c, axis]))


@compiled_with(allocates=True)
def _sweep(lines: Int32Array, feet: Float64Array, cells: Cells) -> None:
    """Relabel each line (B, C, A) by the lower envelope of its parabolas (x - apex)^2 + rest.

    A foot's parabola is its squared distance to the line's points: apex is its coordinate along the
    line, rest its squared distance from the line. Axes of feet and cells are (A, B, C).
    """
    centre0, spacing = cells.first, cells.spacing
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


@compiled
def _parabolas(
    line: Int32Array,
    feet: Float64Array,
    at_b: float,
    at_c: float,
    apex: Float64Array,
    rest: Float64Array,
    name: Int32Array,
) -> int:
    """Sort a line's parabolas by apex, by insertion since most are in order; return how many."""
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


@compiled
def _envelope(
    count: int, apex: Float64Array, rest: Float64Array, name: Int32Array, begins: Float64Array
) -> int:
    """Keep, in place, the parabolas that are lowest somewhere, and where each begins to be."""
    top = 0
    for m in range(count):
        begin = -_FAR
        while top > 0:
            gap = apex[m] - apex[top - 1]
            if gap <= _SAME_PLACE:
                # feet at one place along the line: the one nearer to the line hides the other
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


@compiled_with(allocates=True)
def _measure(
    label: Int32Array, feet: Feet, corners: Float64Array, cells: Cells, reach: float
) -> Float32Array:
    """Return (X, Y, Z) distances to the labels' feet, within `reach` to triangles around them."""
    centre0, spacing, owner = cells.first, cells.spacing, feet.owner
    distance = np.empty(label.shape, np.float32)
    at = np.empty(3)
    for i in range(label.shape[0]):
        at[0] = centre0[0] + i * spacing
        for j in range(label.shape[1]):
            at[1] = centre0[1] + j * spacing
            for k in range(label.shape[2]):
                at[2] = centre0[2] + k * spacing
                which = label[i, j, k]
                squared = foot_distance(at, feet.points[which])
                if squared < (reach + spacing) ** 2:
                    first, second = _nearer_feet(at, which, feet, cells)
                    squared = min(squared, triangle_distance(at, corners[owner[first]])[0])
                    if owner[second] != owner[first]:
                        squared = min(squared, triangle_distance(at, corners[owner[second]])[0])
                distance[i, j, k] = np.sqrt(squared)
    return distance


@compiled
def foot_distance(at: Float64Array, foot: Float64Array) -> float:
    """Return the squared distance of two points (3,)."""
    return float((at[0] - foot[0]) ** 2 + (at[1] - foot[1]) ** 2 + (at[2] - foot[2]) ** 2)


@compiled
def _nearer_feet(at: Float64Array, which: int, feet: Feet, cells: Cells) -> tuple[int, int]:
    """Return the nearest foot to a point (3,), and the one before it, on a walk from `which`.

    Each step looks at the feet of the 27 cells around the last one.
    """
    points, seeds = feet.points, feet.label
    best, second, nearest = which, which, foot_distance(at, points[which])
    for _ in range(_WALK):
        start = best
        i = int((points[start, 0] - cells.first[0]) / cells.spacing - 0.5)
        j = int((points[start, 1] - cells.first[1]) / cells.spacing - 0.5)
        k = int((points[start, 2] - cells.first[2]) / cells.spacing - 0.5)
        for x in range(max(i, 0), min(i + 3, seeds.shape[0])):
            for y in range(max(j, 0), min(j + 3, seeds.shape[1])):
                for z in range(max(k, 0), min(k + 3, seeds.shape[2])):
                    other = seeds[x, y, z]
                    if other >= 0 and other != best:
                        squared = foot_distance(at, points[other])
                        if squared < nearest:
                            best, second, nearest = other, best, squared
        if best == start:
            break
    return best, second


@compiled_with(allocates=True)
def _winding(corners: Float64Array, cells: Cells, axis: int) -> npt.NDArray[np.int8]:
    """Return (X, Y, Z) the signed crossings of `axis` between each centre and the one before it."""
    centre0, spacing, shape = cells.first, cells.spacing, cells.shape
    crossed = np.zeros((shape[0], shape[1], shape[2]), np.int8)
    b, c = (axis + 1) % 3, (axis + 2) % 3
    cell = np.empty(3, np.int64)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for face in range(len(corners)):
        for k in (b, c):
            bottom = min(corners[face, 0, k], corners[face, 1, k], corners[face, 2, k])
            top = max(corners[face, 0, k], corners[face, 1, k], corners[face, 2, k])
            low[k] = max(int(np.ceil(max((bottom - centre0[k]) / spacing, -_FAR_CELLS) - 1e-6)), 0)
            high[k] = min(
                int(np.floor(min((top - centre0[k]) / spacing, _FAR_CELLS) + 1e-6)), shape[k] - 1
            )
        for i in range(low[b], high[b] + 1):
            for j in range(low[c], high[c] + 1):
                sign, height = line_crossing(
                    corners[face], axis, centre0[b] + i * spacing, centre0[c] + j * spacing
                )
                if sign == 0:
                    continue
                first = max(
                    int(np.floor(min((height - centre0[axis]) / spacing, _FAR_CELLS))) + 1, 0
                )
                if first < shape[axis]:
                    cell[axis], cell[b], cell[c] = first, i, j
                    crossed[cell[0], cell[1], cell[2]] += sign
    return crossed
