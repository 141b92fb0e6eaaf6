"""Vectors and quaternions as scalars of float32, for the kernels' lanes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

LANES = 64
"""Strands side by side."""

_HOW: dict[str, Any] = {
    "fastmath": True, "error_model": "numpy", "cache": True, "_nrt": False,
}  # fmt: skip
row: Callable[[Any], Any] = njit(**_HOW)
"""Compiles a function that allocates nothing: views are then not counted, which halves the time of
short rows and of compiling."""

ONE, TWO, TINY = np.float32(1), np.float32(2), np.float32(1e-4)
_C1, _C3, _C5 = np.float32(0.9998660), np.float32(-0.3302995), np.float32(0.1801410)
_C7, _C9 = np.float32(-0.0851330), np.float32(0.0208351)
_HALF_PI = np.float32(np.pi / 2)


@row
def dot(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@row
def cross(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@row
def carry(motion, x, y, z):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return a point moved rigidly; column 3 is the shift."""
    return (
        motion[0, 0] * x + motion[0, 1] * y + motion[0, 2] * z + motion[0, 3],
        motion[1, 0] * x + motion[1, 1] * y + motion[1, 2] * z + motion[1, 3],
        motion[2, 0] * x + motion[2, 1] * y + motion[2, 2] * z + motion[2, 3],
    )


@row
def rotate(q, x, y, z):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return a vector turned by a unit quaternion."""
    a = TWO * (q[2] * z - q[3] * y)
    b = TWO * (q[3] * x - q[1] * z)
    c = TWO * (q[1] * y - q[2] * x)
    return (
        x + q[0] * a + q[2] * c - q[3] * b,
        y + q[0] * b + q[3] * a - q[1] * c,
        z + q[0] * c + q[1] * b - q[2] * a,
    )


@row
def swing_frame(q0, q1, q2, q3, d0, d1, d2):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the frame turned the shortest way so that its third axis is d."""
    t0 = TWO * (q1 * q3 + q0 * q2)
    t1 = TWO * (q2 * q3 - q0 * q1)
    t2 = ONE - TWO * (q1 * q1 + q2 * q2)
    r0 = ONE + t0 * d0 + t1 * d1 + t2 * d2
    r0 = r0 if r0 > TINY else TINY
    r1 = t1 * d2 - t2 * d1
    r2 = t2 * d0 - t0 * d2
    r3 = t0 * d1 - t1 * d0
    s = r0 * q0 - r1 * q1 - r2 * q2 - r3 * q3
    t = r0 * q1 + r1 * q0 + r2 * q3 - r3 * q2
    u = r0 * q2 - r1 * q3 + r2 * q0 + r3 * q1
    o = r0 * q3 + r1 * q2 - r2 * q1 + r3 * q0
    size = ONE / np.sqrt(s * s + t * t + u * u + o * o)
    return s * size, t * size, u * size, o * size


@row
def half_way_frame(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the frame half way, and the axis times the tangent of a quarter of the angle."""
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = ONE if w >= np.float32(0) else -ONE
    m0, m1, m2, m3 = a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3]
    size = ONE / np.sqrt(m0 * m0 + m1 * m1 + m2 * m2 + m3 * m3)
    over = sign / (ONE + sign * w)
    # the vector part of b a^-1
    x = -b[0] * a[1] + b[1] * a[0] - b[2] * a[3] + b[3] * a[2]
    y = -b[0] * a[2] + b[1] * a[3] + b[2] * a[0] - b[3] * a[1]
    z = -b[0] * a[3] - b[1] * a[2] + b[2] * a[1] + b[3] * a[0]
    return (m0 * size, m1 * size, m2 * size, m3 * size), (x * over, y * over, z * over)


@row
def twist_angle(a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return twice the angle of (w, z) of a^-1 b: the twist between frames, radians.

    The arc tangent's polynomial is off by at most 1e-5 (Abramowitz and Stegun 1964, 4.4.49); for
    small twists it would be off by a share of 1.3e-4, so that there its series is taken.
    """
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    sign = ONE if w >= np.float32(0) else -ONE
    w, z = sign * w, sign * z
    size = abs(z)
    steep = size > w
    low, high = (w, size) if steep else (size, w)
    t = low / high  # one of both is at least the root of a half, or the frames are opposite
    s = t * t
    angle = t * (_C1 + s * (_C3 + s * (_C5 + s * (_C7 + s * _C9))))
    small = t * (ONE - s * (np.float32(1 / 3) - s * (np.float32(0.2) - s * np.float32(1 / 7))))
    angle = small if s < np.float32(0.04) else angle
    angle = _HALF_PI - angle if steep else angle
    return TWO * angle if z >= np.float32(0) else -TWO * angle
