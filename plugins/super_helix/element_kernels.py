"""Compiled kinematics of one element; hairkit.helices.helix has what they are made of."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled, compiled_with

_TERMS = 10
"""Terms of the series below x = 1: the next is below rounding."""
_SMALL, _SMALL_TERMS = 0.02, 5
_MIDDLE, _MIDDLE_TERMS = 0.25, 7
"""Squared angles below which fewer terms reach rounding."""
_SINE, _VERSINE, _REST = (
    np.array([(-1) ** k / math.factorial(2 * k + order) for k in range(_TERMS)])
    for order in (1, 2, 3)
)
_VERSINE_SLOPE, _REST_SLOPE = (
    np.array([2 * (k + 1) * series[k + 1] for k in range(_TERMS - 1)])
    for series in (_VERSINE, _REST)
)


@compiled
def _sum(series: npt.NDArray[np.float64], x: float, terms: int) -> float:
    total = 0.0
    for k in range(terms - 1, -1, -1):
        total = total * x + series[k]
    return total


@compiled_with(inside=True)
def coefficients(x: float) -> tuple[float, float, float, float, float]:
    """Return sin(a)/a, (1 - cos a)/a^2, (a - sin a)/a^3 and slopes of the last two, x = a^2."""
    if x < 1.0:
        terms = _SMALL_TERMS if x < _SMALL else _MIDDLE_TERMS if x < _MIDDLE else _TERMS - 1
        return (
            _sum(_SINE, x, terms + 1),
            _sum(_VERSINE, x, terms),
            _sum(_REST, x, terms),
            _sum(_VERSINE_SLOPE, x, terms),
            _sum(_REST_SLOPE, x, terms),
        )
    angle = math.sqrt(x)
    sine = math.sin(angle) / angle
    versine = 2 * math.sin(angle / 2) ** 2 / x
    rest = (1 - sine) / x
    return sine, versine, rest, (sine - 2 * versine) / x, (versine - 3 * rest) / x


@compiled
def node(q: Float64Array, s: float, local: Float64Array, slope: Float64Array) -> None:
    """Write the point at arc length s in the element's frame, and its derivative by q."""
    a, b, c = s * q[0], s * q[1], s * q[2]
    x = a * a + b * b + c * c
    _, versine, rest, versine_slope, rest_slope = coefficients(x)
    bent = -(b * b + c * c)
    local[0] = s * (1 + rest * bent)
    local[1] = s * (versine * c + rest * a * b)
    local[2] = s * (-versine * b + rest * a * c)
    # radial part: (versine' (v x e1) + rest' (v x (v x e1))) v^T
    u0 = rest_slope * bent
    u1 = versine_slope * c + rest_slope * a * b
    u2 = -versine_slope * b + rest_slope * a * c
    square = s * s
    slope[0, 0] = square * u0 * a
    slope[0, 1] = square * (u0 * b - 2 * rest * b)
    slope[0, 2] = square * (u0 * c - 2 * rest * c)
    slope[1, 0] = square * (u1 * a + rest * b)
    slope[1, 1] = square * (u1 * b + rest * a)
    slope[1, 2] = square * (u1 * c + versine)
    slope[2, 0] = square * (u2 * a + rest * c)
    slope[2, 1] = square * (u2 * b - versine)
    slope[2, 2] = square * (u2 * c + rest * a)


@compiled
def turns(q: Float64Array, s: float, turn: Float64Array, mean: Float64Array) -> None:
    """Write the rotation at arc length s, and s times the mean rotation up to there."""
    v = (s * q[0], s * q[1], s * q[2])
    x = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    sine, versine, rest, _, _ = coefficients(x)
    for i in range(3):
        for j in range(3):
            turn[i, j] = versine * v[i] * v[j]
            mean[i, j] = s * rest * v[i] * v[j]
        turn[i, i] += 1 - versine * x
        mean[i, i] += s * (1 - rest * x)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[k, j] += sine * v[i]
        turn[j, k] -= sine * v[i]
        mean[k, j] += s * versine * v[i]
        mean[j, k] -= s * versine * v[i]


@compiled
def times(matrix: Float64Array, vector: Float64Array, result: Float64Array) -> None:
    """Write matrix (3, 3) times vector (3,)."""
    for i in range(3):
        result[i] = matrix[i, 0] * vector[0] + matrix[i, 1] * vector[1] + matrix[i, 2] * vector[2]


@compiled
def product(a: Float64Array, b: Float64Array, result: Float64Array) -> None:
    """Write a (3, 3) times b (3, 3)."""
    for i in range(3):
        for j in range(3):
            result[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@compiled_with(allocates=True, inside=True)
def advance_frame(
    q: Float64Array,
    length: float,
    frame: Float64Array,
    end: Float64Array,
    next_frame: Float64Array,
    next_end: Float64Array,
) -> None:
    """Write frame and point of an element's end from those of its start."""
    local, slope, turn, mean = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    node(q, length, local, slope)
    turns(q, length, turn, mean)
    product(frame, turn, next_frame)
    times(frame, local, next_end)
    for i in range(3):
        next_end[i] += end[i]


@compiled_with(inside=True)
def place_clamped_end(
    head: Float64Array,
    point: Float64Array,
    axes: Float64Array,
    moved: Float64Array,
    turned: Float64Array,
) -> None:
    """Write the point and frame of a clamped end on a head moved by a rigid motion (4, 4)."""
    times(head, point, moved)
    product(head, axes, turned)
    for i in range(3):
        moved[i] += head[i, 3]
