"""Strands sorted into locks, and locks into fewer locks: k-means on their course."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.types.strands import Strands

COURSE = 8
"""Points of a strand by which it is compared."""
SAMPLE = 20_000
"""Strands that the locks are found from; the others join the nearest."""
ROUNDS = 6
"""Rounds of Lloyd's algorithm."""
BLOCK = 4_096
"""Strands that are compared at once: 32 MB for 2,000 locks."""


def course(strands: Strands) -> Float32Array:
    """Return (S, 24) the points of strands at equal shares of their lengths, metres."""
    return strands.resampled(COURSE).points.reshape(len(strands), -1)


def sort_into_locks(courses: Float32Array, counts: list[int], seed: int = 0) -> list[Int64Array]:
    """Return for each of falling `counts` the lock (S,) of each strand; locks are never empty.

    A lock of one level lies wholly in a lock of the next.
    """
    generator = np.random.default_rng(seed)
    some = generator.permutation(len(courses))[:SAMPLE]
    centres = _means(courses[some], np.ones(len(some)), counts[0], generator)
    levels = [_packed(_nearest(courses, centres))]
    for count in counts[1:]:
        weight = np.bincount(levels[-1]).astype(np.float64)
        centres = _average(courses, levels[-1], np.ones(len(courses)))
        fewer = _nearest(centres, _means(centres, weight, count, generator))
        levels.append(_packed(fewer[levels[-1]]))
    return levels


def _means(
    points: Float32Array, weight: Float64Array, count: int, generator: np.random.Generator
) -> Float32Array:
    """Return at most `count` centres (K, D) of weighted points (N, D)."""
    centres = points[generator.permutation(len(points))[:count]]
    for _ in range(ROUNDS):
        centres = _average(points, _packed(_nearest(points, centres)), weight)
    return centres


def _average(points: Float32Array, lock: Int64Array, weight: Float64Array) -> Float32Array:
    """Return the weighted means (K, D) of the points (N, D) of each lock."""
    order = np.argsort(lock, kind="stable")
    first = np.searchsorted(lock[order], np.arange(lock.max() + 1))
    sums = np.add.reduceat(points[order] * weight[order, None], first)
    return (sums / np.add.reduceat(weight[order], first)[:, None]).astype(np.float32)


def _nearest(points: Float32Array, centres: Float32Array) -> Int64Array:
    """Return (N,) the nearest of the centres (K, D) to each point (N, D)."""
    half = 0.5 * (centres**2).sum(axis=1)
    nearest = np.empty(len(points), np.int64)
    for first in range(0, len(points), BLOCK):
        block = slice(first, first + BLOCK)
        nearest[block] = (points[block] @ centres.T - half).argmax(axis=1)
    return nearest


def _packed(lock: Int64Array) -> Int64Array:
    """Return the numbers of locks without those that are empty."""
    return np.unique(lock, return_inverse=True)[1].reshape(-1)
