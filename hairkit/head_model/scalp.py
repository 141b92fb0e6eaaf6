"""Roots on the scalp: where strands start, how they are bound, and the mesh that joins them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.spatial import Delaunay, QhullError, cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.errors import InputError
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.types.head import Head, Roots

MAX_ROOTS = 200_000
_CANDIDATES_PER_ROOT = 12
_BISECTIONS = 12
_LONGEST_EDGE = 3.2
"""Edges of the growth mesh longer than this many root spacings bridge what is not scalp."""


def sample_roots(head: Head, count: int, seed: int = 0) -> Roots:
    """Return exactly `count` roots spread evenly over the scalp, equal for equal input.

    Random points on the faces, kept where the interpolated scalp weight is above 0.5, are thinned
    out until no two are nearer than a radius, chosen so that `count` are left.

    Parameters
    ----------
    head : Head
    count : int
        1 to 200,000.
    seed : int
        Of the random points; another seed gives another even spread.

    Raises
    ------
    InputError
        `count` is out of bounds.
    """
    if not 1 <= count <= MAX_ROOTS:
        raise InputError(f"{count} roots asked for, expected 1 to {MAX_ROOTS}")
    generator = np.random.default_rng(seed)
    triangle, barycentric = _random_points(head, _CANDIDATES_PER_ROOT * count + 64, generator)
    points = evaluate(head, triangle, barycentric)
    shuffled = generator.permutation(len(points))
    chosen = shuffled[_spread(points[shuffled], count)]
    return roots_at(head, triangle[chosen], barycentric[chosen])


def roots_at(head: Head, triangle: npt.ArrayLike, barycentric: npt.ArrayLike) -> Roots:
    """Return the roots on faces (N,) at barycentric weights (N, 3), with smooth normals."""
    face = np.asarray(triangle, np.int32)
    weights = np.asarray(barycentric, np.float64)
    normals = _interpolate(head, face, weights, head.normals())
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    positions = evaluate(head, face, weights)
    uv = _interpolate(head, face, weights, head.uv)
    return Roots(
        positions.astype(np.float32),
        normals.astype(np.float32),
        uv.astype(np.float32),
        face,
        weights.astype(np.float32),
    )


def bind(points: npt.ArrayLike, head: Head) -> tuple[Int32Array, Float32Array]:
    """Return the face (N,) nearest to each of points (N, 3) and the barycentric weights (N, 3)."""
    triangle, weights, _ = nearest_on_surface(build_tree(head.vertices, head.faces), points)
    return triangle, weights.astype(np.float32)


def evaluate(head: Head, triangle: npt.ArrayLike, barycentric: npt.ArrayLike) -> Float64Array:
    """Return the positions (N, 3) in metres of faces (N,) at barycentric weights (N, 3)."""
    weights = np.asarray(barycentric, np.float64)
    return _interpolate(head, np.asarray(triangle), weights, head.vertices)


def growth_mesh(roots: Roots, head: Head) -> Int32Array:
    """Return triangles (F, 3) between neighbouring roots, counter-clockwise from outside.

    Delaunay on the stereographic projection of the scalp from its middle (conformal, so that round
    triangles stay round), without those whose longest edge bridges a gap; every root has at least
    one. The vertices are the roots, in their order, as HairWorks wants its growth mesh.

    Raises
    ------
    InputError
        Fewer than three roots, or all on a line.
    """
    if len(roots) < 3:
        raise InputError(f"a growth mesh needs at least 3 roots, got {len(roots)}")
    points = roots.positions.astype(np.float64)
    try:
        faces = Delaunay(_flattened(points, roots.normals.astype(np.float64))).simplices
    except QhullError as error:
        raise InputError("the roots lie on one line; a growth mesh needs area") from error
    faces = _short(points, faces)
    a, b, c = (points[faces[:, k]] for k in range(3))
    outward = roots.normals.astype(np.float64)[faces].sum(axis=1)
    inverted = (np.cross(b - a, c - a) * outward).sum(axis=1) < 0
    faces[inverted] = faces[inverted][:, ::-1]
    return faces.astype(np.int32)


def _interpolate(
    head: Head, triangle: npt.NDArray[np.integer], weights: Float64Array, values: npt.ArrayLike
) -> Float64Array:
    corners = np.asarray(values, np.float64)[head.faces[triangle]]
    result: Float64Array = np.einsum("nk,nkd->nd", weights, corners)
    return result


def _random_points(
    head: Head, wanted: int, generator: np.random.Generator
) -> tuple[Int32Array, Float64Array]:
    """At least `wanted` uniform points of the scalp: faces (M,) and weights (M, 3)."""
    scalp = head.scalp.astype(np.float64)[head.faces]
    corners = head.vertices.astype(np.float64)[head.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normal, axis=1) * (scalp.max(axis=1) > 0.5)
    if not area.sum() > 0:
        raise InputError("the head's scalp has no area: mark whole faces, not single vertices")
    total = np.cumsum(area)
    faces: list[Int32Array] = []
    weights: list[Float64Array] = []
    found = 0
    for _ in range(64):
        # Evenly stepped along the summed area: fewer clumps than independent draws.
        drawn = wanted + wanted // 8
        steps = (np.arange(drawn) + generator.random(drawn)) / drawn * total[-1]
        face = np.minimum(np.searchsorted(total, steps, side="right"), len(area) - 1)
        root, share = np.sqrt(generator.random(drawn)), generator.random(drawn)
        weight = np.stack([1 - root, root * (1 - share), root * share], axis=1)
        keep = (scalp[face] * weight).sum(axis=1) > 0.5
        faces.append(face[keep].astype(np.int32))
        weights.append(weight[keep])
        found += int(np.count_nonzero(keep))
        if found >= wanted:
            return np.concatenate(faces), np.concatenate(weights)
    raise InputError("the head's scalp has almost no area: mark more of it")


def _spread(points: Float64Array, count: int) -> Int64Array:
    """Indices (count,) of points (M, 3), given in random order, that are far from each other.

    Points are taken in turn if none taken before is within a radius (Cook 1986); the largest radius
    that still yields `count` is searched for, and of those it yields the last few are dropped.
    """
    area = 2.0 * float(np.prod(np.sort(np.ptp(points, axis=0))[1:]))
    too_near, too_far = 0.0, 2.0 * np.sqrt(area / count) + 1e-9
    best = np.arange(count)
    radius = 0.4 * too_far
    for _ in range(_BISECTIONS):
        taken = scattered(points, radius)
        if len(taken) >= count:
            too_near, best = radius, taken
            if len(taken) <= 1.005 * count:
                break
        else:
            too_far = radius
        # The number taken falls with the square of the radius: a better guess than the middle.
        guess = radius * np.sqrt(len(taken) / (1.0025 * count))
        inside = too_near + 0.05 * (too_far - too_near) < guess < too_far
        radius = guess if inside else 0.5 * (too_near + too_far)
    return best[:count]


@njit(cache=True)
def scattered(points: Float64Array, radius: float) -> Int64Array:  # pragma: no cover - compiled
    """Return which points (M, 3) have none of the earlier returned ones within `radius`: indices.

    Taken points hang in chains, one for each cubic cell of about that edge.
    """
    low, shape = np.empty(3), np.empty(3, np.int64)
    edge = radius
    for k in range(3):
        low[k] = points[:, k].min()
        edge = max(edge, (points[:, k].max() - low[k]) / 200)
    for k in range(3):
        shape[k] = int((points[:, k].max() - low[k]) / edge) + 3
    heads = np.full((shape[0], shape[1], shape[2]), -1, np.int64)
    following = np.full(len(points), -1, np.int64)
    taken = np.empty(len(points), np.int64)
    count = 0
    for i in range(len(points)):
        cell = ((points[i] - low) / edge).astype(np.int64) + 1
        if _is_free(points, i, cell, heads, following, radius):
            following[i] = heads[cell[0], cell[1], cell[2]]
            heads[cell[0], cell[1], cell[2]] = i
            taken[count] = i
            count += 1
    return taken[:count].copy()


@njit(cache=True)
def _is_free(
    points: Float64Array,
    i: int,
    cell: Int64Array,
    heads: Int64Array,
    following: Int64Array,
    radius: float,
) -> bool:  # pragma: no cover - compiled
    """Whether no taken point of the 27 cells around is within the radius of point i."""
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    for a in range(cell[0] - 1, cell[0] + 2):
        for b in range(cell[1] - 1, cell[1] + 2):
            for c in range(cell[2] - 1, cell[2] + 2):
                other = heads[a, b, c]
                while other >= 0:
                    gap = (points[other, 0] - x) ** 2 + (points[other, 1] - y) ** 2
                    if gap + (points[other, 2] - z) ** 2 < radius * radius:
                        return False
                    other = following[other]
    return True


def _flattened(points: Float64Array, normals: Float64Array) -> Float64Array:
    """(N, 2) stereographic projection about the mean normal, from a middle below the points."""
    pole = normals.mean(axis=0)
    pole /= max(float(np.linalg.norm(pole)), 1e-12)
    helper = np.eye(3)[np.abs(pole).argmin()]
    right = np.cross(helper, pole)
    right /= np.linalg.norm(right)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    middle -= 0.25 * np.ptp(points @ pole) * pole
    direction = points - middle
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
    plane = np.stack([direction @ right, direction @ np.cross(pole, right)], axis=1)
    result: Float64Array = plane / np.maximum(1 + direction @ pole, 1e-3)[:, None]
    return result


def _short(points: Float64Array, faces: Int32Array) -> Int32Array:
    """Faces without those that bridge gaps; a root that would lose all keeps its shortest."""
    edges = np.stack([points[faces[:, k]] - points[faces[:, k - 1]] for k in range(3)])
    longest = np.linalg.norm(edges, axis=2).max(axis=0)
    spacing = np.median(cKDTree(points).query(points, k=2)[0][:, 1])
    keep = longest <= _LONGEST_EDGE * max(float(spacing), 1e-9)
    order = np.argsort(longest, kind="stable")
    used = np.zeros(len(points), bool)
    used[faces[keep]] = True
    for face in order[~keep[order]]:
        if not used[faces[face]].all():
            keep[face] = True
            used[faces[face]] = True
    kept: Int32Array = faces[keep]
    return kept
