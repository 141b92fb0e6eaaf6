"""The search for the arrangement that fits the photos best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int64Array

from .arrangement import SHUFFLED, TURN_OF, Evidence, Placed, Ring, place, rings_of, wrap

FITS = 2.5
"""Cost per photo up to which photos in the order of their names are a turn."""
ABOVE = 6.0
"""Prior cost of a photo from above: without one, turns cost at most 2 less by leaving one out."""
ODD_PHOTOS = 2
"""Photos tried as from above in shuffled turns: those whose outlines are least like others'."""
SWAP_STARTS = 6
"""Random orders of eight photos from which the search by swaps starts."""
ROUNDS = 30
"""Most rounds of swaps: the search settles within ten."""
DIFFERENT_DEG = 30.0
"""Arrangements that move some photo by more than this are different ones."""


def find_arrangements(evidence: Evidence, above: BoolArray, level: BoolArray) -> list[Placed]:
    """Return arrangements by their cost; empty when no face tells where the turn begins.

    Parameters
    ----------
    evidence
        What the photos tell about their azimuths.
    above, level
        (V,) true for photos that are known to be from above, and known not to be. One of the rest
        may be from above.
    """
    row = np.nonzero(~above)[0]
    free = np.nonzero(~above & ~level)[0]
    rows = [(row, 0.0)] + [(row[row != one], ABOVE) for one in free if len(row) > 3]
    found = [place(ring, evidence) for order, prior in rows for ring in rings_of(order, prior)]
    placed = sorted((p for p in found if p is not None), key=lambda p: p.cost)
    if placed and (placed[0].cost > FITS * len(row) or placed[0].above.sum() > above.sum()):
        odd = free[np.argsort(_oddness(evidence)[free])[::-1][:ODD_PHOTOS]]
        rows = [(row, 0.0)] + [(row[row != one], ABOVE) for one in odd if len(row) > 3]
        for order, prior in rows:
            placed += _shuffle(order, prior + SHUFFLED, evidence)
    return sorted(placed, key=lambda p: p.cost)


def margin_of(placed: list[Placed]) -> float:
    """Return the next best cost over the least, each counted from one per photo below the least.

    The next best is the cheapest that puts some photo elsewhere; inf without any.
    """
    best, count = placed[0], len(placed[0].azimuth_deg)
    for other in placed[1:]:
        if np.abs(wrap(other.azimuth_deg - best.azimuth_deg)).max() > DIFFERENT_DEG:
            return 1 + (other.cost - best.cost) / count
    return np.inf


def _oddness(evidence: Evidence) -> Float64Array:
    """Return how little each photo's outline is like any other or its mirror image (V,)."""
    if evidence.alike is None or evidence.mirrored is None:
        return np.zeros(len(evidence.yaw_deg))
    nearest = np.minimum(evidence.alike, evidence.mirrored)
    np.fill_diagonal(nearest, np.inf)
    return np.asarray(nearest.min(axis=1), np.float64)


def _shuffle(order: Int64Array, prior: float, evidence: Evidence) -> list[Placed]:
    """Return the even turns to which swaps of two photos lead from random orders."""
    generator = np.random.default_rng(0)
    starts = max(1, round(SWAP_STARTS * min(1.0, TURN_OF / len(order))))
    orders = [generator.permutation(order) for _ in range(starts)]
    return [replace(_by_swaps(start, prior, evidence), in_order=False) for start in orders]


def _by_swaps(order: Int64Array, prior: float, evidence: Evidence) -> Placed:
    """Return the even turn that no swap of two photos makes cheaper."""
    count = len(order)
    steps = np.arange(count) * 360.0 / count

    def placed(row: Int64Array) -> Placed:
        result = place(Ring(row, steps, prior), evidence)
        assert result is not None  # the same faces were there in the order of the files
        return result

    best = placed(order)
    for _ in range(ROUNDS):
        before = best.cost
        for i, j in zip(*np.triu_indices(count, 1), strict=True):
            swapped = order.copy()
            swapped[[i, j]] = swapped[[j, i]]
            trial = placed(swapped)
            if trial.cost < best.cost:
                order, best = swapped, trial
        if best.cost == before:
            break
    return best
