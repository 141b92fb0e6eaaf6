"""Regions of common colour, which are synthesised one by one and blended at their borders.

A face has areas of different skin: lips, cheeks, chin. Both pictures are divided by the same mean
colours (k-means in CIELAB of the blurred texture), and each area of the texture is synthesised from
that area of the example alone.
"""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Int32Array

SHARE_OF_EDGE = 1 / 64
"""Width of the blur before colours are compared, by the texture's shorter side."""
LEAST_SHARE = 0.01
"""Share of the example that an area must have, below which the whole example is used for it."""
_ROUNDS, _TOLERANCE, _TRIES, _SEED = 30, 0.1, 3, 1
"""Of k-means: rounds at most, moves of the means in CIELAB at which it ends, starts, and their
seed."""


def find_regions(
    texture: Float32Array, example: Float32Array, count: int
) -> tuple[Int32Array, Int32Array]:
    """Return the regions (h, w) of a texture and (H, W) of its example, numbers below `count`.

    Both pictures are RGB (h, w, 3) from 0 to 1.
    """
    colours = _smooth_lab(texture)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, _ROUNDS, _TOLERANCE)
    cv2.setRNGSeed(_SEED)
    labels = np.zeros((colours.shape[0] * colours.shape[1], 1), np.int32)
    _, labels, means = cv2.kmeans(
        colours.reshape(-1, 3), count, labels, criteria, _TRIES, cv2.KMEANS_PP_CENTERS
    )
    others = _smooth_lab(example)
    nearest = np.square(others[:, :, None] - means).sum(axis=-1).argmin(axis=-1)
    return labels.reshape(colours.shape[:2]).astype(np.int32), nearest.astype(np.int32)


def allowed_pixels(regions: Int32Array, number: int) -> BoolArray:
    """Return (H, W) where the example may be used for a region: there, or everywhere if small."""
    inside = regions == number
    return inside if inside.mean() >= LEAST_SHARE else np.ones_like(inside)


def blend_weights(regions: Int32Array, count: int, border: int) -> Float32Array:
    """Return (N, h, w) the weight of each region: 1 inside, linear over `border` pixels, sum 1.

    A mean over a square of `border` pixels makes the step at a straight edge a linear ramp.
    """
    size = (2 * (border // 2) + 1,) * 2
    ramps = [
        cv2.blur((regions == n).astype(np.float32), size, borderType=cv2.BORDER_REPLICATE)
        for n in range(count)
    ]
    weights = np.stack(ramps).clip(0)
    weights[weights < np.float32(1 / (size[0] * size[1] + 1))] = 0  # round-off of the running sums
    return np.asarray(weights / weights.sum(axis=0), np.float32)


def _smooth_lab(image: Float32Array) -> Float32Array:
    sigma = max(min(image.shape[:2]) * SHARE_OF_EDGE, 1.0)
    return np.asarray(cv2.cvtColor(cv2.GaussianBlur(image, (0, 0), sigma), cv2.COLOR_RGB2LAB))
