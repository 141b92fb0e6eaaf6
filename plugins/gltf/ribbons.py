"""Hair as triangles: strips that lie flat on the head, each for one strand or for a lock of them.

A strip's centre line is a weighted mean of strands, so that it can follow whatever moves them.
Its plane comes from the head's normals alone, not from a camera: across = outward x along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array, unit_vectors
from hairkit.errors import InputError
from hairkit.types.head import Head
from hairkit.types.strands import Strands

_NEAREST = 6
_VERTICES = 2000
_EVERY = 4
"""Points of a line from one whose nearest vertices are looked for to the next."""
_ROUNDS = 3
_TIP_IN_LOCK = 0.4
"""Weight of a metre between tips beside a metre between roots when strands are gathered."""
_STRANDS_PER_STRIP = 12
_SMOOTHINGS = 3
_MEAN_ACROSS, _ANY_ACROSS = 1e-3, 1e-5
"""Small weights of the strip's mean plane, and of any plane, which decide where none is known."""


@dataclass(frozen=True, eq=False)
class Ribbons:
    """Triangles of N strips with K points each; two vertices a point, left then right."""

    vertices: Float32Array
    """(V, 3) metres, V = 2 N K."""
    normals: Float32Array
    """(V, 3) unit, away from the head."""
    tangents: Float32Array
    """(V, 4) unit vectors across the strip, towards u = 1, then 1: glTF's handedness."""
    uv: Float32Array
    """(V, 2) u from 0 at the left edge to 1, v from 0 at the root to 1 at the tip."""
    faces: Int32Array
    """(F, 3) counter-clockwise seen from outside, F = 2 N (K - 1)."""

    @property
    def point_of_vertex(self) -> Int64Array:
        """(V,) the point of the centre lines that each vertex lies beside."""
        return np.arange(len(self.vertices)) // 2


@dataclass(frozen=True, eq=False)
class Locks:
    """Centre lines that stand for all strands: N lines of K points."""

    from_points: Any
    """Sparse (N K, P): the lines' points are this times the strands' points."""
    strand: Int64Array
    """(N,) a strand near the middle of each lock, which gives its root's texture coordinates."""
    spread: Float32Array
    """(N, K, 3) root mean square distance of the lock's strands from its line, per axis, metres."""

    @property
    def points_per_line(self) -> int:
        """K."""
        return int(self.spread.shape[1])

    def moved(self, points: Float32Array) -> Float32Array:
        """Return (N, K, 3) the lines for the strands' points (P, 3); linear, so fit for shifts."""
        lines: Float32Array = (self.from_points @ points).astype(np.float32)
        return lines.reshape(-1, self.points_per_line, 3)


def gather_locks(strands: Strands, count: int, points: int, *, mean: bool, seed: int = 0) -> Locks:
    """Return `count` lines of `points` points that stand for the strands, spread evenly over them.

    Strands are gathered by roots and tips with a few rounds of Lloyd's k-means; when there are no
    more than `count`, each is its own line.

    Parameters
    ----------
    strands
        Root first.
    count
        Lines wanted, 1 or more.
    points
        Points of every line, at equal arc length, 2 or more.
    mean
        True: a line is the mean of its strands. False: it is the strand nearest to that mean.
    seed
        Of the strands that the first lines are.
    """
    if count < 1 or points < 2:
        raise InputError(f"{count} strips of {points} points, expected at least 1 of at least 2")
    order = np.random.default_rng(seed).permutation(len(strands))
    picked = np.sort(order[: max(_STRANDS_PER_STRIP * count, 1)])
    feature = np.concatenate([strands.roots, _TIP_IN_LOCK * strands.tips], axis=1)[picked]
    lock, middle = _k_means(feature.astype(np.float64), min(count, len(picked)), order)
    nearest = picked[middle]
    if not mean:
        picked, lock = nearest, np.arange(len(nearest))
    matrix = _even_points(strands, picked, lock, points)
    lines = (matrix @ strands.points).reshape(-1, points, 3)
    spread = _spread(strands, picked, lock, lines) if mean else np.zeros_like(lines)
    return Locks(matrix, nearest, spread.astype(np.float32))


def outward(lines: Float32Array, head: Head) -> Float32Array:
    """Return (N, K, 3) unit vectors out of the head: the mean normal of the nearest vertices.

    They are found at some of the K points of a line, and interpolated between.
    """
    count = lines.shape[1]
    some = np.unique(np.append(np.arange(0, count, _EVERY), count - 1))
    found = _normals_near(lines[:, some], head)
    share = np.stack([np.interp(np.arange(count), some, row) for row in np.eye(len(some))], axis=1)
    return unit_vectors(share @ found.astype(np.float64)).astype(np.float32)


def _normals_near(points: Float32Array, head: Head) -> Float32Array:
    """Return (..., 3) the mean normals of the vertices nearest to points (..., 3)."""
    # a sample of the vertices: strips follow the head's shape, not its ears and its nose
    sample = np.unique(head.faces)[:: max(len(head.vertices) // _VERTICES, 1)]
    tree = cKDTree(head.vertices[sample])
    distance, near = tree.query(points.reshape(-1, 3), k=min(_NEAREST, len(sample)))
    near, distance = near.reshape(len(distance), -1), distance.reshape(len(distance), -1)
    weight = 1.0 / (distance + 1e-3)
    normals = (head.normals()[sample][near] * weight[..., None]).sum(axis=1)
    return unit_vectors(normals).astype(np.float32).reshape(points.shape)


def make_ribbons(lines: Float32Array, out: Float32Array, width: Float32Array) -> Ribbons:
    """Return strips of the given width (N, K) along lines (N, K, 3), flat towards `out` (N, K, 3).

    Where a line runs along `out` its strip keeps the direction of the points around.
    """
    along, across = frames(lines, out)
    side = np.array([-0.5, 0.5], np.float32)[:, None] * width[..., None, None]
    vertices = lines[:, :, None] + side * across[:, :, None]
    normals = np.cross(along, across)
    count, points = lines.shape[:2]
    v = np.broadcast_to(np.linspace(0, 1, points, dtype=np.float32)[:, None], (points, 2))
    u = np.broadcast_to(np.array([0, 1], np.float32), (points, 2))
    tangents = np.ones((count, points, 4), np.float32)
    tangents[..., :3] = across
    return Ribbons(
        vertices.reshape(-1, 3),
        np.repeat(normals.reshape(-1, 3), 2, axis=0),
        np.repeat(tangents.reshape(-1, 4), 2, axis=0),
        np.tile(np.stack([u, v], axis=-1).reshape(-1, 2), (count, 1)),
        _faces(count, points),
    )


def frames(lines: Float32Array, out: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Return unit directions along and across (N, K, 3) of lines, perpendicular to each other."""
    along = unit_vectors(np.gradient(lines.astype(np.float64), axis=1))
    still = ~along.any(axis=-1, keepdims=True)
    whole = lines[:, -1:].astype(np.float64) - lines[:, :1]
    along = unit_vectors(along + still * (whole + np.array([0.0, -1e-9, 0.0])))
    across = np.cross(out, along)
    turned = (across[:, 1:] * across[:, :-1]).sum(axis=-1) < 0
    sign = np.ones(across.shape[:2])
    sign[:, 1:] = np.cumprod(np.where(turned, -1.0, 1.0), axis=1)
    # most of the strip faces outward, weighted by how well its plane is known
    majority = (sign * (across**2).sum(axis=-1)).sum(axis=1, keepdims=True)
    across *= (sign * np.where(majority < 0, -1.0, 1.0))[..., None]
    for _ in range(_SMOOTHINGS):
        padded = np.concatenate([across[:, :1], across, across[:, -1:]], axis=1)
        across = 0.25 * padded[:, :-2] + 0.5 * padded[:, 1:-1] + 0.25 * padded[:, 2:]
    across += _MEAN_ACROSS * unit_vectors(across.sum(axis=1, keepdims=True)) + (
        _ANY_ACROSS * _any_across(along[:, :1])
    )
    across -= along * (across * along).sum(axis=-1, keepdims=True)
    lost = np.linalg.norm(across, axis=-1, keepdims=True) < 1e-9
    across = unit_vectors(np.where(lost, _any_across(along), across))
    return along.astype(np.float32), across.astype(np.float32)


def _k_means(feature: Float64Array, count: int, order: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return the lock (M,) of each strand and the strand (N,) nearest to each lock's middle."""
    if count == len(feature):
        return np.arange(count), np.arange(count)
    middle = feature[np.sort(order[order < len(feature)][:count])]
    for _ in range(_ROUNDS):
        lock = cKDTree(middle).query(feature)[1]
        members = np.bincount(lock, minlength=count)
        for axis in range(feature.shape[1]):
            total = np.bincount(lock, feature[:, axis], minlength=count)
            middle[members > 0, axis] = total[members > 0] / members[members > 0]
    nearest = np.unique(cKDTree(feature).query(middle)[1])
    lock = cKDTree(feature[nearest]).query(feature)[1]
    return lock.astype(np.int64), nearest.astype(np.int64)


def _even_points(strands: Strands, picked: Int64Array, lock: Int64Array, points: int) -> Any:
    """Return the sparse (N K, P) mean over each lock of points at equal arc length."""
    row_of, before, part = _places(strands, picked, points)
    members = np.bincount(lock)
    weight = 1.0 / members[lock][row_of]
    rows = lock[row_of] * points + np.tile(np.arange(points), len(picked))
    shape = (len(members) * points, len(strands.points))
    values = np.concatenate([weight * (1 - part), weight * part])
    index = (np.concatenate([rows, rows]), np.concatenate([before, before + 1]))
    return csr_matrix((values, index), shape)


def _places(
    strands: Strands, picked: Int64Array, points: int
) -> tuple[Int64Array, Int64Array, Float64Array]:
    """Return, for K points of each picked strand, its rank, the point before and the share."""
    after, share = strands.places(np.full(len(strands), points))
    own = (picked[:, None] * points + np.arange(points)).ravel()
    return np.repeat(np.arange(len(picked)), points), after[own] - 1, share[own]


def _spread(
    strands: Strands, picked: Int64Array, lock: Int64Array, lines: Float64Array
) -> Float64Array:
    """Return (N, K, 3) how far the strands of a lock are from its line, root mean square."""
    points = lines.shape[1]
    row_of, before, part = _places(strands, picked, points)
    here = strands.points[before] * (1 - part[:, None]) + strands.points[before + 1] * part[:, None]
    rows = lock[row_of] * points + np.tile(np.arange(points), len(picked))
    away = (here - lines.reshape(-1, 3)[rows]) ** 2
    total = np.stack([np.bincount(rows, away[:, k], len(lines) * points) for k in range(3)], axis=1)
    members = np.bincount(lock)[:, None, None]
    return np.sqrt(total.reshape(-1, points, 3) / members)


def _any_across(along: Float64Array) -> Float64Array:
    """Return unit vectors perpendicular to `along`."""
    axis = np.eye(3)[np.abs(along).argmin(axis=-1)]
    return unit_vectors(np.cross(axis, along))


def _faces(count: int, points: int) -> Int32Array:
    first = (2 * (np.arange(count)[:, None] * points + np.arange(points - 1))).ravel()
    quads = np.stack([first, first + 2, first + 1, first + 1, first + 2, first + 3], axis=1)
    return quads.reshape(-1, 3).astype(np.int32)
