"""Smallest eigenvectors of many symmetric 3x3 tensors, in closed form."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit, prange

from hairkit.arrays import Float64Array

ROUND_OFF = 1e-24
"""Squares of cross products below this share of the fourth power of the tensor are round-off."""


def smallest_eigenvectors(tensors: npt.ArrayLike) -> tuple[Float64Array, Float64Array]:
    """Return unit vectors (N, 3) of the smallest eigenvalue, and its gap (N,) to the middle one.

    `tensors` (N, 6) are symmetric, in the order of
    `hairkit.types.volume.TENSOR_INDICES`. Eigenvalues by
    the trigonometric solution of the cubic (Smith 1961), vectors by the largest cross product of
    two rows of T - l I. Where the two smallest eigenvalues agree the vector is any of their plane.
    `numpy.linalg.eigh` is the twin that tests compare with.
    """
    six = np.ascontiguousarray(tensors, np.float64)
    vectors, gaps = np.empty((len(six), 3)), np.empty(len(six))
    _smallest(six, vectors, gaps)
    return vectors, gaps


@njit(cache=True, parallel=True)
def _smallest(six, vectors, gaps):  # type: ignore[no-untyped-def]
    for i in prange(len(six)):
        low, middle = _two_eigenvalues(six[i])
        gaps[i] = max(middle - low, 0.0)
        _null_vector(six[i], low, vectors[i])


@njit(cache=True)
def _two_eigenvalues(t):  # type: ignore[no-untyped-def]
    """Return the smallest and the middle eigenvalue."""
    mean = (t[0] + t[1] + t[2]) / 3
    off = t[3] ** 2 + t[4] ** 2 + t[5] ** 2
    a, b, c = t[0] - mean, t[1] - mean, t[2] - mean
    spread = np.sqrt((a * a + b * b + c * c + 2 * off) / 6)
    if spread < 1e-15:
        return mean, mean
    a, b, c = a / spread, b / spread, c / spread
    d, e, f = t[3] / spread, t[4] / spread, t[5] / spread
    half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / 2
    angle = np.arccos(min(max(half, -1.0), 1.0)) / 3
    high = mean + 2 * spread * np.cos(angle)
    low = mean + 2 * spread * np.cos(angle + 2 * np.pi / 3)
    return low, 3 * mean - high - low


@njit(cache=True)
def _null_vector(t, value, result):  # type: ignore[no-untyped-def]
    """Write the unit vector that T - value I maps nearest to zero into result (3,)."""
    rows = np.empty((3, 3))
    rows[0, 0], rows[0, 1], rows[0, 2] = t[0] - value, t[3], t[4]
    rows[1, 0], rows[1, 1], rows[1, 2] = t[3], t[1] - value, t[5]
    rows[2, 0], rows[2, 1], rows[2, 2] = t[4], t[5], t[2] - value
    total = np.sum(rows * rows)
    best = ROUND_OFF * total * total
    found = False
    result[0], result[1], result[2] = 1.0, 0.0, 0.0
    for k in range(3):
        p, q = rows[k], rows[(k + 1) % 3]
        x, y, z = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
        size = x * x + y * y + z * z
        if size > best:
            best = size
            found = True
            norm = np.sqrt(size)
            result[0], result[1], result[2] = x / norm, y / norm, z / norm
    if found or total == 0.0:
        return
    for k in range(3):  # rank one or none: anything square to the one direction there is
        x, y, z = rows[k, 0], rows[k, 1], rows[k, 2]
        if x * x + y * y + z * z >= total / 3:
            if abs(x) < abs(y):
                x, y, z = 0.0, z, -y
            else:
                x, y, z = z, 0.0, -x
            norm = np.sqrt(x * x + y * y + z * z)
            if norm > 0.0:
                result[0], result[1], result[2] = x / norm, y / norm, z / norm
            return
