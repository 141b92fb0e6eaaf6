"""Bump maps of albedo, normal maps of heights, and pictures of the difference of two textures."""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.errors import DataError

_SCHARR_GAIN = 32.0
"""Response of `cv2.Scharr` to a slope of one per pixel."""
FULL_COLOUR = 32.0
"""Levels of 255 at which a difference has its full colour."""
_BRIGHTER, _DARKER = np.array([178.0, 24.0, 43.0]), np.array([33.0, 102.0, 172.0])
"""Colours of differences: the ends of ColorBrewer's scale RdBu."""


def bump_from_albedo(pixels: UInt8Array) -> UInt8Array:
    """Return heights (H, W) of an albedo (H, W, 3): its luminance with an even histogram.

    Dark is taken for deep, which holds for pores and folds, and not for moles, brows and lips.
    """
    return np.asarray(cv2.equalizeHist(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)), np.uint8)


def normal_from_height(height: UInt8Array, depth: float) -> UInt8Array:
    """Return the normal map (H, W, 3) of heights (H, W), in the order of OpenGL and glTF.

    Over texture coordinates u to the right and v up, the surface z = h(u, v) has the normal
    (-dh/du, -dh/dv, 1), brought to length 1.

    Parameters
    ----------
    height
        0 is the lowest, 255 the highest.
    depth
        Height of 255 over 0, in pixels of the map.

    >>> normal_from_height(np.zeros((1, 1), np.uint8), 4.0)
    array([[[128, 128, 255]]], dtype=uint8)
    """
    surface = height.astype(np.float32) * np.float32(depth / 255)
    along_u = cv2.Scharr(surface, cv2.CV_32F, 1, 0, borderType=cv2.BORDER_REPLICATE)
    along_row = cv2.Scharr(surface, cv2.CV_32F, 0, 1, borderType=cv2.BORDER_REPLICATE)
    slope = np.stack([-along_u, along_row], axis=-1) / _SCHARR_GAIN  # v runs against the rows
    normal = np.concatenate([slope, np.ones_like(slope[..., :1])], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(np.rint(255 * (0.5 + 0.5 * normal)), np.uint8)


def draw_difference(before: UInt8Array, after: UInt8Array) -> UInt8Array:
    """Return the difference of two textures in false colours: brighter red, darker blue.

    `before` is enlarged to the size of `after`. White is no difference, full colour is
    `FULL_COLOUR` levels of luminance and more. Raises `DataError` for pictures of other shapes.
    """
    if before.shape[0] * after.shape[1] != before.shape[1] * after.shape[0]:
        raise DataError(
            f"{before.shape[1]} x {before.shape[0]} and {after.shape[1]} x {after.shape[0]} pixels:"
            " pictures of different shapes have no difference"
        )
    if before.shape != after.shape:
        size = after.shape[1::-1]
        before = np.asarray(cv2.resize(before, size, interpolation=cv2.INTER_CUBIC), np.uint8)
    change = _luminance(after) - _luminance(before)
    share = np.clip(np.abs(change) / FULL_COLOUR, 0, 1)[..., None]
    colour = np.where(change[..., None] > 0, _BRIGHTER, _DARKER)
    return np.asarray(np.rint(255 + share * (colour - 255)), np.uint8)


def _luminance(pixels: UInt8Array) -> Float64Array:
    return cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY).astype(np.float64)
