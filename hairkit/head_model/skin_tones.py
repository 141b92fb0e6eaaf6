"""The tones of skin: which colours are skin, and tones extended to where no skin is seen."""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.head_model.exposures import FLOOR

SKIN_SPREAD = (0.35, 0.12, 0.12)
"""Spread of skin in one photo: logarithms of green, and of red and blue over green."""
STEP = 4
"""Texels between those at which the tone of skin is measured."""
TONE_REACH, TONE_REACHES = 1.0, 6
"""Sigma of the least of the convolutions that extend tones, texels, and how many there are."""
TONE_TRUST = 1e-3
"""Weight of a convolution's result beside that of the next larger one."""
LEAST = 1e-6
"""Least weight that colours are divided by."""


def like_skin(
    colours: Float32Array | UInt8Array, weight: Float32Array, known: BoolArray | None = None
) -> Float32Array:
    """Return (T, T) how much colours are like most of the seen ones, 0 where none is seen.

    Collars are not skin. `known` are texels whose brighter half is, as brows and beards are not;
    None: what is seen best.
    """
    seen = weight > 0
    red, green, blue = np.log(np.maximum(colours[seen], 0).T + np.float32(FLOOR))
    tones = [green, red - green, blue - green]
    best = weight[seen] > 0.5
    if known is not None and (best & known[seen]).any():
        best &= known[seen]
        best &= green >= np.median(green[best])
    sure = [tone[best][::STEP] for tone in tones]
    away = [
        (tone - (np.median(known) if len(known) else np.float32(0))) / np.float32(spread)
        for tone, known, spread in zip(tones, sure, SKIN_SPREAD, strict=True)
    ]
    likeness = np.zeros(weight.shape, np.float32)
    likeness[seen] = np.exp(-0.5 * (away[0] ** 2 + away[1] ** 2 + away[2] ** 2))
    return likeness


def extend_tones(values: Float32Array, weight: Float32Array) -> Float32Array:
    """Return values (H, W, C) smoothed by their weights (H, W), and extended to where those are 0.

    Normalised convolution (Knutsson and Westin 1993) with Gaussians of doubled reach, on maps of
    halved edge: each gives its result where the smaller ones have found nothing.
    """
    level = np.concatenate([values * weight[..., None], weight[..., None]], axis=-1)
    sums = level.sum(axis=(0, 1))
    size, mixed = weight.shape[::-1], np.zeros_like(level)
    trust, further = 1.0, TONE_REACH
    for number in range(TONE_REACHES):
        level = cv2.GaussianBlur(level, (0, 0), further)
        larger = cv2.resize(level, size, interpolation=cv2.INTER_LINEAR)
        mixed = cv2.scaleAdd(larger, trust, mixed)
        trust *= TONE_TRUST
        further = 3**0.5 * TONE_REACH  # squares of sigmas add up: 1 + 3 is that of twice the reach
        if number:
            half = [(count + 1) // 2 for count in level.shape[1::-1]]
            level = cv2.resize(level, half, interpolation=cv2.INTER_AREA)
    mean, floor = sums[:-1] / max(sums[-1], LEAST), trust * TONE_TRUST
    return np.asarray((mixed[..., :-1] + floor * mean) / (mixed[..., -1:] + floor), np.float32)
