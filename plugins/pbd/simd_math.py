"""Vectors and quaternions of the kernels: tuples of numbers or of lanes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from .simd import lane_root, load, pick, store

_HOW: dict[str, Any] = {
    "fastmath": True, "error_model": "numpy", "_nrt": False,
}  # fmt: skip
row: Callable[[Any], Any] = njit(**_HOW)
"""Compiles a function that allocates nothing. Array views are then not reference-counted, which
halves the run time of short rows and the compile time."""

ZERO, ONE, TWO, TINY = np.float32(0), np.float32(1), np.float32(2), np.float32(1e-4)
_C1, _C3, _C5 = np.float32(0.9998660), np.float32(-0.3302995), np.float32(0.1801410)
_C7, _C9 = np.float32(-0.0851330), np.float32(0.0208351)
_THIRD, _FIFTH, _SEVENTH = np.float32(1 / 3), np.float32(0.2), np.float32(1 / 7)
_HALF_PI, _SMALL = np.float32(np.pi / 2), np.float32(0.04)


@row
def load_three(array, j, c):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Load three components of row j, from component c."""
    return load(array, (j, c)), load(array, (j, c + 1)), load(array, (j, c + 2))


@row
def load_four(array, j):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Load the first four components of row j."""
    return load(array, (j, 0)), load(array, (j, 1)), load(array, (j, 2)), load(array, (j, 3))


@row
def store_three(array, j, c, v) -> None:  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Store a vector into three components of row j, from component c."""
    store(array, (j, c), v[0])
    store(array, (j, c + 1), v[1])
    store(array, (j, c + 2), v[2])


@row
def store_four(array, j, q) -> None:  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Store a quaternion into row j."""
    store(array, (j, 0), q[0])
    store(array, (j, 1), q[1])
    store(array, (j, 2), q[2])
    store(array, (j, 3), q[3])


@row
def plus(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@row
def minus(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@row
def times(size, a):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the vector times a number."""
    return size * a[0], size * a[1], size * a[2]


@row
def dot(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@row
def cross(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@row
def rows_of(motion, c):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the three rows of four numbers of an array (3, ...), from column c, as scalars."""
    return (
        (motion[0, c], motion[0, c + 1], motion[0, c + 2], motion[0, c + 3]),
        (motion[1, c], motion[1, c + 1], motion[1, c + 2], motion[1, c + 3]),
        (motion[2, c], motion[2, c + 1], motion[2, c + 2], motion[2, c + 3]),
    )


@row
def rotate_rows(rows, a):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Rotate a vector by a motion given by rows."""
    return dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)


@row
def transform_rows(rows, a):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Transform a point by a motion given by rows, whose fourth components are the translation."""
    return dot(rows[0], a) + rows[0][3], dot(rows[1], a) + rows[1][3], dot(rows[2], a) + rows[2][3]


@row
def product(r, q):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the quaternion product r q."""
    return (
        r[0] * q[0] - r[1] * q[1] - r[2] * q[2] - r[3] * q[3],
        r[0] * q[1] + r[1] * q[0] + r[2] * q[3] - r[3] * q[2],
        r[0] * q[2] - r[1] * q[3] + r[2] * q[0] + r[3] * q[1],
        r[0] * q[3] + r[1] * q[2] - r[2] * q[1] + r[3] * q[0],
    )


@row
def rotate(q, v):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Rotate a vector by a unit quaternion."""
    axis = (q[1], q[2], q[3])
    a = times(TWO, cross(axis, v))
    return plus(plus(v, times(q[0], a)), cross(axis, a))


@row
def trilinear(v, share):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the trilinear value between eight corners and its gradient, last axis fastest."""
    a, b, c = share
    d0, d2, d4, d6 = v[1] - v[0], v[3] - v[2], v[5] - v[4], v[7] - v[6]
    v0, v2, v4, v6 = v[0] + c * d0, v[2] + c * d2, v[4] + c * d4, v[6] + c * d6
    e0, e4 = v2 - v0, v6 - v4
    low, high = v0 + b * e0, v4 + b * e4
    f0, f4 = d0 + b * (d2 - d0), d4 + b * (d6 - d4)
    return low + a * (high - low), (high - low, e0 + a * (e4 - e0), f0 + a * (f4 - f0))


@row
def absolute(a):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return absolute values."""
    return pick(a, ZERO, ZERO - a, a)


@row
def unit_four(q):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Normalise quaternions."""
    size = ONE / lane_root(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return q[0] * size, q[1] * size, q[2] * size, q[3] * size


@row
def swing_frame(q, d):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Rotate a frame by the shortest arc that brings its third axis to d."""
    t = (
        TWO * (q[1] * q[3] + q[0] * q[2]),
        TWO * (q[2] * q[3] - q[0] * q[1]),
        ONE - TWO * (q[1] * q[1] + q[2] * q[2]),
    )
    cosine = ONE + dot(t, d)
    axis = cross(t, d)
    cosine = pick(cosine, TINY, TINY, cosine)
    return unit_four(product((cosine, axis[0], axis[1], axis[2]), q))


@row
def half_way(a, b, v):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return v turned by the frame half way from a to b, and the axis of b a^-1 times the tangent
    of a quarter of its angle.

    The sum of two unit quaternions has the square 2 + 2 w, w their product.
    """
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = pick(w, ZERO, -ONE, ONE)
    over = ONE / (ONE + sign * w)
    axis = (a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3])
    aside = cross(axis, v)
    turn = plus(times(a[0] + sign * b[0], aside), cross(axis, aside))
    va, vb = (a[1], a[2], a[3]), (b[1], b[2], b[3])
    vector = minus(minus(times(a[0], vb), times(b[0], va)), cross(vb, va))
    return plus(v, times(over, turn)), times(sign * over, vector)


@row
def twist_angle(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return twice the angle of (w, z) of a^-1 b: the twist between frames, radians.

    The arc tangent's polynomial is off by at most 1e-5 (Abramowitz and Stegun 1964, 4.4.49); for
    small twists it would be off by a share of 1.3e-4, so that there its series is taken.
    """
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    z, w = pick(w, ZERO, ZERO - z, z), absolute(w)
    size = absolute(z)
    # one of both is at least the root of a half, or the frames are opposite
    t = pick(w, size, w, size) / pick(w, size, size, w)
    s = t * t
    angle = t * (_C1 + s * (_C3 + s * (_C5 + s * (_C7 + s * _C9))))
    small = t * (ONE - s * (_THIRD - s * (_FIFTH - s * _SEVENTH)))
    angle = pick(s, _SMALL, small, angle)
    angle = TWO * pick(w, size, _HALF_PI - angle, angle)
    return pick(z, ZERO, ZERO - angle, angle)
