"""Unit quaternions (w, x, y, z) as arrays (..., 4).

A quaternion rotates the axes e of a frame into the world: `rotate(q, e)` are its directors.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float64Array

_ALONG_X = 0.6
"""Component from which a unit vector is too near to the x axis for a cross product with it, so that
the y axis is taken; any value well between 0 and 1 does."""


def product(a: Float64Array, b: Float64Array) -> Float64Array:
    """Return the Hamilton product: rotation by `b`, then by `a`."""
    w, x, y, z = np.moveaxis(a, -1, 0)
    s, u, v, t = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            w * s - x * u - y * v - z * t,
            w * u + x * s + y * t - z * v,
            w * v - x * t + y * s + z * u,
            w * t + x * v - y * u + z * s,
        ],
        axis=-1,
    )


def inverse(q: Float64Array) -> Float64Array:
    """Return the conjugate, which is the inverse of a unit quaternion."""
    return np.asarray(q * np.array([1.0, -1.0, -1.0, -1.0]))


def normalize(q: Float64Array) -> Float64Array:
    """Return quaternions or vectors scaled to length 1; zero stays zero."""
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(q / np.maximum(length, 1e-300))


def rotate(q: Float64Array, vector: npt.ArrayLike) -> Float64Array:
    """Rotate vectors (..., 3) by unit quaternions."""
    v = np.asarray(vector, np.float64)
    along = 2.0 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * along + np.cross(q[..., 1:], along)


def third_axis(q: Float64Array) -> Float64Array:
    """Return the third director: the direction of a rod's segment."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def shortest_arc(start: Float64Array, end: Float64Array) -> Float64Array:
    """Return the smallest rotations of unit vectors `start` to `end`; half turns pick any axis.

    This is parallel transport along the great circle between them.
    """
    cosine = (start * end).sum(axis=-1)
    axis = np.cross(start, end)
    turn = np.concatenate([(1.0 + cosine)[..., None], axis], axis=-1)
    opposite = cosine < -1.0 + 1e-12
    if opposite.any():
        other = np.where(np.abs(start[..., :1]) < _ALONG_X, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
        half = np.concatenate([np.zeros_like(cosine)[..., None], np.cross(start, other)], axis=-1)
        turn = np.where(opposite[..., None], half, turn)
    return normalize(turn)


def from_axis(axis: npt.ArrayLike, angle: npt.ArrayLike) -> Float64Array:
    """Return rotations by `angle` (...) radians about unit axes (..., 3)."""
    half = np.asarray(angle, np.float64)[..., None] / 2
    return np.concatenate([np.cos(half), np.sin(half) * np.asarray(axis, np.float64)], axis=-1)


def from_matrix(matrix: npt.ArrayLike) -> Float64Array:
    """Return the quaternions (..., 4) of rotation matrices (..., 3, 3), with w >= 0."""
    given = np.asarray(matrix, np.float64)
    found = Rotation.from_matrix(given.reshape(-1, 3, 3)).as_quat(canonical=True)
    return np.asarray(np.roll(found, 1, axis=-1).reshape(*given.shape[:-2], 4))


def to_matrix(q: npt.ArrayLike) -> Float64Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions."""
    given = np.asarray(q, np.float64)
    turns = Rotation.from_quat(np.roll(given, -1, axis=-1).reshape(-1, 4))
    return np.asarray(turns.as_matrix().reshape(*given.shape[:-1], 3, 3))


def slerp(start: Float64Array, end: Float64Array, share: float) -> Float64Array:
    """Interpolate at fraction `share` between `start` and `end`, along the shorter arc."""
    if (start == end).all():
        return start
    step = product(end, inverse(start))
    step = np.where(step[..., :1] < 0, -step, step)
    sine = np.linalg.norm(step[..., 1:], axis=-1)
    angle = 2.0 * np.arctan2(sine, step[..., 0])
    axis = step[..., 1:] / np.maximum(sine, 1e-300)[..., None]
    return product(from_axis(axis, share * angle), start)
