"""Lead strands to their tie and down the tail that hangs from it.

On the scalp a strand follows the measured orientation, its sign and what the photos do not show
given by the way to the tie; hair from farther away lies over hair from nearer. It enters the ring
at the side it comes from, keeps its place in the section of the tail, and ends where the tail has
become too thin for all: hair is packed as densely at the end as where the tail is widest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array, across, unit_vectors
from hairkit.field.growth_prior import gradient
from hairkit.grooming.fringe import hang_fringe
from hairkit.types.strands import Strands
from hairkit.types.tie import Tail, TiedHair
from hairkit.types.volume import Hull, OrientationField, symmetric_matrices

STEP = 0.003
"""Metres of a step on the scalp."""
LONGEST_WAY = 0.35
"""Metres on the scalp after which a strand that has not reached its tie is led there directly."""
TURN_IN = 0.025
"""Metres from the tie at which strands leave the scalp and turn into the ring."""
SKIN = 0.0015
"""Metres that hair keeps off the skin."""
TRUST = 0.7
"""Share of the measured direction in a step, against the way to the tie."""
MARCH = 0.0015
"""Metres of the steps by which the thickness of the hair is measured along the normal."""
THICKEST = 0.02
"""Metres of hair that lies tight on the scalp, at most: thicker are ghosts beside the neck."""
THICK_PERCENTILE = 60
"""Percentile of the thickness over the scalp that bounds it everywhere, times `THICK_SPREAD`."""
THICK_SPREAD = 1.3
SMOOTH_CELLS, SMOOTH_STEPS = 1.0, 4.0
"""Standard deviations, in cells and in steps along a strand, that make the height above the skin
smooth."""
RISE = 0.5
"""Height that a strand gains over its way from the root, at most: true strands leave the skin at a
sine of 0.45 where they are tied, and rise no steeper over their first 2 cm."""
NEIGHBOURS = 24
"""Points of other strands among which the farthest-come tells how much hair lies underneath."""
LEADERS = 1500
"""Strands, at most, that are asked for the hair underneath."""
SECTOR = 32
"""Strands of neighbouring angles among which the radius is spread."""
GOLDEN = 2.399963229728653
"""Golden angle, radians."""
BUNDLES = 3
SIDE, DEPTH = 0.55, 0.35
"""Half width and half depth of the figure of eight, in half diameters of the section."""
THIN = 0.45
"""Radius of a bundle, in half diameters of the section."""


def lead_to_ties(strands: Strands, tied: TiedHair, hull: Hull, field: OrientationField) -> Strands:
    """Return strands of equal point counts that pass through the nearest tie; group k is tie k - 1.

    The fringe hangs loose, in group 0. Without ties the strands come back as they are.
    """
    if not tied.tails or not len(strands):
        return strands
    roots = strands.roots.astype(np.float64)
    rings = np.array([tail.tie.centre for tail in tied.tails], np.float64)
    nearest = cKDTree(rings).query(roots)[1]
    count = len(strands.points) // len(strands)
    points = strands.points.reshape(len(strands), count, 3).copy()
    for number, tail in enumerate(tied.tails):
        own = np.flatnonzero(nearest == number)
        if len(own):
            points[own] = _tied_paths(roots[own], tail, hull, field, count)
    loose, hanging = hang_fringe(roots, tied, count)
    points[loose] = hanging
    group = (nearest + 1).astype(np.int32)
    group[loose] = 0
    return replace(strands, points=points.reshape(-1, 3), group=group)


def _tied_paths(
    roots: Float64Array, tail: Tail, hull: Hull, field: OrientationField, count: int
) -> Float32Array:
    """Return the strands (N, count, 3) from roots (N, 3) through a tie to the end of its tail."""
    ways, arrived = _ways_to_tie(roots, tail, hull, field)
    ways = _lay_over(ways, arrived, hull)
    place = _places_in_section(ways, arrived, tail)
    paths = []
    for way, last, (u, v), end in zip(ways, arrived, place, _ends(len(roots), tail), strict=True):
        course = plait(u, v, tail)[: end + 1]
        hanging = tail.spine[: end + 1] + np.einsum("ms,msk->mk", course, tail.spokes[: end + 1])
        paths.append(_join(way[: last + 1], hanging.astype(np.float64)))
    return Strands.from_list(paths).resampled(count).points.reshape(len(roots), count, 3)


def _ways_to_tie(
    roots: Float64Array, tail: Tail, hull: Hull, field: OrientationField
) -> tuple[Float64Array, Int64Array]:
    """Return ways (N, M, 3) along the scalp towards the tie and each one's last point (N,)."""
    steps = int(LONGEST_WAY / STEP)
    at = roots.copy()
    ways = np.repeat(at[:, None], steps + 1, axis=1)
    last = np.zeros(len(roots), np.int64)
    going = np.arange(len(roots))
    ring = tail.tie.centre.astype(np.float64)
    heading = np.zeros_like(roots)
    tensors = field.tensors()
    for step in range(1, steps + 1):
        going = going[np.linalg.norm(at[going] - ring, axis=1) > TURN_IN]
        if not len(going):
            break
        p = at[going]
        outward = _outward(hull, p)
        goal = unit_vectors(across(outward, ring - p))
        around = symmetric_matrices(hull.grid.sample(tensors, p + SKIN * outward))
        measured = unit_vectors(across(outward, np.einsum("nij,nj->ni", around, goal)))
        wanted = unit_vectors(goal + TRUST * (measured - goal))
        heading[going] = unit_vectors(heading[going] + wanted)
        p = p + STEP * heading[going]
        distance = hull.grid.sample(hull.head_distance, p)[:, None].astype(np.float64)
        at[going] = p + (SKIN - distance) * _outward(hull, p)
        ways[going, step] = at[going]
        last[going] = step
    return ways, last


def _lay_over(ways: Float64Array, last: Int64Array, hull: Hull) -> Float64Array:
    """Return the ways lifted off the skin: the farther a strand has come, the higher it lies."""
    count, steps, _ = ways.shape
    real = np.arange(steps)[None, :] <= last[:, None]
    arc = np.broadcast_to(STEP * np.arange(steps), (count, steps))
    leaders = np.zeros(count, bool)
    leaders[:: -(-count // LEADERS)] = True
    known = real & leaders[:, None]
    points = ways[real]
    near = cKDTree(ways[known]).query(points, k=NEIGHBOURS)[1]
    farthest = arc[known][np.minimum(near, known.sum() - 1)].max(axis=1)
    height = np.zeros((count, steps))
    height[real] = _thickness(points, hull) * np.clip(arc[real] / np.maximum(farthest, STEP), 0, 1)
    height = np.minimum(_smooth_along(height, real) - SKIN, RISE * arc)
    lifted = ways.copy()
    lifted[real] = points + np.maximum(height[real], 0)[:, None] * _outward(hull, points)
    return lifted


def _smooth_along(values: Float64Array, real: BoolArray) -> Float64Array:
    """Return values (N, M) of points smoothed along their ways, by the real (N, M) ones alone."""
    total = ndimage.gaussian_filter1d(np.where(real, values, 0), SMOOTH_STEPS, 1, mode="constant")
    weight = ndimage.gaussian_filter1d(real.astype(float), SMOOTH_STEPS, 1, mode="constant")
    return np.asarray(total / np.maximum(weight, 1e-9))


def _thickness(points: Float64Array, hull: Hull) -> Float64Array:
    """Return the thickness (N,) of the hair above points (N, 3) on the skin, metres.

    It is the integral of the smoothed hull along the normal, so that cells leave no steps.
    """
    outward = _outward(hull, points)
    hair = (hull.dense | (hull.head_distance < 0)).astype(np.float32)
    hair = ndimage.gaussian_filter(hair, SMOOTH_CELLS)
    thickness, filled = np.full(len(points), SKIN), np.ones(len(points))
    for height in np.arange(SKIN + MARCH, THICKEST, MARCH):
        filled = np.minimum(filled, hull.grid.sample(hair, points + height * outward))
        thickness += MARCH * filled
    usual = THICK_SPREAD * float(np.percentile(thickness, THICK_PERCENTILE))
    return np.asarray(np.minimum(thickness, usual))


def _places_in_section(ways: Float64Array, last: Int64Array, tail: Tail) -> Float64Array:
    """Return where in the unit disc (N, 2) strands pass the ring, evenly spread over it.

    The angle is that from which a strand comes, the radius grows with the length of its way.
    """
    come = ways[np.arange(len(ways)), last] - tail.tie.centre
    frame = unit_vectors(tail.spokes[0].astype(np.float64))
    angle = np.arctan2(come @ frame[1], come @ frame[0])
    order = np.argsort(angle, kind="stable")
    turn = np.empty(len(ways))
    turn[order] = 2 * np.pi * (np.arange(len(ways)) + 0.5) / len(ways) - np.pi
    sector = np.zeros(len(ways), np.int64)
    sector[order] = np.arange(len(ways)) // SECTOR
    rank = np.empty(len(ways))
    by_way = np.lexsort((last, sector))
    first = np.searchsorted(sector[by_way], sector[by_way])
    size = np.bincount(sector)[sector[by_way]]
    rank[by_way] = (np.arange(len(ways)) - first + 0.5) / size
    radius = np.sqrt(rank)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def _ends(count: int, tail: Tail) -> Int64Array:
    """Return the last section (N,) that each of `count` strands reaches."""
    quantile = np.mod((np.arange(count) + 0.5) * GOLDEN / (2 * np.pi), 1.0)
    reached = np.searchsorted(-tail.share, -quantile, side="left") - 1
    return np.asarray(np.clip(reached, 1, len(tail.share) - 1).astype(np.int64))


def _join(way: Float64Array, hanging: Float64Array) -> Float64Array:
    """Return a way and the strand in the tail (M, 3), joined by a cubic (Hermite) curve."""
    start, end = way[-1], hanging[0]
    gap = float(np.linalg.norm(end - start))
    if gap < STEP:
        return np.concatenate([way, hanging])
    leave = way[-1] - way[-2] if len(way) > 1 else end - start
    leave = gap * leave / max(float(np.linalg.norm(leave)), 1e-9)
    enter = hanging[1] - hanging[0]
    enter = gap * enter / max(float(np.linalg.norm(enter)), 1e-9)
    t = np.linspace(0, 1, max(int(gap / STEP), 2) + 1)[1:-1, None]
    curve = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + (t**3 - 2 * t**2 + t) * leave
        + (3 * t**2 - 2 * t**3) * end
        + (t**3 - t**2) * enter
    )
    return np.concatenate([way, curve, hanging])


def _outward(hull: Hull, points: Float64Array) -> Float64Array:
    return gradient(hull.grid, hull.head_distance, points)


def plait(u: float, v: float, tail: Tail) -> Float64Array:
    """Return where (M, 2) a strand runs in the sections of a tail, in their half diameters.

    It passes the ring at u, v in the unit disc; there the angle tells its bundle. The three bundles
    of a braid follow one another on a figure of eight, a third of a period apart, whose pitch is
    that at which they cross the spine at the measured angle.
    """
    ring = np.array([u, v])
    if not tail.crossing:
        return np.broadcast_to(ring, (len(tail.spine), 2))
    bundle = int((np.arctan2(v, u) / (2 * np.pi) + 0.5) * BUNDLES) % BUNDLES
    steps = np.linalg.norm(np.diff(tail.spine, axis=0), axis=1)
    wide = np.linalg.norm(tail.spokes[:, 0], axis=1).astype(np.float64)
    # a bundle at x = a sin(phase) goes sideways by a d(phase) / sqrt 2 in the mean square
    turn = np.sqrt(2) * np.tan(tail.crossing) / (SIDE * np.maximum(wide, 1e-6))
    phase = np.append(0, np.cumsum(steps * turn[1:])) + 2 * np.pi * bundle / BUNDLES
    middle = np.stack([SIDE * np.sin(phase), DEPTH * np.sin(2 * phase)], axis=1)
    return middle + THIN * ring
