"""How well the photos fit azimuths around a head.

An arrangement gives each photo an azimuth. Faces, outlines, skin and the evenness of the steps
score it, each alone and for many arrangements at once: azimuths are (B, V), costs (B,). Costs are
negative logarithms of likelihoods. The order of the photos is that of time in a video, and likely
so in a folder; nothing else depends on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int64Array
from hairkit.types.face import OBLIQUE_YAW_DEG, Face

YAW_DEG = 4.0
"""Standard deviation of the azimuth that a face tells."""
OBLIQUE_GROWTH = 3.0
"""Growth of that deviation, away from the front, for each degree of an oblique face's yaw."""
FACE_CAP = 30.0
"""Largest cost of one face: beyond 30 degrees off, farther is not worse."""
HIDDEN_DEG, HIDDEN_SPREAD_DEG = 60.0, 10.0
"""Nearer than this to the front a face is found; how gradually that ends."""
FAINT_PRESENCE = 0.3
"""Least presence of a face that tells the side of the head at least: eight photos of the sides,
36 to 93 degrees from the front, had 0.47 to 0.6; none from behind had more than 0.1."""
SIDE_DEG, SIDE_SPREAD_DEG, SIDE_CAP = 70.0, 18.0, 4.0
"""Azimuth of such faces, its standard deviation, and their largest cost."""
OUTLINE_WEIGHT = 60.0
"""Cost of outlines that differ by one more head width than usual. On nine captures the next best
order costs 0.07 head widths more."""
OUTLINE_BEND = 0.08
"""Differences between outlines count less from this on, head widths: a ponytail swings."""
NEAR, OPPOSITE = np.radians([35.0, 20.0]) ** -2.0
"""Concentrations: outlines of views that are about 35 degrees from each other are alike, those of
views that are within 20 degrees of opposite mirror each other."""
NEIGHBOUR_SHARE = 0.5
"""Weight of neighbours over that of opposite views: outlines change from view to view."""
LOOKS_WEIGHT = 2.0
"""Cost of neighbours around the head that look e times as unlike as usual. Without it three turns
of 12 and 24 photos had some from behind in wrong places."""
SHARE_SPREAD, MOMENT_SPREAD = 0.06, 0.012
"""Deviation of skin's share of the head, and of its sideways moment (head widths), from a smooth
curve over the azimuth."""
STEP_SPREAD_DEG, STEP_FREEDOM = 15.0, 2.0
"""Scale and degrees of freedom of Student's distribution of steps about an even one: most turns are
even, but a photo may be missing or taken twice."""
TURN_OF = 8
"""Weights of outlines and skin are those of this number of photos."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the photos of a ring tell about their places."""

    yaw_deg: Float64Array
    """(V,) azimuths that sure faces, or the names of views, tell; NaN without."""
    spread_deg: Float64Array
    """(V,) standard deviations of these, away from the front."""
    side: Float64Array
    """(V,) 1 for photos from the subject's left, -1 from the right, as faint faces tell; else 0."""
    alike: Float64Array | None
    """(V, V) distances of outlines, None or NaN where they are unknown."""
    mirrored: Float64Array | None
    """(V, V) the same, one of the pair mirrored."""
    skin: Float64Array | None
    """(V, 2) share of the head that is skin and its moment; None or NaN where unknown."""
    odd: Float64Array
    """(V,) how unlike those of level photos the outlines are."""
    unlike: Float64Array | None = None
    """(V, V) how unlike heads look, 0 for a usual pair; None or NaN where unknown."""
    sequence: Int64Array | None = None
    """(V,) places of the photos in the order in which they were given; None where unknown."""
    follow: float = 0.0
    """Logarithm of the odds that the turn follows this order; `inf` for frames of one video."""

    @classmethod
    def of(
        cls,
        faces: Sequence[Face],
        outlines: tuple[Float64Array, Float64Array] | None = None,
        skin: Float64Array | None = None,
        odd: Float64Array | None = None,
        unlike: Float64Array | None = None,
    ) -> Self:
        """Return the evidence of photos, of which no names are known."""
        yaw = np.array([face.yaw_deg if face.sure else np.nan for face in faces])
        beyond = np.maximum(np.abs(yaw) - OBLIQUE_YAW_DEG, 0)
        faint = [not face.sure and face.presence > FAINT_PRESENCE for face in faces]
        side = np.where(faint, np.sign([face.yaw_deg for face in faces]), 0.0)
        alike, mirrored = outlines if outlines is not None else (None, None)
        odd = np.zeros(len(yaw)) if odd is None else odd
        spread = YAW_DEG + OBLIQUE_GROWTH * beyond
        return cls(yaw, spread, side, alike, mirrored, skin, odd, unlike)

    def only(self, photos: Int64Array) -> Self:
        """Return the evidence of some photos alone."""
        pairs = np.ix_(photos, photos)
        return replace(
            self,
            yaw_deg=self.yaw_deg[photos],
            spread_deg=self.spread_deg[photos],
            side=self.side[photos],
            alike=None if self.alike is None else self.alike[pairs],
            mirrored=None if self.mirrored is None else self.mirrored[pairs],
            skin=None if self.skin is None else self.skin[photos],
            odd=self.odd[photos],
            unlike=None if self.unlike is None else self.unlike[pairs],
            sequence=None if self.sequence is None else self.sequence[photos].argsort().argsort(),
        )

    def off(self, azimuth_deg: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Return by how much azimuths (..., V) differ from what faces tell, and the deviation."""
        off = wrap(azimuth_deg - self.yaw_deg)
        narrow = np.minimum(self.spread_deg, YAW_DEG)
        return off, np.where(off * np.sign(self.yaw_deg) > 0, self.spread_deg, narrow)

    @cached_property
    def pairs(self) -> tuple[Int64Array, Int64Array]:
        """Return the first and the second photo of each pair (P,)."""
        return np.triu_indices(len(self.yaw_deg), 1)

    @cached_property
    def pair_costs(self) -> tuple[Float64Array, Float64Array]:
        """Return what pairs (P,) cost more than usual ones where they are neighbours, opposite."""
        if self.alike is None or self.mirrored is None:
            return np.zeros(len(self.pairs[0])), np.zeros(len(self.pairs[0]))
        bent = [
            OUTLINE_BEND * np.tanh(distance[self.pairs] / OUTLINE_BEND)
            for distance in (self.alike, self.mirrored)
        ]
        usual = [pair[np.isfinite(pair)].mean() if np.isfinite(pair).any() else 0 for pair in bent]
        scale = OUTLINE_WEIGHT * self.weight**2
        alike, mirrored = (scale * np.nan_to_num(p - u) for p, u in zip(bent, usual, strict=True))
        return NEIGHBOUR_SHARE * alike, mirrored

    @cached_property
    def pair_tables(self) -> tuple[Float64Array, Float64Array]:
        """Return `pair_costs` as tables (V, V), 0 on the diagonal."""
        tables = np.zeros((2, len(self.yaw_deg), len(self.yaw_deg)))
        for table, costs in zip(tables, self.pair_costs, strict=True):
            table[self.pairs] = costs
            table += table.T
        return tables[0], tables[1]

    @property
    def weight(self) -> float:
        """Return the weight of a photo: many photos tell no more than those of a usual turn."""
        return min(1.0, TURN_OF / len(self.yaw_deg))


@dataclass(frozen=True, eq=False)
class Placed:
    """Photos with azimuths, and what that costs."""

    azimuth_deg: Float64Array
    """(V,) of each photo, in (-180, 180]; 0 of photos from above without a face."""
    above: BoolArray
    """(V,) true for photos from above."""
    off_deg: Float64Array
    """(V,) by how much faces contradict the azimuths, 0 without a face."""
    cost: float


def wrap(angle_deg: Float64Array) -> Float64Array:
    """Return angles in (-180, 180]."""
    return np.asarray(180.0 - (180.0 - np.asarray(angle_deg, np.float64)) % 360.0)


def measure_cost(
    azimuth_deg: Float64Array, evidence: Evidence, outlines: Float64Array | None = None
) -> Float64Array:
    """Return the costs (B,) of arrangements (B, V) of all photos on one ring, degrees.

    `outlines` (B,) is the cost of outlines where it is known.
    """
    angle = np.radians(azimuth_deg)
    across, ahead = np.sin(angle), np.cos(angle)
    cost = _face_cost(azimuth_deg, evidence) + _step_cost(azimuth_deg, evidence)
    cost += _outline_cost(across, ahead, evidence) if outlines is None else outlines
    cost += _skin_cost(across, ahead, evidence)
    return cost + _looks_cost(azimuth_deg, evidence)


def _face_cost(azimuth: Float64Array, evidence: Evidence) -> Float64Array:
    """Return what it costs that faces look elsewhere and photos from the front show none."""
    seen, faint = np.isfinite(evidence.yaw_deg), evidence.side != 0
    off = np.divide(*evidence.off(azimuth))[:, seen]
    inside = HIDDEN_DEG - np.abs(wrap(azimuth[:, ~seen & ~faint]))
    inside = np.maximum(inside, 0) / HIDDEN_SPREAD_DEG
    aside = wrap(azimuth[:, faint] - SIDE_DEG * evidence.side[faint]) / SIDE_SPREAD_DEG
    cost = np.minimum(off**2 / 2, FACE_CAP).sum(axis=1) + (inside**2 / 2).sum(axis=1)
    return np.asarray(cost + np.minimum(aside**2 / 2, SIDE_CAP).sum(axis=1), np.float64)


def _step_cost(azimuth: Float64Array, evidence: Evidence) -> Float64Array:
    """Return the cost of uneven steps: from photo to photo as they were given, either way, or
    around the head. Either may be the order in which they were taken."""
    even = 360.0 / azimuth.shape[1]
    around = np.sort(azimuth % 360.0, axis=1)
    cost = _uneven(np.diff(around, axis=1, append=around[:, :1] + 360.0) - even)
    if evidence.sequence is None:
        return cost
    given = azimuth[:, evidence.sequence.argsort()]
    steps = np.diff(given, axis=1, append=given[:, :1])
    along = np.minimum(*(_uneven(wrap(way * steps - even)) for way in (1.0, -1.0)))
    if np.isinf(evidence.follow):
        return along
    return np.asarray(-np.logaddexp(evidence.follow - along, -cost), np.float64)


def _uneven(off_deg: Float64Array) -> Float64Array:
    """Return the negative log likelihoods (B,) of steps that are off by (B, V) degrees."""
    squares = (off_deg / STEP_SPREAD_DEG) ** 2 / STEP_FREEDOM
    return np.asarray((STEP_FREEDOM + 1) / 2 * np.log1p(squares).sum(axis=1), np.float64)


def _outline_cost(across: Float64Array, ahead: Float64Array, evidence: Evidence) -> Float64Array:
    """Return the cost of outlines that differ although the views are neighbours or opposite.

    `across` and `ahead` (B, V) are sines and cosines of the azimuths. Nearness is von Mises'.
    """
    first, second = evidence.pairs
    alike, mirrored = evidence.pair_costs
    gap = across[:, first] * across[:, second] + ahead[:, first] * ahead[:, second]
    near, opposite = np.exp(NEAR * (gap - 1)), np.exp(OPPOSITE * (-gap - 1))
    return np.asarray(near @ alike + opposite @ mirrored, np.float64)


@dataclass(frozen=True, eq=False)
class OutlineTable:
    """The cost of outlines of one arrangement, pair by pair: most pairs stay when one photo moves.

    `_outline_cost` of M arrangements of V photos takes M V^2 exponentials, this V^2 + M V.
    """

    evidence: Evidence
    azimuth: Float64Array
    """(V,) radians."""
    near: Float64Array
    """(V, V) how near the views are to each other."""
    opposite: Float64Array
    """(V, V) how near they are to opposite."""

    @classmethod
    def of(cls, azimuth_deg: Float64Array, evidence: Evidence) -> Self:
        """Return the table of an arrangement (V,)."""
        azimuth = np.radians(azimuth_deg)
        return cls(evidence, azimuth, *_nearness(azimuth[:, None] - azimuth))

    @cached_property
    def of_photos(self) -> Float64Array:
        """Return the cost (V,) of each photo with all others: twice that of the arrangement."""
        alike, mirrored = self.evidence.pair_tables
        return np.asarray((alike * self.near + mirrored * self.opposite).sum(axis=1), np.float64)

    def moved(self, photo: int, moves_deg: Float64Array) -> Float64Array:
        """Return the costs (M,) of arrangements with one photo moved by so many degrees."""
        alike, mirrored = (table[photo] for table in self.evidence.pair_tables)
        places = self.azimuth[photo] + np.radians(moves_deg)
        near, opposite = _nearness(places[:, None] - self.azimuth)
        rest = self.of_photos.sum() / 2 - self.of_photos[photo]
        return np.asarray(rest + near @ alike + opposite @ mirrored, np.float64)

    def swapped(self, photo: int, others: Int64Array) -> Float64Array:
        """Return the costs (M,) of arrangements with one photo in the place of each of others."""
        change = np.zeros(len(others))
        for table, nearness in zip(
            self.evidence.pair_tables, (self.near, self.opposite), strict=True
        ):
            parts = (table[photo] - table[others]) * (nearness[others] - nearness[photo])
            parts[:, photo] = parts[np.arange(len(others)), others] = 0  # the two as before
            change += parts.sum(axis=1)
        return np.asarray(self.of_photos.sum() / 2 + change, np.float64)


def _nearness(gap: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return how near views this many radians apart are to each other, and to opposite."""
    along = np.cos(gap)
    return np.exp(NEAR * (along - 1)), np.exp(OPPOSITE * (-along - 1))


def _looks_cost(azimuth: Float64Array, evidence: Evidence) -> Float64Array:
    """Return what it costs that neighbours around the head look unlike."""
    if evidence.unlike is None:
        return np.zeros(len(azimuth))
    around = np.argsort(azimuth % 360.0, axis=1)
    pairs = np.nan_to_num(evidence.unlike)[around, np.roll(around, -1, axis=1)]
    return np.asarray(LOOKS_WEIGHT * evidence.weight * pairs.sum(axis=1), np.float64)


def _skin_cost(across: Float64Array, ahead: Float64Array, evidence: Evidence) -> Float64Array:
    """Return the misfit of skin's share and moment to their usual course around a head."""
    if evidence.skin is None:
        return np.zeros(len(across))
    known = np.isfinite(evidence.skin[:, 0])
    share, moment = evidence.skin[known].T
    across, ahead = across[:, known], ahead[:, known]
    misfit = _misfit(np.ones_like(ahead), ahead, share / SHARE_SPREAD)
    misfit += _misfit(-across, -2 * across * ahead, moment / MOMENT_SPREAD)
    return misfit / 2 * evidence.weight


def _misfit(first: Float64Array, second: Float64Array, values: Float64Array) -> Float64Array:
    """Return the squared misfit (B,) of values (V,) by two courses (B, V), of positive weights."""
    norms = np.maximum([_dot(first, first), _dot(second, second)], 1e-9)
    both, a, b = _dot(first, second), first @ values, second @ values
    weights = np.array([norms[1] * a - both * b, norms[0] * b - both * a])
    explained = (weights * [a, b]).sum(axis=0) / np.maximum(norms[0] * norms[1] - both**2, 1e-9)
    one = (np.maximum([a, b], 0) ** 2 / norms).max(axis=0)
    positive = (weights >= 0).all(axis=0)
    return np.asarray(values @ values - np.where(positive, explained, one), np.float64)


def _dot(one: Float64Array, other: Float64Array) -> Float64Array:
    """Return the scalar products (B,) of rows."""
    return np.asarray(np.einsum("bv,bv->b", one, other), np.float64)
