"""Cards: a strip along the middle of each lock, as wide as it, its face away from the head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array, across, unit_vectors
from hairkit.types.strands import Strands

SPREAD = 2.2
"""Half the width of a card in standard deviations of its strands."""
LEAST_HALF = 0.0012
"""Half the width of a card at least, metres: that of a lone strand can be seen."""
LEAST_SHARE = 0.5
"""Half the width anywhere at least, of the widest part's: textures on wedges are distorted."""
FLAT = 0.35
"""Weight of lying flat on the head, of a lock's whole spread, against its own flat side."""
SMOOTHING = (0.25, 0.5, 0.25)
"""Weights by which the directions of neighbouring stations are averaged."""
MOST_GROWN = 1.3
"""Factor by which a shorter strand is prolonged at most to find the middle of its lock."""
SHAPING = 24
"""Strands of a lock, at most, that give its card a shape; all are drawn on it."""
LONGEST = 98.0
"""Percentile of the strands' lengths that a card is as long as."""


@dataclass(frozen=True, eq=False)
class Cards:
    """Strips of M stations, for K locks."""

    centre: Float64Array
    """(K, M, 3) middle of each station, metres, root first."""
    across: Float64Array
    """(K, M, 3) unit vectors across."""
    outward: Float64Array
    """(K, M, 3) unit normals, away from the head."""
    half: Float64Array
    """(K, M) half the width, metres."""
    lock: Int64Array
    """(S,) card of each strand."""

    def __len__(self) -> int:
        return len(self.centre)

    def lengths(self) -> Float64Array:
        """Return (K,) lengths along the middle, metres."""
        steps = np.linalg.norm(np.diff(self.centre, axis=1), axis=2)
        return np.asarray(steps.sum(axis=1))

    def corners(self) -> Float32Array:
        """Return (K, M, 2, 3) the edges' points: at -across, then at +across."""
        reach = self.half[..., None] * self.across
        return np.stack([self.centre - reach, self.centre + reach], axis=2).astype(np.float32)

    def faces(self) -> Int32Array:
        """Return (F, 3) triangles of the corners, counter-clockwise seen from outside."""
        cards, stations = self.centre.shape[:2]
        first = 2 * np.arange(stations - 1)[:, None]
        quad = np.array([[0, 1, 3], [0, 3, 2]])
        strip = (first[:, None] + quad).reshape(-1, 3)
        every = strip + 2 * stations * np.arange(cards)[:, None, None]
        return np.asarray(every.reshape(-1, 3).astype(np.int32))


def make_cards(strands: Strands, lock: Int64Array, stations: int, middle: Float64Array) -> Cards:
    """Return the cards of locks (S,); `middle` (3,) is the head's, that cards face away from."""
    some = _some_of_each(lock)
    shaping = lock[some]
    first = np.searchsorted(shaping, np.arange(lock.max() + 1))
    points = _extended(strands.select(some), shaping, first, stations)
    count = np.diff([*first, len(some)])
    centre = np.add.reduceat(points, first) / count[:, None, None]
    along = unit_vectors(np.gradient(centre, axis=1))
    away = unit_vectors(across(along, centre - middle))
    offset = points - np.repeat(centre, count, axis=0)
    flat = np.cross(along, away)
    # the scatter of the strands in the plane across the card, as a symmetric 2 x 2 matrix
    x = (offset * np.repeat(flat, count, axis=0)).sum(axis=2)
    y = (offset * np.repeat(away, count, axis=0)).sum(axis=2)
    xx, xy, yy = (np.add.reduceat(v, first) / count[:, None] for v in (x * x, x * y, y * y))
    xx, xy, yy = (_smoothed(v) for v in (xx, xy, yy))
    # the flat side's angle is known up to half a turn: the nearer one of each next station
    angle = 0.5 * np.unwrap(np.arctan2(2 * xy, xx - yy + FLAT * (xx + yy)), axis=1)
    angle += np.pi * (np.cos(angle).mean(axis=1, keepdims=True) < 0)
    wide = np.cos(angle)[..., None] * flat + np.sin(angle)[..., None] * away
    outward = np.cross(wide, along)
    spread = np.cos(angle) ** 2 * xx + np.sin(2 * angle) * xy + np.sin(angle) ** 2 * yy
    half = SPREAD * np.sqrt(np.maximum(spread, 0))
    half = np.maximum(half, LEAST_SHARE * half.max(axis=1, keepdims=True))
    return Cards(centre, wide, outward, np.maximum(half, LEAST_HALF), lock)


def _some_of_each(lock: Int64Array) -> Int64Array:
    """Return strands lock by lock, at most `SHAPING` of each, spread over the lock."""
    order = np.argsort(lock, kind="stable")
    count = np.bincount(lock)
    rank = np.arange(len(lock)) - np.repeat(np.cumsum(count) - count, count)
    slot = rank * SHAPING // np.maximum(count[lock[order]], SHAPING)
    fresh = np.ones(len(lock), bool)
    fresh[1:] = (slot[1:] != slot[:-1]) | (lock[order][1:] != lock[order][:-1])
    return order[fresh]


def _extended(strands: Strands, lock: Int64Array, first: Int64Array, stations: int) -> Float64Array:
    """Return (S, M, 3) strands at equal steps up to the length of their lock's longest.

    Shorter strands go on in the direction of their last part.
    """
    length = strands.lengths()
    parts = np.split(length, first[1:])
    longest = np.array([np.percentile(part, LONGEST) for part in parts])
    grown = np.clip(longest[lock] / np.maximum(length, 1e-9), 1.0, MOST_GROWN)
    fine = strands.resampled(stations).points.reshape(len(strands), stations, 3).astype(np.float64)
    place = np.arange(stations) * grown[:, None]
    low = np.minimum(place.astype(np.int64), stations - 2)
    share = (place - low)[..., None]
    row = np.arange(len(strands))[:, None]
    return np.asarray(fine[row, low] * (1 - share) + fine[row, low + 1] * share)


def _smoothed(values: Float64Array) -> Float64Array:
    """Return values (K, M) averaged with their neighbours along the card."""
    padded = np.pad(values, ((0, 0), (1, 1)), mode="edge")
    before, here, after = SMOOTHING
    return before * padded[:, :-2] + here * values + after * padded[:, 2:]
