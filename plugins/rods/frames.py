"""Turns of frames, for kernels."""

from __future__ import annotations

import math

import numpy as np

from hairkit.simulation import vectors as v
from hairkit.simulation.vectors import ONE, ZERO, Frame, Number, Vector, inlined

THIRD, THREE, FOUR, NINE_FIFTHS = (np.float32(c) for c in (1 / 3, 3, 4, 9 / 5))
OPPOSITE = np.float32(1e-4)
"""Least 1 + cosine between an axis and where it is swung to."""


@inlined
def swing_frame(q: Frame, way: Vector) -> Frame:
    """Rotate a frame by the shortest arc that brings its third axis to `way`; normalise it."""
    axis = v.third_axis(q)
    about = v.cross(axis, way)
    return v.unit(v.product((max(ONE + v.dot(axis, way), OPPOSITE), *about), q))


@inlined
def half_way(a: Frame, b: Frame, bend: Vector) -> tuple[Vector, Vector]:
    """Return `bend` rotated by the frame half way from a to b, and the axis of b a^-1.

    The axis is as long as the tangent of a quarter of its angle. The sum of two unit quaternions
    has the square 2 + 2 w, w their product.
    """
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = -ONE if w < ZERO else ONE
    over = ONE / (ONE + sign * w)
    va, vb = (a[1], a[2], a[3]), (b[1], b[2], b[3])
    axis = v.plus(va, v.times(sign, vb))
    aside = v.cross(axis, bend)
    turn = v.plus(v.times(a[0] + sign * b[0], aside), v.cross(axis, aside))
    vector = v.minus(v.minus(v.times(a[0], vb), v.times(b[0], va)), v.cross(vb, va))
    return v.plus(bend, v.times(over, turn)), v.times(sign * over, vector)


@inlined
def twist_angle(a: Frame, b: Frame) -> Number:
    """Return twice the angle of (w, z) of a^-1 b: the twist between frames, radians.

    Four times the arc tangent of u, the tangent of a quarter of it, by the continued fraction
    u (1 - u^2 / (3 + 9 u^2 / 5)): off by 5e-5 of it up to a quarter turn, 0.8 % at half a turn.
    """
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    size = math.sqrt(w * w + z * z)
    u = z / (w - size if w < ZERO else w + size)
    angle: Number = FOUR * u * (ONE - u * u / (THREE + NINE_FIFTHS * u * u))
    return angle
