"""The L D L^T factor of the substep's banded matrix, in the layout of the float32 backends."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array


def banded_factor(bands: Float64Array) -> Float64Array:
    """Return L D L^T of matrices with two lower bands (S, m, 3): both lower entries and 1/D."""
    result = np.zeros_like(bands)
    pivot = np.ones((len(bands), bands.shape[1] + 2))
    first = np.zeros(pivot.shape)
    for j in range(bands.shape[1]):
        own, one, two = bands[:, j, 0], bands[:, j, 1], bands[:, j, 2]
        second = two / pivot[:, j]  # the pivot of row j - 2 is at index j
        first[:, j + 2] = (one - second * pivot[:, j] * first[:, j + 1]) / pivot[:, j + 1]
        pivot[:, j + 2] = own - first[:, j + 2] ** 2 * pivot[:, j + 1] - second**2 * pivot[:, j]
        result[:, j] = np.stack([first[:, j + 2], second, 1 / pivot[:, j + 2]], axis=-1)
    return result
