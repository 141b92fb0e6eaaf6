"""The search for the arrangement that fits the photos best, and for the next best.

Photos without a face start in random orders, evenly between those with one. Then every photo in
turn moves to where it costs least, or changes places with another, and parts of the ring are
mirrored, until nothing is cheaper (iterated conditional modes, Besag 1986, from many starts).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int64Array
from hairkit.types.turnaround import moved_photos

from .arrangement import TURN_OF, Evidence, OutlineTable, Placed, measure_cost, wrap

STARTS, STARTS_ABOVE = 6, 0
"""Random orders from which the search starts, and from which it does with a photo left out."""
MOVES_DEG = np.r_[-5.0, -2.0, -1.0, 1.0, 2.0, 5.0, np.arange(15.0, 360.0, 15.0)]
"""Ways that a photo is tried to move around the head, degrees."""
ROUNDS = 60
"""Most rounds of moves: the search settles within 20."""
GAIN = 1e-6
"""Arrangements that are cheaper by less are equal."""
ABOVE = 4.0
"""Cost of taking a photo for one from above, less its oddness. Without a photo from above, turns
cost 3.9 less at most by leaving one out, with the oddness counted; with one, 2 to 9 less."""
FEWEST_WITH_ABOVE, LEFT_OUT = 7, 3
"""In turns of fewer each photo is unlike the others; the photos that save most are left out."""
STRAY_DEG = 8.0
"""Standard deviation of a photo's azimuth from its place in an even turn taken by hand."""
UNEVEN, UNEVEN_DEG = 4.0, 15.0
"""Cost and distance of a photo up to which the steps of a turn are taken for even: outlines and
skin pull photos by 2 to 10 degrees from where they are."""
OTHERS = 8
"""Different arrangements near a good one from which the search for others starts."""
ROUNDS_NEAR, NEAREST = 2, 4
"""Times that others are looked for, near so many of the best."""


def find_arrangements(
    evidence: Evidence, above: BoolArray, level: BoolArray, fixed: BoolArray
) -> list[Placed]:
    """Return arrangements by their cost, each of which puts some photo elsewhere than the others.

    Parameters
    ----------
    evidence
        What the photos tell about their azimuths: that of one at least is known.
    above, level
        (V,) true for photos that are known to be from above, and known not to be. One of the rest
        may be from above.
    fixed
        (V,) true for photos whose azimuth is known, and is not moved.
    """
    photos = np.nonzero(~above)[0]
    search = Search(evidence, photos, fixed[photos])
    found = search.run(STARTS)
    best = found[0].azimuth_deg
    if len(photos) >= FEWEST_WITH_ABOVE and not np.isinf(evidence.follow):
        rings = []
        for photo in np.nonzero(~above & ~level & ~fixed)[0]:
            rest = photos[photos != photo]
            rings.append(Search(evidence, rest, fixed[rest], ABOVE - float(evidence.odd[photo])))
        rings.sort(key=lambda without: without._placed(best[without.photos]).cost)
        for without in rings[:LEFT_OUT]:
            found += without.run(STARTS_ABOVE, best[without.photos])
    found.sort(key=lambda placed: placed.cost)
    left = np.nonzero(~found[0].above)[0]
    paid = found[0].cost - measure_cost(found[0].azimuth_deg[None, left], evidence.only(left))
    around = Search(evidence, left, fixed[left], float(paid[0]))
    for _ in range(ROUNDS_NEAR):
        ring = [each for each in _distinct(found) if (each.above == found[0].above).all()]
        found += [other for each in ring[:NEAREST] for other in around.near(each)]
    distinct = _distinct(found)
    return [around.evened(distinct[0]), *distinct[1:]]


def _distinct(found: list[Placed]) -> list[Placed]:
    """Return arrangements by their cost that put some photo elsewhere than all before."""
    distinct: list[Placed] = []
    for other in sorted(found, key=lambda placed: placed.cost):
        if all(moved(other, each).any() for each in distinct):
            distinct.append(other)
    return distinct


def margin_of(placed: list[Placed]) -> float:
    """Return by how much the next best arrangement costs more than the best, from 1 for a tie on.

    In units of one for each photo of a usual turn; inf without any other.
    """
    return 1 + (placed[1].cost - placed[0].cost) / TURN_OF if len(placed) > 1 else np.inf


def moved(one: Placed, other: Placed) -> BoolArray:
    """Return which photos (V,) have another place in two arrangements."""
    return moved_photos(one.azimuth_deg, one.above, other.azimuth_deg, other.above)


@dataclass(frozen=True, eq=False)
class Search:
    """The search for the best ring of some of the photos."""

    everything: Evidence
    """Of all photos."""
    photos: Int64Array
    """(R,) those on the ring; the rest are from above."""
    fixed: BoolArray
    """(R,) true for photos that do not move."""
    prior: float = 0.0
    """Cost of such a ring."""

    def run(self, starts: int, near: Float64Array | None = None) -> list[Placed]:
        """Return what is found from random orders, and from azimuths (R,) if given, by cost."""
        evidence = self.everything.only(self.photos)
        generator = np.random.default_rng(0)
        places = []
        if evidence.sequence is not None:
            even = np.asarray(360.0 / len(self.photos) * evidence.sequence, np.float64)
            places = [_turned_to_faces(way * even, evidence) for way in (1.0, -1.0)]
        if not np.isinf(evidence.follow):
            places += [_start(evidence, generator) for _ in range(starts)]
        if near is not None:
            places.append(near)
        found = [self._placed(self._settle(place, evidence)) for place in places]
        return sorted(found, key=lambda placed: placed.cost)

    def near(self, best: Placed) -> list[Placed]:
        """Return the cheapest ways to put photos in another order, and what is found from them."""
        evidence = self.everything.only(self.photos)
        azimuth = best.azimuth_deg[self.photos]
        trials = np.concatenate([self._mirrored(azimuth), self._inserted(azimuth)])
        trials = trials[np.argsort(measure_cost(trials, evidence), kind="stable")]
        others = [*islice((t for t in trials if moved(self._placed(t), best).any()), OTHERS)]
        settled = [self._settle(other, evidence) for other in others]
        return [self._placed(other) for other in (*others, *settled)]

    def evened(self, best: Placed) -> Placed:
        """Return the arrangement with even steps, if they fit nearly as well."""
        if self.fixed.any():
            return best
        azimuth, evidence = best.azimuth_deg[self.photos], self.everything.only(self.photos)
        even = np.argsort(np.argsort(azimuth, kind="stable")) * (360.0 / len(azimuth))
        even = _turned_to_faces(np.asarray(even, np.float64), evidence)
        seen = np.isfinite(evidence.yaw_deg)
        off, spread = evidence.off(even)
        even[seen] -= (off / (1 + (spread / STRAY_DEG) ** 2))[seen]
        placed = self._placed(even)
        near = np.abs(wrap(placed.azimuth_deg - best.azimuth_deg)).max() < UNEVEN_DEG
        fits = placed.cost < best.cost + UNEVEN
        return replace(placed, cost=best.cost) if near and fits else best

    def _settle(self, azimuth: Float64Array, evidence: Evidence) -> Float64Array:
        """Return the arrangement (R,) to which moves lead, each to the cheapest place."""
        cost = float(measure_cost(azimuth[None], evidence)[0])
        free = np.nonzero(~self.fixed)[0]
        table = OutlineTable.of(azimuth, evidence)
        for _ in range(ROUNDS):
            before = cost
            for photo in (*free, None):
                if photo is None:
                    trials = self._mirrored(azimuth)
                    costs = measure_cost(trials, evidence)
                else:
                    trials = self._moved(azimuth, photo)
                    parts = table.moved(photo, MOVES_DEG), table.swapped(photo, free[free != photo])
                    costs = measure_cost(trials, evidence, np.concatenate(parts))
                least = int(costs.argmin())
                if costs[least] < cost - GAIN:
                    azimuth, cost = trials[least], float(costs[least])
                    table = OutlineTable.of(azimuth, evidence)
            if cost == before:
                break
        return azimuth

    def _moved(self, azimuth: Float64Array, photo: int) -> Float64Array:
        """Return arrangements (M, R) with one photo elsewhere, or in another's place."""
        moved = np.repeat(azimuth[None], len(MOVES_DEG), axis=0)
        moved[:, photo] += MOVES_DEG
        return np.concatenate([moved, self._swapped(azimuth, photo)])

    def _swapped(self, azimuth: Float64Array, photo: int) -> Float64Array:
        """Return arrangements (M, R) with one photo in another's place."""
        others = np.nonzero(~self.fixed)[0]
        others = others[others != photo]
        swapped, rows = np.repeat(azimuth[None], len(others), axis=0), np.arange(len(others))
        swapped[:, photo], swapped[rows, others] = azimuth[others], azimuth[photo]
        return swapped

    def _inserted(self, azimuth: Float64Array) -> Float64Array:
        """Return arrangements (M, R) with one photo elsewhere in the order around the head."""
        free = np.nonzero(~self.fixed)[0]
        around = free[np.argsort(azimuth[free] % 360.0)]
        places = np.ndindex(len(around), len(around))
        orders = [np.insert(np.delete(around, i), j, around[i]) for i, j in places]
        inserted = np.repeat(azimuth[None], len(orders), axis=0)
        inserted[np.arange(len(orders))[:, None], np.array(orders)] = azimuth[around]
        return inserted

    def _mirrored(self, azimuth: Float64Array) -> Float64Array:
        """Return arrangements (M, R) with the photos between any two in reverse order."""
        around = azimuth % 360.0
        first, second = np.nonzero(around[:, None] < around[None])
        low, high = around[first][:, None], around[second][:, None]
        between = (around >= low) & (around <= high) & ~self.fixed
        return np.concatenate([azimuth[None], np.where(between, low + high - around, around)])

    def _placed(self, azimuth: Float64Array) -> Placed:
        """Return an arrangement (R,) as one of all photos."""
        evidence = self.everything.only(self.photos)
        count = len(self.everything.yaw_deg)
        everywhere, above = np.nan_to_num(self.everything.yaw_deg), np.ones(count, np.bool_)
        everywhere[self.photos], above[self.photos] = wrap(azimuth), False
        off = np.nan_to_num(wrap(self.everything.yaw_deg - everywhere))
        cost = float(measure_cost(azimuth[None], evidence)[0]) + self.prior
        return Placed(everywhere, above, off, cost)


def _start(evidence: Evidence, generator: np.random.Generator) -> Float64Array:
    """Return faces where they look (R,), the other photos evenly behind, in random order."""
    azimuth = evidence.yaw_deg.copy()
    seen = np.isfinite(azimuth)
    hidden = generator.permutation(np.nonzero(~seen)[0])
    first, last = (azimuth[seen].min(), azimuth[seen].max()) if seen.any() else (0.0, 0.0)
    steps = np.arange(1, len(hidden) + 1) / (len(hidden) + 1)
    azimuth[hidden] = last + (first + 360.0 - last) * steps
    return azimuth


def _turned_to_faces(azimuth: Float64Array, evidence: Evidence) -> Float64Array:
    """Return azimuths (R,) turned to the weighted circular mean of what faces say."""
    seen = np.isfinite(evidence.yaw_deg)
    off = np.exp(1j * np.radians(evidence.yaw_deg[seen] - azimuth[seen]))
    return azimuth + float(np.degrees(np.angle(evidence.spread_deg[seen] ** -2.0 @ off)))
