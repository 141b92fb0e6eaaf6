"""How hair lies between guides: in locks and wisps, with stray hairs, uneven ends and widths.

Strands lean towards the middle of their wisp and wisps towards that of their lock, as in Choe and
Ko 2005, A Statistical Wisp Model and Pseudophysical Approaches for Interactive Hairstyle
Generation. The defaults were chosen by eye beside photos of straight, curly, coily and short hair.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.options import option

CANDIDATES = 6
"""Middles near a strand's root among which the one that runs most alike is taken."""
SWING = 0.4
"""Slow swing of a strand about its own line, in shares of the tip's wander."""
STRAYING = 9.0
"""Wander of stray hairs over that of others."""
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
class Locks:
    """How hair departs from a plain mixture of its guides."""

    lock: float = option(0.016, low=0.002, high=0.1, unit="m", doc="Spacing of locks at the scalp.")
    wisp: float = option(0.005, low=0.002, high=0.1, unit="m", doc="Spacing of wisps in a lock.")
    gathered: tuple[float, float] = option(
        (0.4, 0.6),
        low=0,
        high=1,
        doc="Share of the way from a tip to the middle of its lock, and of its wisp, at most.",
    )
    stray: float = option(0.05, low=0, high=1, doc="Share of hairs that keep out of locks.")
    scatter: float = option(
        0.0016, low=0, high=0.05, unit="m", doc="Root mean square wander of a tip."
    )
    uneven: float = option(
        0.3, low=0, high=0.9, doc="Share of its length that a strand may lack, most lack little."
    )
    curl: tuple[float, float] = option(
        (0.6, 1.4), low=0, high=3, doc="Range of a strand's waves over those of its guide."
    )


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
    unit = axes / np.maximum(np.linalg.norm(axes, axis=2, keepdims=True), 1e-12)
    cosine, sine = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
    along = unit * (unit * vectors).sum(axis=2, keepdims=True)
    turned = cosine * (vectors - along) + sine * np.cross(unit, vectors) + along
    return np.asarray(turned, np.float32)


def wander(
    hair: Float32Array, locks: Locks, stray: BoolArray, generator: np.random.Generator
) -> Float32Array:
    """Return (N, m, 3) slow random sideways offsets that are 0 at the root; strays lead outwards."""
    count, points = hair.shape[:2]
    t = np.linspace(0, 1, points, dtype=np.float32)
    phase = 2 * np.pi * generator.random((count, 2), dtype=np.float32)
    turns = 1 + 2 * generator.random((count, 1), dtype=np.float32)
    drift = generator.standard_normal((count, 3), dtype=np.float32)
    wave = generator.standard_normal((count, 3), dtype=np.float32)
    out = hair[:, 0] - hair.mean(axis=(0, 1))
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    inwards = np.minimum((drift * out).sum(axis=1, keepdims=True), 0)
    drift -= 2 * inwards * out * stray[:, None]
    swing = np.sin(phase[:, :1] + 2 * np.pi * turns * t) - np.sin(phase[:, :1])
    offsets = t[None, :, None] * drift[:, None] + SWING * (t * swing)[:, :, None] * wave[:, None]
    wide = locks.scatter * np.where(stray, STRAYING, 1)
    size = np.minimum(wide, MOST_WANDER * _extents(hair))
    result: Float32Array = (size / np.sqrt(3)).astype(np.float32)[:, None, None] * offsets
    return result


def _extents(curves: Float32Array) -> Float32Array:
    """Return the distances (N,) from roots to tips, metres."""
    return np.asarray(np.linalg.norm(curves[:, -1] - curves[:, 0], axis=1), np.float32)


def cut_strands(hair: Float32Array, shares: Float64Array) -> Float32Array:
    """Return strands (N, m, 3) that end at shares (N,) of their points, with as many points."""
    last = hair.shape[1] - 1
    place = (shares[:, None] * np.arange(last + 1)).astype(np.float32)
    low = np.minimum(place.astype(np.int64), max(last - 1, 0))
    before = np.take_along_axis(hair, low[..., None], 1)
    after = np.take_along_axis(hair, low[..., None] + 1, 1)
    after -= before
    after *= (place - low)[..., None]
    after += before
    return after


def strand_widths(count: int, shares: Float64Array, width: float) -> Float32Array:
    """Return widths (count, m) at shares (m,) of the length, metres: thin tips, unequal hairs."""
    own = LEAST_WIDTH + WIDTHS * np.mod(np.arange(count) * _WIDTH_STEP, 1.0)
    return np.asarray(np.outer(width * own, 1 - TAPER * shares**4), np.float32)
