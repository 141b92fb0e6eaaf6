"""Gaussian smoothing of curves that keeps their ends."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array


def smooth_curves(points: Float32Array, sigma: npt.ArrayLike) -> Float32Array:
    """Return curves (S, m, 3) under a Gaussian of `sigma`, (S,) or one, in shares of their length.

    Points are taken to be evenly spaced. Beyond each end a curve is continued by its own image,
    turned by half a turn about that end. So ends and straight curves stay, and the offset from the
    chord is a sum of sines, each of which the Gaussian scales.
    """
    count = points.shape[1]
    t = np.linspace(0, 1, count, dtype=np.float32)
    chord = points[:, :1] + t[:, None] * (points[:, -1:] - points[:, :1])
    waves = np.arange(1, count - 1)
    sines = np.sin(np.pi * np.outer(t[1:-1], waves)).astype(np.float32)
    kept = np.exp(-0.5 * (np.pi * np.multiply.outer(sigma, waves)) ** 2) * 2 / (count - 1)
    amounts = kept[..., None].astype(np.float32) * (sines.T @ (points - chord)[:, 1:-1])
    chord[:, 1:-1] += sines @ amounts
    return chord
