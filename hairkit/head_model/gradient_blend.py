"""Pictures that overlap joined in their gradients, so that no seam is left.

Where views differ in brightness, a weighted mean shows a step at the border of each. Here every
texel takes its gradient from the view that sees it best, and the picture is that of least squares
which has these gradients and stays near the mean: the screened Poisson equation (Perez et al.
2003, Bhat et al. 2008), solved by cosine transforms with free borders.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from hairkit.arrays import Float32Array, UInt8Array

REACH = 40.0
"""Texels beyond which the result follows the mean rather than the gradients: 40 mm."""
BAND = 3.0
"""Sigma between coarse colours and details, texels: 3 mm."""
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
    wanted = mean / np.float32(REACH**2)
    for axis in (0, 1):
        wanted -= _divergence(_gradients(mean, pictures, shares, axis), axis)
    waves = [2 - 2 * np.cos(np.pi * np.arange(count) / count) for count in (height, width)]
    factor = (waves[0][:, None] + waves[1][None] + 1 / REACH**2).astype(np.float32)
    solved = idctn(dctn(wanted, axes=(0, 1)) / factor[..., None], axes=(0, 1))
    return np.asarray(solved, np.float32)


def smooth_seen(
    picture: Float32Array | UInt8Array, weight: Float32Array, gain: Float32Array
) -> Float32Array:
    """Return (H, W, 3) a picture times its gain (3,) without details, of what has weight alone."""
    smooth = np.zeros(picture.shape, np.float32)
    part = smallest_window(weight, round(4 * BAND))
    within = (weight[part] > 0).astype(np.float32)
    if within.any():
        blurred = cv2.GaussianBlur(picture[part] * gain * within[..., None], (0, 0), BAND)
        share = cv2.GaussianBlur(within, (0, 0), BAND)
        smooth[part] = blurred / np.maximum(share, LEAST)[..., None]
    return smooth


def smallest_window(weight: Float32Array, margin: int = 0) -> tuple[slice, slice]:
    """Return rows and columns of a picture (H, W) that hold all weights above 0, and a margin.

    Both are empty where no weight is.
    """
    lines = [np.flatnonzero(weight.max(axis=axis) > 0) for axis in (1, 0)]
    if not len(lines[0]):
        return slice(0, 0), slice(0, 0)
    rows, columns = (slice(max(at[0] - margin, 0), at[-1] + 1 + margin) for at in lines)
    return rows, columns


def _gradients(
    mean: Float32Array, pictures: Sequence[Float32Array], shares: Sequence[Float32Array], axis: int
) -> Float32Array:
    """Return the differences of neighbours along an axis, of the pictures that show both."""
    gradients = np.diff(mean, axis=axis)
    total = np.zeros(gradients.shape[:2], np.float32)
    mixed = np.zeros_like(gradients)
    for picture, share in zip(pictures, shares, strict=True):
        part = smallest_window(share)
        both = _pairs(share[part], axis)
        rows, columns = (slice(w.start, w.start + n) for w, n in zip(part, both.shape, strict=True))
        total[rows, columns] += both
        mixed[rows, columns] += both[..., None] * np.diff(picture[part], axis=axis)
    known = total > LEAST
    gradients[known] = mixed[known] / total[known][:, None]
    return gradients


def _pairs(values: Float32Array, axis: int) -> Float32Array:
    """Return the smaller of neighbours along an axis."""
    first, second = [slice(None)] * 2, [slice(None)] * 2
    first[axis], second[axis] = slice(None, -1), slice(1, None)
    return np.asarray(np.minimum(values[tuple(first)], values[tuple(second)]), np.float32)


def _divergence(gradients: Float32Array, axis: int) -> Float32Array:
    """Return the divergence (H, W, C) along an axis; nothing flows over the borders."""
    around = [(0, 0)] * gradients.ndim
    around[axis] = (1, 1)
    return np.asarray(np.diff(np.pad(gradients, around), axis=axis))
