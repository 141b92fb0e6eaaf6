"""Neighbourhood features of a pixel, and the weighted distance between two of them.

The feature of pixel p is its window in the source image, at its own level and the next coarser one,
then its window in the filtered image: at its own level only the pixels before p in scan order, at
the coarser level all (Hertzmann et al. 2001, section 3.1). Each of the four windows has the weights
of a Gaussian, which sum up to 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Int32Array
from hairkit.parallel import compiled

from .pyramid import PADDING, RADIUS, pad

COARSE_RADIUS = 1
"""Pixels from the middle to the edge of the window at the coarser level: 3 x 3."""
_FINE = (2 * RADIUS + 1) ** 2
"""Pixels of the window at the pixel's own level."""
_BEFORE = _FINE // 2
"""Pixels of that window before its middle, in scan order."""
_COARSE = (2 * COARSE_RADIUS + 1) ** 2
"""Pixels of the window at the coarser level."""
_SIGMA = {RADIUS: 1.2, COARSE_RADIUS: 0.8}
"""Gaussian over a window by its radius, pixels of its level."""


class Pair(NamedTuple):
    """An image and its filtered twin at one level and at the next coarser one, as one array."""

    values: Float32Array
    """The four padded images (H + 4, W + 4, C) one after the other: source, coarse source,
    filtered, coarse filtered."""
    offsets: Int32Array
    """(D,) where the numbers of a feature are, from the start of the pixel's row and column."""
    filtered: int
    """Where the pixel of the first row and column of the filtered image is."""
    channels: int
    row: int
    """Numbers in a row of the fine images."""
    coarse_row: int
    """Numbers in a row of the coarse images."""


def make_pair(
    source: Float32Array,
    filtered: Float32Array,
    coarse_source: Float32Array | None,
    coarse_filtered: Float32Array | None,
) -> Pair:
    """Return the pair of images (H, W, C) and of their halves, None at the coarsest level."""
    if coarse_source is None or coarse_filtered is None:
        half = (-(-source.shape[0] // 2), -(-source.shape[1] // 2), source.shape[2])
        coarse_source = coarse_filtered = np.zeros(half, np.float32)
    images = [pad(i) for i in (source, coarse_source, filtered, coarse_filtered)]
    starts = np.cumsum([0, *(image.size for image in images)])
    channels = source.shape[2]
    row, coarse_row = (image.shape[1] * channels for image in images[:2])
    fine = _window(RADIUS, row, channels)
    coarse = _window(COARSE_RADIUS, coarse_row, channels)
    before = fine[: _BEFORE * channels]
    parts = zip(starts, (fine, coarse, before, coarse), strict=False)
    return Pair(
        np.concatenate([image.ravel() for image in images]),
        np.concatenate([start + part for start, part in parts]).astype(np.int32),
        int(starts[2]) + PADDING * (row + channels),
        channels,
        row,
        coarse_row,
    )


def filtered_image(pair: Pair, height: int, width: int) -> Float32Array:
    """Return the filtered image (H, W, C) of a pair."""
    wide = (height + 2 * PADDING, width + 2 * PADDING, pair.channels)
    start = pair.filtered - PADDING * (pair.row + pair.channels)
    padded = pair.values[start : start + int(np.prod(wide))].reshape(wide)
    return padded[PADDING:-PADDING, PADDING:-PADDING].copy()


def _window(radius: int, row: int, channels: int) -> Int32Array:
    """Return where the numbers of a window are, from the start of its middle's row and column."""
    along = PADDING + np.arange(-radius, radius + 1)
    place = along[:, None, None] * row + along[:, None] * channels + np.arange(channels)
    return np.asarray(place.ravel(), np.int32)


def feature_weights(channels: int, alpha: float | None, *, coarsest: bool) -> Float32Array:
    """Return (D,) the square roots of the weights of a feature's numbers, in their order.

    Parameters
    ----------
    channels
        Numbers of a pixel.
    alpha
        Weight of the filtered image against the source, 0 to 1 (Graham et al. 2013); None weights
        both fully.
    coarsest
        There is no coarser level, so the weights of its windows are 0.
    """
    fine, coarse = _gaussian(RADIUS), _gaussian(COARSE_RADIUS) * (not coarsest)
    before = fine[:_BEFORE] / fine[:_BEFORE].sum()
    source, filtered = (1.0, 1.0) if alpha is None else (1 - alpha, alpha)
    parts = [source * fine, source * coarse, filtered * before, filtered * coarse]
    weights = np.repeat(np.concatenate(parts) / channels, channels)
    return np.sqrt(weights).astype(np.float32)


def source_size(channels: int) -> int:
    """Return how many of a feature's numbers are of the source image; they come first."""
    return int((_FINE + _COARSE) * channels)


def _gaussian(radius: int) -> Float32Array:
    offset = np.arange(-radius, radius + 1)
    along = np.exp(-(offset**2) / (2 * _SIGMA[radius] ** 2))
    window = np.outer(along, along).ravel()
    return np.asarray(window / window.sum(), np.float32)


@compiled
def gather_feature(
    pair: Pair, row: int, column: int, roots: Float32Array, feature: Float32Array
) -> None:
    """Write the weighted feature (D,) of a pixel; `roots` (D,) are of `feature_weights`."""
    fine = row * pair.row + column * pair.channels
    coarse = row // 2 * pair.coarse_row + column // 2 * pair.channels
    first, second = _FINE * pair.channels, (_FINE + _COARSE) * pair.channels
    third = second + _BEFORE * pair.channels
    for i in range(first):
        feature[i] = roots[i] * pair.values[fine + pair.offsets[i]]
    for i in range(first, second):
        feature[i] = roots[i] * pair.values[coarse + pair.offsets[i]]
    for i in range(second, third):
        feature[i] = roots[i] * pair.values[fine + pair.offsets[i]]
    for i in range(third, len(roots)):
        feature[i] = roots[i] * pair.values[coarse + pair.offsets[i]]


@compiled
def squared_distance(first: Float32Array, second: Float32Array) -> float:
    """Return the squared distance of two weighted features (D,)."""
    even, odd = np.float32(0.0), np.float32(0.0)  # two sums: half the time of a chain of additions
    for i in range(len(first) // 2):
        difference, other = first[2 * i] - second[2 * i], first[2 * i + 1] - second[2 * i + 1]
        even += difference * difference
        odd += other * other
    if len(first) % 2:
        even += (first[-1] - second[-1]) ** 2
    return float(even + odd)
