"""Smallest eigenvectors of many symmetric 3x3 tensors, in closed form."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled, compiled_with, parallel_for
from hairkit.types.volume import XX, XY, XZ, YY, YZ, ZZ

ROUND_OFF = 1e-24
"""Squares of cross products below this share of the fourth power of the tensor are round-off."""
LEAST_SPREAD = 1e-15
"""Tensors that differ less than this from a multiple of the identity have one eigenvalue."""
MIN_TENSORS = 2048
"""Least number of tensors that are worth another thread."""


def smallest_eigenvectors(tensors: npt.ArrayLike) -> tuple[Float64Array, Float64Array]:
    """Return unit vectors (N, 3) of the smallest eigenvalue, and its gap (N,) to the middle one.

    `tensors` (N, 6) are symmetric, in the order of `hairkit.types.volume.TENSOR_INDICES`.
    Eigenvalues by the trigonometric solution of the cubic (Smith 1961, "Eigenvalues of a symmetric
    3 x 3 matrix"), vectors by the largest cross product of two rows of T - l I. Where the two
    smallest eigenvalues agree the vector is any of their plane. `numpy.linalg.eigh` is the twin.
    """
    six = np.ascontiguousarray(tensors, np.float64)
    vectors, gaps = np.empty((len(six), 3)), np.empty(len(six))
    parallel_for(_solve_tensors, len(six), six, vectors, gaps, min_chunk=MIN_TENSORS)
    return vectors, gaps


@compiled
def _solve_tensors(
    first: int, last: int, six: Float64Array, vectors: Float64Array, gaps: Float64Array
) -> None:
    """Write vectors (N, 3) and gaps (N,) of the tensors (N, 6) from `first` to `last`."""
    for i in range(first, last):
        low, middle = _two_eigenvalues(six[i])
        gaps[i] = max(middle - low, 0.0)
        _null_vector(six[i], low, vectors[i])


@compiled
def _two_eigenvalues(t: Float64Array) -> tuple[float, float]:
    """Return the smallest and the middle eigenvalue of a tensor (6,) (Smith 1961)."""
    mean = (t[XX] + t[YY] + t[ZZ]) / 3
    off = t[XY] ** 2 + t[XZ] ** 2 + t[YZ] ** 2
    a, b, c = t[XX] - mean, t[YY] - mean, t[ZZ] - mean
    spread = math.sqrt((a * a + b * b + c * c + 2 * off) / 6)
    if spread < LEAST_SPREAD:
        return mean, mean
    a, b, c = a / spread, b / spread, c / spread
    d, e, f = t[XY] / spread, t[XZ] / spread, t[YZ] / spread
    half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / 2
    angle = math.acos(min(max(half, -1.0), 1.0)) / 3
    high = mean + 2 * spread * math.cos(angle)
    low = mean + 2 * spread * math.cos(angle + 2 * math.pi / 3)
    return low, 3 * mean - high - low


@compiled_with(allocates=True)
def _null_vector(t: Float64Array, value: float, result: Float64Array) -> None:
    """Write the unit vector that T - value I maps nearest to zero into result (3,)."""
    rows = np.empty((3, 3))
    rows[0, 0], rows[0, 1], rows[0, 2] = t[XX] - value, t[XY], t[XZ]
    rows[1, 0], rows[1, 1], rows[1, 2] = t[XY], t[YY] - value, t[YZ]
    rows[2, 0], rows[2, 1], rows[2, 2] = t[XZ], t[YZ], t[ZZ] - value
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += rows[i, j] ** 2
    result[0], result[1], result[2] = 1.0, 0.0, 0.0
    if not _largest_cross_product(rows, ROUND_OFF * total * total, result) and total > 0.0:
        _perpendicular(rows, total, result)


@compiled
def _largest_cross_product(rows: Float64Array, least: float, result: Float64Array) -> bool:
    """Write the largest cross product of two rows (3, 3), as a unit vector, if above `least`."""
    best = least
    for k in range(3):
        p, q = rows[k], rows[(k + 1) % 3]
        x, y, z = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
        square = x * x + y * y + z * z
        if square > best:
            best = square
            norm = math.sqrt(square)
            result[0], result[1], result[2] = x / norm, y / norm, z / norm
    return best > least


@compiled
def _perpendicular(rows: Float64Array, total: float, result: Float64Array) -> None:
    """Write a unit vector perpendicular to the one direction that rows (3, 3) of rank one have."""
    for k in range(3):
        x, y, z = rows[k, 0], rows[k, 1], rows[k, 2]
        if x * x + y * y + z * z >= total / 3:
            if abs(x) < abs(y):
                x, y, z = 0.0, z, -y
            else:
                x, y, z = z, 0.0, -x
            norm = math.sqrt(x * x + y * y + z * z)
            if norm > 0.0:
                result[0], result[1], result[2] = x / norm, y / norm, z / norm
            return
