"""Smallest eigenvectors of many symmetric 3x3 tensors, in closed form."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.types.volume import symmetric_matrices

ROUND_OFF = 1e-12
"""Minors below this share of the square of the tensor are round-off."""
LEAST_SPREAD = 1e-15
"""Tensors that differ less than this from a multiple of the identity have one eigenvalue."""


def smallest_eigenvectors(tensors: npt.ArrayLike) -> tuple[Float64Array, Float64Array]:
    """Return unit vectors (N, 3) of the smallest eigenvalue, and its gap (N,) to the middle one.

    `tensors` (N, 6) are symmetric, in the order of `hairkit.types.volume.TENSOR_INDICES`.
    Eigenvalues by the trigonometric solution of the cubic (Smith 1961, "Eigenvalues of a symmetric
    3 x 3 matrix"), vectors by the largest column of the adjugate of T - l I. Where the two smallest
    eigenvalues agree the vector is any of their plane. `numpy.linalg.eigh`, five times as slow, has
    them there.
    """
    six = np.asarray(tensors, np.float64)
    xx, yy, zz, xy, xz, yz = six.T.copy()
    low, middle = _two_eigenvalues(xx, yy, zz, xy, xz, yz)
    for diagonal in (xx, yy, zz):
        diagonal -= low
    minors = np.stack([yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy])
    beside = np.stack([xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - yz * xx])  # xy, xz, yz
    largest = minors.argmax(axis=0)
    columns = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])[largest]
    vectors = np.take_along_axis(np.concatenate([minors, beside]).T, columns, axis=1)
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    lost = length <= ROUND_OFF * (six * six).sum(axis=1)
    vectors /= np.where(lost, 1, length)[:, None]
    vectors[lost] = np.linalg.eigh(symmetric_matrices(six[lost]))[1][..., 0]
    return vectors, np.maximum(middle - low, 0)


def _two_eigenvalues(*t: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return the smallest and the middle eigenvalues (N,) of components xx to yz (Smith 1961)."""
    xx, yy, zz, d, e, f = t
    mean = (xx + yy + zz) / 3
    a, b, c = xx - mean, yy - mean, zz - mean
    spread = np.sqrt((a * a + b * b + c * c + 2 * (d * d + e * e + f * f)) / 6)
    half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / 2
    half /= np.maximum(spread, LEAST_SPREAD) ** 3
    angle = np.arccos(np.clip(half, -1, 1)) / 3
    high = mean + 2 * spread * np.cos(angle)
    low = mean + 2 * spread * np.cos(angle + 2 * np.pi / 3)
    return low, 3 * mean - high - low
