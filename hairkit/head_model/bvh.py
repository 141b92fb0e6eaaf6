"""Exact nearest points and ray crossings on triangle meshes, by a box tree, deterministic.

On the closed default head (23,120 faces, trimesh 5.2, rtree 1.4), processor time for 5,000 points:
nearest points 0.015 s at the surface and 0.05 s around the head, against 0.25 s and 10 s of
`trimesh.proximity.closest_point`, whose distances are up to 0.03 mm too large; inside 0.02 s and
0.004 s, against 28 s and 4 s of `Trimesh.contains`, with the same answers. So these stay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int32Array, Int64Array
from hairkit.parallel import compiled, compiled_with

_LEAF = 4
"""Triangles of a leaf."""
_STACK = 64
"""Nodes that wait during a walk: at most two for each level, of which a mesh has fewer than 32."""


class TriangleTree(NamedTuple):
    """A complete binary tree of boxes; node i has children 2i + 1 and 2i + 2."""

    lower: Float64Array
    """(2L - 1, 3) lowest corner of each node's box."""
    upper: Float64Array
    """(2L - 1, 3) highest corner of each node's box."""
    corners: Float64Array
    """(4L, 3, 3) triangles in leaf order; free places hold points, corners of the last one."""
    order: Int64Array
    """(4L,) the mesh's face that each of `corners` is."""


def build_tree(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> TriangleTree:
    """Return the tree over `faces` (F, 3) of `vertices` (V, 3); F is at least 1."""
    triangles = np.asarray(vertices, np.float64)[np.asarray(faces)]
    count = len(triangles)
    depth = max(int(np.ceil(np.log2(count / _LEAF))), 0)
    order = np.arange(_LEAF << depth)
    face = np.minimum(order, count - 1)
    triangles = triangles[face]
    triangles[count:, 1:] = triangles[count:, :1]  # no ray crosses a point
    middle = np.ascontiguousarray(triangles.mean(axis=1).T)
    for level in range(depth):
        parts = order.reshape(1 << level, -1)
        centres = middle[:, parts]
        axis = np.ptp(centres, axis=2).argmax(axis=0)
        along = np.take_along_axis(centres, axis[None, :, None], axis=0)[0]
        order = np.take_along_axis(parts, along.argsort(axis=1, kind="stable"), axis=1).ravel()
    corners = np.ascontiguousarray(triangles[order])
    leaves = corners.reshape(1 << depth, -1, 3)
    lowest, highest = [leaves.min(axis=1)], [leaves.max(axis=1)]
    while len(lowest[-1]) > 1:
        lowest.append(lowest[-1].reshape(-1, 2, 3).min(axis=1))
        highest.append(highest[-1].reshape(-1, 2, 3).max(axis=1))
    return TriangleTree(
        np.concatenate(lowest[::-1]),
        np.concatenate(highest[::-1]),
        corners,
        face[order].astype(np.int64),
    )


def nearest_on_surface(
    tree: TriangleTree, points: npt.ArrayLike
) -> tuple[Int32Array, Float64Array, Float64Array]:
    """Return each point's nearest face (N,), barycentric weights there (N, 3) and distance (N,).

    Points (N, 3) that follow each other in space are found fastest.
    """
    at = np.ascontiguousarray(points, np.float64).reshape(-1, 3)
    slot, weights, distance = np.empty(len(at), np.int64), np.empty((len(at), 3)), np.empty(len(at))
    _nearest(tree, at, slot, weights, distance)
    return tree.order[slot].astype(np.int32), weights, distance


def inside_surface(tree: TriangleTree, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return (N,) whether points lie in a closed surface, by a vote of rays along the three axes.

    A ray's signed crossings are summed, so bodies may overlap and may be wound either way.
    """
    at = np.ascontiguousarray(points, np.float64).reshape(-1, 3)
    inside, second = (_crossed(tree, at, axis) for axis in range(2))
    split = inside != second
    inside[split] = _crossed(tree, at[split], 2)
    return inside


def _crossed(tree: TriangleTree, points: Float64Array, axis: int) -> npt.NDArray[np.bool_]:
    totals = np.zeros(len(points), np.int64)
    _crossings(tree, points, axis, totals)
    return np.asarray(totals != 0)


@compiled
def _nearest(
    tree: TriangleTree,
    points: Float64Array,
    slots: Int64Array,
    weights: Float64Array,
    distances: Float64Array,
) -> None:
    """Write slots (N,), weights (N, 3) and distances (N,), each search begun at the last slot."""
    previous = int(np.int64(0))  # a plain 0 has a type of its own, for which a search is compiled
    for i in range(len(points)):
        slot, squared = nearest_slot(tree, points[i], previous)
        slots[i], distances[i], previous = slot, np.sqrt(squared), slot
        _, weights[i, 0], weights[i, 1], weights[i, 2] = triangle_distance(
            points[i], tree.corners[slot]
        )


@compiled_with(allocates=True, inside=True)
def nearest_slot(tree: TriangleTree, point: Float64Array, guess: int) -> tuple[int, float]:
    """Return the slot of the nearest triangle and the squared distance, starting from a guess."""
    lower, upper, corners = tree.lower, tree.upper, tree.corners
    first_leaf = len(lower) // 2
    best, slot = triangle_distance(point, corners[guess])[0], guess
    stack = np.empty(_STACK, np.int64)
    stack[0], top = 0, 1
    while top:
        top -= 1
        node = stack[top]
        if box_distance(point, lower[node], upper[node]) >= best:
            continue
        if node >= first_leaf:
            start = (node - first_leaf) * _LEAF
            for k in range(start, start + _LEAF):
                squared = triangle_distance(point, corners[k])[0]
                if squared < best:
                    best, slot = squared, k
            continue
        left, right = 2 * node + 1, 2 * node + 2
        to_left = box_distance(point, lower[left], upper[left])
        to_right = box_distance(point, lower[right], upper[right])
        if to_left > to_right:
            left, right, to_left, to_right = right, left, to_right, to_left
        if to_right < best:
            stack[top] = right
            top += 1
        if to_left < best:
            stack[top] = left
            top += 1
    return slot, best


@compiled_with(inside=True)
def box_distance(point: Float64Array, low: Float64Array, high: Float64Array) -> float:
    """Return the squared distance from a point to a box."""
    total = 0.0
    for axis in range(3):
        gap = max(low[axis] - point[axis], point[axis] - high[axis], 0.0)
        total += gap * gap
    return total


@compiled_with(inside=True)
def triangle_distance(
    point: Float64Array, triangle: Float64Array
) -> tuple[float, float, float, float]:
    """Return the squared distance and the nearest point's weights (Ericson 2004, section 5.1.5)."""
    a0, a1, a2 = triangle[0, 0], triangle[0, 1], triangle[0, 2]
    u0, u1, u2 = triangle[1, 0] - a0, triangle[1, 1] - a1, triangle[1, 2] - a2
    v0, v1, v2 = triangle[2, 0] - a0, triangle[2, 1] - a1, triangle[2, 2] - a2
    p0, p1, p2 = point[0] - a0, point[1] - a1, point[2] - a2
    uu, uv, vv = (
        u0 * u0 + u1 * u1 + u2 * u2,
        u0 * v0 + u1 * v1 + u2 * v2,
        v0 * v0 + v1 * v1 + v2 * v2,
    )
    d1, d2 = u0 * p0 + u1 * p1 + u2 * p2, v0 * p0 + v1 * p1 + v2 * p2
    d3, d4, d5, d6 = d1 - uu, d2 - uv, d1 - uv, d2 - vv
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0 and d2 <= 0:
        s, t = 0.0, 0.0
    elif d3 >= 0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif vc <= 0 and d1 >= 0 and d3 <= 0:
        s, t = d1 / (d1 - d3) if d1 > d3 else 0.0, 0.0
    elif d6 >= 0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vb <= 0 and d2 >= 0 and d6 <= 0:
        s, t = 0.0, d2 / (d2 - d6) if d2 > d6 else 0.0
    elif va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        along = d4 - d3 + d5 - d6
        t = (d4 - d3) / along if along > 0 else 0.0
        s = 1 - t
    else:
        scale = 1 / (va + vb + vc) if va + vb + vc > 0 else 0.0
        s, t = vb * scale, vc * scale
    g0, g1, g2 = p0 - s * u0 - t * v0, p1 - s * u1 - t * v1, p2 - s * u2 - t * v2
    return g0 * g0 + g1 * g1 + g2 * g2, 1 - s - t, s, t


@compiled_with(allocates=True)
def _crossings(tree: TriangleTree, points: Float64Array, axis: int, totals: Int64Array) -> None:
    """Add to totals (N,) the signed crossings of the rays from points (N, 3) along +axis."""
    lower, upper, corners = tree.lower, tree.upper, tree.corners
    first_leaf = len(lower) // 2
    b, c = (axis + 1) % 3, (axis + 2) % 3
    stack = np.empty(_STACK, np.int64)
    for i in range(len(points)):
        p = points[i]
        stack[0], top = 0, 1
        while top:
            top -= 1
            node = stack[top]
            if not (
                lower[node, b] <= p[b] <= upper[node, b]
                and lower[node, c] <= p[c] <= upper[node, c]
                and upper[node, axis] >= p[axis]
            ):
                continue
            if node < first_leaf:
                stack[top], stack[top + 1] = 2 * node + 1, 2 * node + 2
                top += 2
                continue
            start = (node - first_leaf) * _LEAF
            for k in range(start, start + _LEAF):
                sign, height = line_crossing(corners[k], axis, p[b], p[c])
                if sign != 0 and height > p[axis]:
                    totals[i] += sign


@compiled_with(inside=True)
def line_crossing(triangle: Float64Array, axis: int, at_b: float, at_c: float) -> tuple[int, float]:
    """Return +1, -1 or 0 and where along `axis` the line (at_b, at_c) crosses a triangle.

    Half-open edges, each evaluated the same way from both its triangles: a line through a shared
    edge or corner of a closed surface crosses exactly as often as its neighbours do.
    """
    b, c = (axis + 1) % 3, (axis + 2) % 3
    turns = 0
    for k in range(3):
        turns += edge_crossing(triangle[k], triangle[(k + 1) % 3], b, c, at_b, at_c)
    if turns == 0:
        return 0, 0.0
    x0, y0 = triangle[1, b] - triangle[0, b], triangle[1, c] - triangle[0, c]
    x1, y1 = triangle[2, b] - triangle[0, b], triangle[2, c] - triangle[0, c]
    area = x0 * y1 - x1 * y0
    if area == 0:
        return 0, 0.0
    xp, yp = at_b - triangle[0, b], at_c - triangle[0, c]
    s, t = (xp * y1 - x1 * yp) / area, (x0 * yp - xp * y0) / area
    rise = s * (triangle[1, axis] - triangle[0, axis]) + t * (triangle[2, axis] - triangle[0, axis])
    return turns, triangle[0, axis] + rise


@compiled_with(inside=True)
def edge_crossing(
    start: Float64Array, end: Float64Array, b: int, c: int, at_b: float, at_c: float
) -> int:
    """Return +1 or -1 when the half line from (at_b, at_c) along +b crosses the directed edge."""
    if (start[c] <= at_c) == (end[c] <= at_c):
        return 0
    low, high, sign = (start, end, 1) if start[c] < end[c] else (end, start, -1)
    side = (high[b] - low[b]) * (at_c - low[c]) - (at_b - low[b]) * (high[c] - low[c])
    return sign if side > 0 else 0
