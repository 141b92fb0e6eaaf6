"""Vectors and unit quaternions (w, x, y, z) as tuples of numbers, for compiled code.

Functions take numbers of float32 or of float64. They are compiled into their callers, so that
compilers make vector instructions of loops over many of them. Constants are float32, since Numba
takes bare literals for integers or float64, which would widen float32.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from hairkit.parallel import compiled_with

Floats = npt.NDArray[np.floating[Any]]
"""float32 or float64."""
Number = float | np.floating[Any]
Vector = tuple[Any, Any, Any]
"""x, y, z."""
Frame = tuple[Any, Any, Any, Any]
"""w, x, y, z."""
Rows = tuple[Frame, Frame, Frame]
"""The upper rows of a rigid motion (4, 4)."""
_Function = TypeVar("_Function", bound=Callable[..., Any])

ZERO, HALF, ONE, TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)


def inlined(function: _Function) -> _Function:
    """Compile a function into its callers."""
    return compiled_with(fastmath=True, forceinline=True)(function)


@inlined
def rows_of(matrix: Floats) -> Rows:
    """Return (3, 4) as tuples, which stay in registers."""
    return (
        (matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]),
        (matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]),
        (matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]),
    )


@inlined
def plus(a: Vector, b: Vector) -> Vector:
    """Return the sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def minus(a: Vector, b: Vector) -> Vector:
    """Return the difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def times(size: Number, a: Vector) -> Vector:
    """Return a multiple."""
    return size * a[0], size * a[1], size * a[2]


@inlined
def dot(a: Vector | Frame, b: Vector) -> Number:
    """Return the inner product of the first three components."""
    result: Number = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def turned(rows: Rows, a: Vector) -> Vector:
    """Return a vector under the rotation of a rigid motion."""
    return dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)


@inlined
def moved(rows: Rows, a: Vector) -> Vector:
    """Return a point under a rigid motion."""
    return dot(rows[0], a) + rows[0][3], dot(rows[1], a) + rows[1][3], dot(rows[2], a) + rows[2][3]


@inlined
def product(r: Frame, q: Frame) -> Frame:
    """Return the quaternion product r q."""
    return (
        r[0] * q[0] - r[1] * q[1] - r[2] * q[2] - r[3] * q[3],
        r[0] * q[1] + r[1] * q[0] + r[2] * q[3] - r[3] * q[2],
        r[0] * q[2] - r[1] * q[3] + r[2] * q[0] + r[3] * q[1],
        r[0] * q[3] + r[1] * q[2] - r[2] * q[1] + r[3] * q[0],
    )


@inlined
def unit(q: Frame) -> Frame:
    """Return a quaternion scaled to length 1."""
    size = ONE / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return size * q[0], size * q[1], size * q[2], size * q[3]


@inlined
def rotate(q: Frame, v: Vector) -> Vector:
    """Return a vector rotated by a unit quaternion."""
    axis = (q[1], q[2], q[3])
    turn = cross(axis, v)
    turn = plus(turn, turn)
    return plus(plus(v, times(q[0], turn)), cross(axis, turn))


@inlined
def third_axis(q: Frame) -> Vector:
    """Return the third axis of a frame."""
    return (
        TWO * (q[1] * q[3] + q[0] * q[2]),
        TWO * (q[2] * q[3] - q[0] * q[1]),
        ONE - TWO * (q[1] * q[1] + q[2] * q[2]),
    )
