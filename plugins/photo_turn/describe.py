"""Names of views, their order in the turn, and the line that tells the user what was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hairkit import View
from hairkit.arrays import BoolArray, Float64Array, Int64Array
from hairkit.io.capture_reader import TURN

from .arrangement import wrap

NAMED_DEG = 40.0
"""The photos of a turn of eight are named in order if each is less than this off its view."""
MOST_TOLD = 3
"""Pairs of equal photos that the summary names."""
TOP = "top"
"""Name of photos from above."""


@dataclass(frozen=True, eq=False)
class Found:
    """From where the photos were taken, and how that is known."""

    azimuth_deg: Float64Array
    """(V,)."""
    elevation_deg: Float64Array
    """(V,)."""
    above: BoolArray
    """(V,) true for photos from above, which are no part of the turn."""
    margin: float
    named: BoolArray
    """(V,) true for photos that keep the name they came with."""
    guessed: BoolArray
    """(V,) true for photos that are from above only because they fit nowhere else."""
    note: str = ""
    """What else the user should know."""

    def take(self, photos: Int64Array) -> Self:
        """Return the same of the photos in another order."""
        return replace(
            self,
            azimuth_deg=self.azimuth_deg[photos],
            elevation_deg=self.elevation_deg[photos],
            above=self.above[photos],
            named=self.named[photos],
            guessed=self.guessed[photos],
        )


def in_turn_order(found: Found) -> Int64Array:
    """Return the photos (V,) from the front on towards the subject's left, then from above."""
    azimuth = np.where(found.above, np.inf, np.abs(wrap(found.azimuth_deg)))
    first = found.azimuth_deg[azimuth.argmin()]
    along = np.where(found.above, 360.0, 0.0) + (found.azimuth_deg - first) % 360.0
    return np.argsort(along, kind="stable").astype(np.int64)


def name_views(views: Sequence[View], found: Found, order: Int64Array) -> tuple[str, ...]:
    """Return a name for every photo: the one it had if it was named, or that of its direction."""
    nominal = np.array(list(TURN.values()))
    ring = order[~found.above[order]]
    off = wrap(found.azimuth_deg[ring][:, None] - nominal)
    nearest = np.abs(off).argmin(axis=1)
    if len(ring) == len(TURN) and np.abs(np.diagonal(off)).max() < NAMED_DEG:
        nearest = np.arange(len(TURN))
    names = [TOP] * len(views)
    for i, direction in zip(ring, nearest, strict=True):
        names[i] = list(TURN)[direction]
    names = [v.name if k else n for v, n, k in zip(views, names, found.named, strict=True)]
    return tuple(_number_twins(names, order))


def _number_twins(names: list[str], order: Int64Array) -> list[str]:
    """Return the names with -2, -3, ... after those that occurred before in the order."""
    taken: set[str] = set()
    for i in order:
        name, count = names[i], 2
        while name in taken:
            name, count = f"{names[i]}-{count}", count + 1
        taken.add(name)
        names[i] = name
    return names


def summarise(
    views: Sequence[View], found: Found, names: Sequence[str], twins: Sequence[tuple[int, int]]
) -> str:
    """Return one line: direction, steps, margin, and everything that is unusual."""
    ring = found.azimuth_deg[~found.above]
    steps = wrap(np.diff(ring, append=ring[0]))
    around = np.sort(ring % 360.0)
    sizes = np.diff(around, append=around[0] + 360.0)
    one_way = abs(np.count_nonzero(steps > 0) - np.count_nonzero(steps < 0)) > len(steps) / 2
    side = f"turn to the subject's {'left' if np.median(steps) > 0 else 'right'}"
    turn = f"{side if one_way else 'turn'}, steps {sizes.min():.0f} to {sizes.max():.0f} degrees"
    parts = [turn if len(views) > 1 else "one photo", *_tell_photos(views, found, names)]
    if found.note:
        parts.append(found.note)
    if not one_way and len(views) > 1:
        parts.append("the photos are not in the order of their names")
    parts += [f"{views[j].photo_name} equals {views[i].photo_name}" for i, j in twins[:MOST_TOLD]]
    if len(twins) > MOST_TOLD:
        parts.append(f"so do {len(twins) - MOST_TOLD} more pairs")
    return "; ".join(parts)


def tell_doubts(views: Sequence[View], found: Found) -> tuple[str, ...]:
    """Return what is uncertain of the turn, each in a few words."""
    return tuple(
        f"{view.photo_name} is taken for one from above because it fits nowhere else"
        for view, guessed in zip(views, found.guessed, strict=True)
        if guessed
    )


def _tell_photos(views: Sequence[View], found: Found, names: Sequence[str]) -> list[str]:
    """Return which photos are the front, the sides, the back and from above, if not named so."""
    shown = ("front", "left", "right", "back", TOP)
    return [
        f"{view.photo_name} is {'from above' if name == TOP else 'the ' + name}"
        for view, name, kept in zip(views, names, found.named, strict=True)
        if name in shown and not kept
    ]
