"""Arrangements of photos around a head, and how well the photos fit each.

A `Ring` says in which order photos follow each other around the head and which steps of the turn
they take. Faces fix its phase; faces, outlines and skin score it. Costs are in units of half a
squared standard deviation, as negative logarithms of likelihoods are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int64Array
from hairkit.types.face import Face

STRAY_DEG, YAW_DEG = 8.0, 4.0
"""Standard deviation of a photo's azimuth from its place in an even turn taken by hand, and of the
azimuth that a face tells."""
OBLIQUE_DEG, OBLIQUE_GROWTH = 45.0, 2.0
"""Yaw from which on faces may be mistaken profiles: the deviation grows by this many degrees for
each degree beyond. Profiles were found as faces with yaws of 39 to 62 degrees."""
FACE_CAP = 30.0
"""Largest cost of one face: beyond 50 degrees off, farther is not worse."""
HIDDEN_DEG, HIDDEN_SPREAD_DEG = 45.0, 10.0
"""Nearer than this to the front a face is found; how gradually that ends."""
OUTLINE_WEIGHT = 60.0
"""Cost of outlines that differ by one more head width than usual. On nine captures the next best
order costs 0.07 head widths more."""
OUTLINE_BEND = 0.08
"""Differences between outlines count less from this on, head widths: a ponytail swings."""
NEIGHBOUR_DEG, OPPOSITE_DEG = 35.0, 20.0
"""Outlines of views that are about this near each other are alike, those of views this near to
opposite mirror each other."""
NEIGHBOUR_SHARE = 0.5
"""Weight of neighbours over that of opposite views: outlines change from view to view."""
SHARE_SPREAD, MOMENT_SPREAD = 0.06, 0.012
"""Deviation of skin's share of the head, and of its sideways moment (head widths), from a smooth
curve over the azimuth."""
IRREGULAR, CLOSED, GAP, SHUFFLED = 4.0, 2.0, 3.0, 6.0
"""Prior costs: photos not evenly spaced, the last photo repeats the first, one step is missing,
photos not in the order of their names."""
MOST_WITH_GAP = 12
"""In turns of more photos one that is missing moves the others little."""
TURN_OF = 8
"""Weights of outlines are those of this number of photos."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the photos of a ring tell about their places."""

    yaw_deg: Float64Array
    """(V,) azimuths that sure faces tell; NaN without."""
    alike: Float64Array | None
    """(V, V) distances of outlines, None where they are unknown."""
    mirrored: Float64Array | None
    """(V, V) the same, one of the pair mirrored."""
    skin: Float64Array | None
    """(V, 2) share of the head that is skin and its moment."""

    @classmethod
    def of(
        cls,
        faces: Sequence[Face],
        outlines: tuple[Float64Array, Float64Array] | None,
        skin: Float64Array | None,
    ) -> Evidence:
        yaw = np.array([face.yaw_deg if face.sure else np.nan for face in faces])
        alike, mirrored = outlines if outlines is not None else (None, None)
        return cls(yaw, alike, mirrored, skin)


@dataclass(frozen=True, eq=False)
class Ring:
    """Photos in the order of the turn and the steps between them, before the phase is known."""

    order: Int64Array
    """(R,) photos in the order of growing azimuth; those that are missing are from above."""
    steps_deg: Float64Array | None
    """(R,) nominal azimuths of these from the first on; None: spread between the faces."""
    prior: float
    """Cost of so unusual a turn."""


@dataclass(frozen=True, eq=False)
class Placed:
    """Photos with azimuths, and what that costs."""

    azimuth_deg: Float64Array
    """(V,) of each photo, in (-180, 180]; 0 of photos from above without a face."""
    above: BoolArray
    """(V,) true for photos from above."""
    off_deg: Float64Array
    """(V,) by how much faces contradict the steps, 0 without a face."""
    cost: float
    in_order: bool = True
    """False for an order that the names of the photos do not suggest."""


def wrap(angle_deg: Float64Array) -> Float64Array:
    """Return angles in (-180, 180]."""
    wrapped: Float64Array = 180.0 - (180.0 - np.asarray(angle_deg, np.float64)) % 360.0
    return wrapped


def rings_of(order: Int64Array, prior: float) -> Iterator[Ring]:
    """Yield the turns that a row of photos may be: both directions and several kinds of steps."""
    count = len(order)
    places = np.arange(count)
    for row in (order, order[::-1]):
        yield Ring(row, places * 360.0 / count, prior)
        yield Ring(row, None, prior + IRREGULAR)
        if count > 3:
            yield Ring(row, (places % (count - 1)) * 360.0 / (count - 1), prior + CLOSED)
        for gap in range(1, count + 1 if count <= MOST_WITH_GAP else 1):
            yield Ring(row, (places + (places >= gap)) * 360.0 / (count + 1), prior + GAP)


def place(ring: Ring, evidence: Evidence) -> Placed | None:
    """Return the azimuths of the photos and their cost; None without a face to start from."""
    yaw = evidence.yaw_deg[ring.order]
    seen = np.isfinite(yaw)
    if not seen.any():
        return None
    steps = _spread_between(yaw) if ring.steps_deg is None else ring.steps_deg
    spread = np.hypot(STRAY_DEG, yaw_spread(yaw))
    # the weighted circular mean of what the faces say of the phase
    off = np.exp(1j * np.radians(yaw[seen] - steps[seen]))
    azimuth = wrap(steps + float(np.degrees(np.angle(spread[seen] ** -2 @ off))))
    off = np.where(seen, wrap(yaw - azimuth), 0.0)
    cost = np.minimum(off[seen] ** 2 / (2 * spread[seen] ** 2), FACE_CAP).sum()
    azimuth[seen] = wrap(azimuth + (STRAY_DEG / spread) ** 2 * off)[seen]
    cost += _hidden_cost(azimuth[~seen]) + _outline_cost(azimuth, ring.order, evidence)
    cost += _skin_cost(azimuth, ring.order, evidence)
    count = len(evidence.yaw_deg)
    everywhere, above, contradiction = (
        np.nan_to_num(evidence.yaw_deg),
        np.ones(count),
        np.zeros(count),
    )
    everywhere[ring.order], above[ring.order], contradiction[ring.order] = azimuth, 0, off
    return Placed(everywhere, above > 0, contradiction, float(cost) + ring.prior)


def yaw_spread(yaw_deg: Float64Array) -> Float64Array:
    """Return the standard deviation of azimuths that faces tell, degrees."""
    beyond = np.maximum(np.abs(yaw_deg) - OBLIQUE_DEG, 0)
    return np.asarray(YAW_DEG + OBLIQUE_GROWTH * beyond, np.float64)


def _spread_between(yaw: Float64Array) -> Float64Array:
    """Return azimuths along a ring: monotone through the faces' (NaN without), even between.

    Faces that run against the turn are of photos from one place: they get their mean (pool
    adjacent violators).
    """
    count = len(yaw)
    first = int(np.nanargmin(np.abs(yaw)))
    start = (first - count // 2) % count  # opposite to the front, where no face is
    row = (start + np.arange(count)) % count
    known = np.nonzero(np.isfinite(yaw[row]))[0]
    values = _pool_violators(yaw[row[known]])
    knots = np.concatenate([known, known[:1] + count])
    levels = np.concatenate([values, values[:1] + 360.0])
    around = np.interp(np.arange(known[0], known[0] + count), knots, levels)
    result = np.empty(count)
    result[row[np.arange(known[0], known[0] + count) % count]] = around
    return result


def _pool_violators(values: Float64Array) -> Float64Array:
    """Return the nearest sequence that never falls (isotonic regression)."""
    pools: list[tuple[float, int]] = []
    for value in values:
        pools.append((float(value), 1))
        while len(pools) > 1 and pools[-1][0] <= pools[-2][0]:
            (right, n), (left, m) = pools.pop(), pools.pop()
            pools.append(((left * m + right * n) / (m + n), m + n))
    return np.concatenate([np.full(size, mean) for mean, size in pools])


def _hidden_cost(azimuth: Float64Array) -> float:
    """Return what it costs that photos from the front show no face."""
    inside = np.maximum(HIDDEN_DEG - np.abs(azimuth), 0) / HIDDEN_SPREAD_DEG
    return float((inside**2).sum() / 2)


def _outline_cost(azimuth: Float64Array, photos: Int64Array, evidence: Evidence) -> float:
    """Return the cost of outlines that differ although the views are neighbours or opposite."""
    if evidence.alike is None or evidence.mirrored is None:
        return 0.0
    first, second = np.triu_indices(len(azimuth), 1)
    gap = np.abs(wrap(azimuth[first] - azimuth[second]))
    cost = 0.0
    for distance, angle, width, share in (
        (evidence.alike, gap, NEIGHBOUR_DEG, NEIGHBOUR_SHARE),
        (evidence.mirrored, 180.0 - gap, OPPOSITE_DEG, 1.0),
    ):
        pairs = OUTLINE_BEND * np.tanh(distance[photos[first], photos[second]] / OUTLINE_BEND)
        near = np.exp(-((angle / width) ** 2) / 2)
        cost += share * float(near @ (pairs - pairs.mean()))
    return OUTLINE_WEIGHT * cost * min(1.0, TURN_OF / len(azimuth)) ** 2


def _skin_cost(azimuth: Float64Array, photos: Int64Array, evidence: Evidence) -> float:
    """Return the misfit of skin's share and moment to their usual course around a head."""
    from scipy.optimize import nnls  # slow to load

    if evidence.skin is None:
        return 0.0
    angle = np.radians(azimuth)
    share, moment = evidence.skin[photos].T
    one = np.ones_like(angle)
    courses = (
        (share / SHARE_SPREAD, np.stack([one, np.cos(angle)], axis=1)),
        (moment / MOMENT_SPREAD, np.stack([-np.sin(angle), -np.sin(2 * angle)], axis=1)),
    )
    misfit = sum(nnls(basis, values)[1] ** 2 for values, basis in courses)
    return float(misfit) / 2 * min(1.0, TURN_OF / len(azimuth))
