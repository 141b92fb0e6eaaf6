"""Gaussian pyramids, padded so that every window around a pixel lies inside."""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import Float32Array

RADIUS = 2
"""Pixels from the middle to the edge of the window at a pixel's own level: 5 x 5."""
PADDING = RADIUS
"""Pixels around every image of a pyramid."""
SMALLEST = 8
"""Pixels of the shorter side below which there is no further level."""


def build_pyramid(image: Float32Array, levels: int) -> list[Float32Array]:
    """Return an image (H, W, C) and its halvings, the finest first, not padded."""
    pyramid = [image]
    for _ in range(levels - 1):
        smaller = np.asarray(cv2.pyrDown(pyramid[-1]), np.float32)
        pyramid.append(smaller.reshape(*smaller.shape[:2], image.shape[2]))
    return pyramid


def count_levels(levels: int, *images: Float32Array) -> int:
    """Return how many levels of at least `SMALLEST` pixels all images have, `levels` at most."""
    shortest = min(min(image.shape[:2]) for image in images)
    return max(1, min(levels, int(np.log2(max(shortest / SMALLEST, 1.0))) + 1))


def pad(image: Float32Array) -> Float32Array:
    """Return an image (H, W, C) with `PADDING` pixels around, repeating its edge."""
    around = (PADDING, PADDING)
    return np.ascontiguousarray(np.pad(image, (around, around, (0, 0)), "edge"))


def enlarge(image: Float32Array, shape: tuple[int, ...]) -> Float32Array:
    """Return an image (h, w, C) interpolated to `shape` = (H, W, C)."""
    larger = cv2.resize(image, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    return np.asarray(larger, np.float32).reshape(shape)
