"""Pictures that overlap joined in their gradients, so that no seam is left.

Where views differ in brightness, a weighted mean shows a step at the border of each. Here every
texel takes its gradient from the view that sees it best, and the picture is that of least squares
which has these gradients and stays near the mean: the screened Poisson equation (Perez et al.
2003, Bhat et al. 2008), solved by cosine transforms with free borders.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hairkit.arrays import Float32Array, Float64Array

REACH = 40.0
"""Texels beyond which the result follows the mean rather than the gradients: 40 mm."""
LEAST = 1e-6
"""Least weight that is divided by."""


def join_gradients(
    mean: Float32Array, pictures: Sequence[Float32Array], shares: Sequence[Float32Array]
) -> Float32Array:
    """Return the picture (H, W, C) with the gradients of several, near their mean.

    Parameters
    ----------
    mean
        (H, W, C) defined everywhere.
    pictures
        (H, W, C) each.
    shares
        (H, W) weight of each picture's gradients; where all are 0 the mean's gradients count.

    Returns
    -------
    joined
        The minimum of |grad f - g|^2 + |f - mean|^2 / `REACH`^2.
    """
    from scipy.fft import dctn, idctn

    height, width = mean.shape[:2]
    wanted = mean.astype(np.float64) / REACH**2
    for axis in (0, 1):
        wanted -= _divergence(_gradients(mean, pictures, shares, axis), axis)
    waves = [2 - 2 * np.cos(np.pi * np.arange(count) / count) for count in (height, width)]
    factor = waves[0][:, None] + waves[1][None] + 1 / REACH**2
    solved = idctn(dctn(wanted, axes=(0, 1)) / factor[..., None], axes=(0, 1))
    return np.asarray(solved, np.float32)


def _gradients(
    mean: Float32Array,
    pictures: Sequence[Float32Array],
    shares: Sequence[Float32Array],
    axis: int,
) -> Float64Array:
    """Return the differences of neighbours along an axis, of the pictures that show both."""
    total = np.zeros(_pairs(shares[0], axis, np.minimum).shape)
    mixed = np.zeros((*total.shape, mean.shape[2]))
    for picture, share in zip(pictures, shares, strict=True):
        both = _pairs(share, axis, np.minimum)
        total += both
        mixed += both[..., None] * np.diff(picture, axis=axis)
    own = np.diff(mean, axis=axis).astype(np.float64)
    found = mixed / np.maximum(total, LEAST)[..., None]
    return np.asarray(np.where(total[..., None] > LEAST, found, own), np.float64)


def _pairs(values: Float32Array, axis: int, join: np.ufunc) -> Float32Array:
    """Return what neighbours along an axis have in common."""
    first, second = [slice(None)] * 2, [slice(None)] * 2
    first[axis], second[axis] = slice(None, -1), slice(1, None)
    return np.asarray(join(values[tuple(first)], values[tuple(second)]), np.float32)


def _divergence(gradients: Float64Array, axis: int) -> Float64Array:
    """Return the divergence (H, W, C) along an axis; nothing flows over the borders."""
    around = [(0, 0)] * gradients.ndim
    around[axis] = (1, 1)
    return np.asarray(np.diff(np.pad(gradients, around), axis=axis))
