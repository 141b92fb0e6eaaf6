"""How hair lies between guides: in locks and wisps, with stray hairs, uneven ends and widths.

Strands lean towards the middle of their wisp and wisps towards that of their lock, as in Choe and
Ko 2005, A Statistical Wisp Model and Pseudophysical Approaches for Interactive Hairstyle
Generation. The defaults were chosen by eye beside photos of straight, curly, coily and short hair.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array, unit_vectors
from hairkit.options import option

CANDIDATES = 6
"""Middles near a strand's root among which the one that runs most alike is taken."""
SWING = 0.4
"""Slow swing of a strand about its own line, in shares of the tip's wander."""
STRAYING = 9.0
"""Wander of stray hairs over that of others."""
STRAY_WIDTH = 0.4
"""Width of stray hairs over that of others: they stand alone, where a drawn strand stands for a few
hairs elsewhere."""
MOST_WANDER, MOST_PULL = 0.2, 0.12
"""Wander of a tip, and its way to the middle of its lock, in shares of the strand's extent at most:
locks of short hair are small."""
TAPER = 0.7
"""Share of its width that a strand loses towards the tip."""
LEAST_WIDTH, WIDTHS = 0.7, 0.6
"""Least factor of a strand's width, and its range from hair to hair."""
_WIDTH_STEP = 0.7548776662466927
"""Multiples of it, modulo 1, are spread evenly, and apart from those of `strand_numbers`."""


@dataclass(frozen=True)
class LockOptions:
    """How hair departs from a plain mixture of its guides."""

    lock: float = option(0.016, low=0.002, high=0.1, unit="m", doc="Spacing of locks at the scalp.")
    wisp: float = option(0.005, low=0.002, high=0.1, unit="m", doc="Spacing of wisps in a lock.")
    to_lock: float = option(0.3, low=0, high=1, doc="Way of tips to their lock's middle, a share.")
    to_wisp: float = option(0.5, low=0, high=1, doc="Way of tips to their wisp's middle, a share.")
    stray: float = option(0.05, low=0, high=1, doc="Share of hairs that keep out of locks.")
    scatter: float = option(0.002, low=0, high=0.05, unit="m", doc="RMS wander of a tip.")
    uneven: float = option(0.3, low=0, high=0.9, doc="Share of its length that a strand may lack.")
    rim: float = option(0.5, low=0, high=1, doc="Share that hairs at the hairline are thinner.")
    curl: float = option(0.4, low=0, high=1, doc="Share by which waves differ from hair to hair.")


USUAL_LOCKS = LockOptions()


def gather(
    curves: Float32Array, middles: Float32Array, reach: float, hold: Float32Array
) -> tuple[Float32Array, Int64Array]:
    """Return curves (N, m, 3) drawn to middles (C, m, 3), and the middle (N,) of each.

    Roots stay. A tip goes the share `hold` (N,) of the way, which counts as `reach` metres at most.
    """
    near = cKDTree(middles[:, 0]).query(curves[:, 0], k=min(CANDIDATES, len(middles)))[1]
    near = near.reshape(len(curves), -1)
    stops = np.linspace(0, curves.shape[1] - 1, 4).astype(int)
    gaps = middles[:, stops][near] - curves[:, None, stops]
    apart = np.einsum("nksc,nksc->nk", gaps, gaps)
    which = np.take_along_axis(near, apart.argmin(axis=1)[:, None], 1)[:, 0]
    pull = middles[which] - curves
    far = np.sqrt(np.einsum("nmc,nmc->nm", pull, pull))
    most = np.minimum(reach, MOST_PULL * _extents(curves))[:, None]
    t = np.linspace(0, 1, curves.shape[1], dtype=np.float32)
    pull *= (hold[:, None] * t * (2 - t) * np.minimum(1, most / np.maximum(far, 1e-9)))[..., None]
    pull += curves
    return pull, which


def turn_about(vectors: Float32Array, axes: Float32Array, angles: Float64Array) -> Float32Array:
    """Return vectors (N, m, 3) turned by angles (N,) about axes (N, m, 3) of any length."""
    unit, angle = unit_vectors(axes), angles[:, None, None]
    along = unit * (unit * vectors).sum(axis=2, keepdims=True)
    turned = np.cos(angle) * (vectors - along) + np.sin(angle) * np.cross(unit, vectors) + along
    return np.asarray(turned, np.float32)


def wander(
    hair: Float32Array, locks: LockOptions, stray: BoolArray, generator: np.random.Generator
) -> Float32Array:
    """Return (N, m, 3) slow random offsets, 0 at the root; those of strays lead outwards."""
    count, points = hair.shape[:2]
    t = np.linspace(0, 1, points, dtype=np.float32)
    phase, turns = generator.random((2, count, 1), dtype=np.float32)
    drift, wave = generator.standard_normal((2, count, 3), dtype=np.float32)
    out = unit_vectors(hair[:, 0] - hair.mean(axis=(0, 1)))
    drift -= 2 * np.minimum((drift * out).sum(axis=1), 0)[:, None] * out * stray[:, None]
    swing = np.sin(2 * np.pi * (phase + (1 + 2 * turns) * t)) - np.sin(2 * np.pi * phase)
    offsets = t[:, None] * drift[:, None] + SWING * (t * swing)[..., None] * wave[:, None]
    wide = locks.scatter / np.sqrt(3) * np.where(stray, STRAYING, 1)
    size = np.minimum(wide, MOST_WANDER * _extents(hair)).astype(np.float32)
    return np.asarray(size[:, None, None] * offsets, np.float32)


def _extents(curves: Float32Array) -> Float32Array:
    """Return the distances (N,) from roots to tips, metres."""
    return np.asarray(np.linalg.norm(curves[:, -1] - curves[:, 0], axis=1), np.float32)


def strand_widths(count: int, shares: Float64Array, width: float) -> Float32Array:
    """Return widths (count, m) at shares (m,) of the length, metres: thin tips, unequal hairs."""
    own = LEAST_WIDTH + WIDTHS * np.mod(np.arange(count) * _WIDTH_STEP, 1.0)
    return np.asarray(np.outer(width * own, 1 - TAPER * shares**4), np.float32)
