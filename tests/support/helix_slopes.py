"""How the mean rotation of a helix arc changes with its rotation vector, for readable twins."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.helices.helix import SERIES_BELOW, cross_matrix, turn_coefficients

TERMS = 9
"""Of the power series."""


def turn_slopes(squared: npt.ArrayLike) -> tuple[Float64Array, Float64Array]:
    """Return the derivatives by a^2, doubled, of the second and third `turn_coefficients`.

    With f(a) such a coefficient this is f'(a)/a, the factor in df/dx = (f'(a)/a) x, a = |x|.
    """
    x = np.asarray(squared, np.float64)
    sine, versine, rest = turn_coefficients(x)
    large = np.maximum(x, SERIES_BELOW**2)
    small = np.minimum(x, SERIES_BELOW**2)
    near = x < SERIES_BELOW**2
    second = np.where(near, _series_slope(small, 2), (sine - 2 * versine) / large)
    third = np.where(near, _series_slope(small, 3), (versine - 3 * rest) / large)
    return second, third


def mean_rotation_slope(vector: npt.ArrayLike, direction: npt.ArrayLike) -> Float64Array:
    """Return (..., 3, 3) the derivative of `mean_rotation(v) d` by v: column j is by v_j."""
    v = np.asarray(vector, np.float64)
    d = np.broadcast_to(np.asarray(direction, np.float64), v.shape)
    squared = (v * v).sum(-1)
    _, versine, rest = turn_coefficients(squared)
    versine_slope, rest_slope = turn_slopes(squared)
    once = np.cross(v, d)
    twice = np.cross(v, once)
    along = (v * d).sum(-1)[..., None, None] * np.eye(3)
    mixed = along + v[..., :, None] * d[..., None, :] - 2 * d[..., :, None] * v[..., None, :]
    radial = versine_slope[..., None] * once + rest_slope[..., None] * twice
    result: Float64Array = (
        -versine[..., None, None] * cross_matrix(d)
        + rest[..., None, None] * mixed
        + radial[..., :, None] * v[..., None, :]
    )
    return result


def _series_slope(x: Float64Array, order: int) -> Float64Array:
    """Return twice the derivative of `_series` by x."""
    total = np.zeros_like(x)
    for k in range(TERMS, 0, -1):
        total = total * -x - 2 * k / math.factorial(2 * k + order)
    return total
