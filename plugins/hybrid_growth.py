"""Strand growth along a signed field by the patent's rules, point by point from every root.

`p_i = p_(i-1) + delta H(p_(i-1)) / |H|` with a step delta of 1 mm, until the internal distance says
that the point has left the hair (I > 1.1 in the patent) or the strand has its greatest length. In a
field without signs the tensors are followed in the direction in which the growth potential rises.

Added to the patent, and off in the recipe `patent`: a strand that leaves the hair goes on for a
while (`patience`, the uncertain steps of the thesis) and is cut where it left; a strand that slides
is turned back to the surface (`pull`); one that stands out of the side ends at the surface
(`LEFT`), others farther outside (`bound`), because their tips hang below what all views agree on; a
strand that meets the shoulders turns along them (`turn_sine`); and hair that photos show and no
strand reaches gets strands of its own (`cover`, `hairkit.grooming.cover_hair`). Inertia, too, is an
addition.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit import (
    Hull,
    Mask,
    OrientationField,
    Roots,
    ScalpDistance,
    Scene,
    Strands,
    TiedHair,
    Waves,
    hookimpl,
)
from hairkit.arrays import Float32Array, Float64Array, Int64Array, for_kernel
from hairkit.field.growth_prior import hair_ways
from hairkit.field.sampling_kernels import copy_point, gradient_at, make_unit, sample_at
from hairkit.grooming.cover_hair import find_bare_cells, lead_to_roots, spread_seeds
from hairkit.grooming.postprocess import FinishOptions, finish
from hairkit.head_model.torso import Torso
from hairkit.options import option
from hairkit.parallel import compiled, compiled_with, parallel_for
from hairkit.types.volume import cell_slopes, symmetric_matrices

BLOCK = 4
"""Edge in cells of the blocks whose roots are grown one after the other: strands that read the same
part of the field find it in the cache."""
MIN_STRANDS = 32
"""Least number of strands worth a call on another thread."""
DISTANCE, GROWTH = 3, 4
"""Channels of internal distance and growth potential after the three of the direction."""
MAX_LENGTH = 1.2
"""Metres of the longest strand."""
BLIND = 1.5
"""Times the way to the tips on which nothing ends a strand at most: F at 4 mm/40 of three crops of
1.2 cm is 86.6 without it, 88.4 with it and 86.0 with 1; lengths are 1.46, 1.32 and 1.20."""
LEFT, BELOW = 1.1, -0.5
"""Internal distance at which a strand that stands out of the hair's side or top has left it, and
the upward part of the surface's normal below them. Tips of true strands are at 1.00 to 1.09 there
(medians of seven heads; 1.8 of an eighth), below at up to 1.85: they hang below what all views
agree on."""
EARLY = 0.2
"""Share of the way from the root to the tips on which no strand ends by standing out of the hair:
at the end of a parting long hair would be a tuft of stubs."""
CENTIMETRES = 100
"""Of a metre: the unit of the internal distance where the field has none of its own."""


@dataclass(frozen=True)
class Options(FinishOptions):
    """Settings of the growth."""

    step: float = option(0.001, low=1e-4, high=0.01, unit="m", doc="Length of a step (delta).")
    bound: float = option(
        1.6, low=1, high=10, doc="Internal distance at which a strand has left the hair below."
    )
    reach: float = option(
        2.0, low=0.1, high=5, doc="Greatest length of a strand over the way through the hair."
    )
    patience: float = option(
        0.012, low=0, high=0.1, unit="m", doc="Way outside the hair that ends no strand."
    )
    blind: float = option(
        0.02, low=0, high=0.2, unit="m", doc="Length from the root on which nothing ends a strand."
    )
    slide_sine: float = option(
        0.35, low=0, high=1, doc="Sine of the angle up to which strands slide on leaving; 0 never."
    )
    pull: float = option(
        1.0, low=0, high=10, doc="Sine of the turn back for each unit of distance outside the hair."
    )
    turn_sine: float = option(
        0.7, low=0, high=1, doc="Sine above which strands turn along the shoulders; 1 never."
    )
    inertia: float = option(
        0.9, low=0, high=0.99, doc="Share of the previous direction in the next step's."
    )
    cover: float = option(
        2.0,
        low=0,
        high=10,
        doc="Density, over the mean, of strands led to hair none reaches; 0: off.",
    )
    wave_share: float = option(
        0.18, low=0, high=1, doc="Share of a wave's pitch over which strands keep direction."
    )


@hookimpl
def track(
    scene: Scene,
    masks: tuple[Mask, ...],
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    waves: Waves,
    scalp_distance: ScalpDistance,
    tied: TiedHair,
    options: Options,
) -> Strands:
    """Grow one strand from every root."""
    longest = scalp_distance.hair_length
    ways = hair_ways(hull, field.growth, roots, longest)
    memory = options.wave_share * waves.pitch
    if memory > options.step:
        inertia = max(options.inertia, 1 - options.step / memory)
        options = replace(options, inertia=inertia)
    volume = signed_volume(field, _sign_directions(field), _distance(field, hull))
    shoulders = float(Torso.under(scene.head).joint[1])
    strands = grow(field, volume, roots.positions, ways, options, shoulders)
    if options.cover > 0 and not tied.tails:
        bare = find_bare_cells(strands, hull, masks, scene.cameras, scene.head)
        seeds = spread_seeds(bare, hull, options.cover * len(strands))
        if len(seeds):
            ways = ways[cKDTree(roots.positions).query(seeds)[1]]
            back = grow(field, volume, seeds, ways, options, shoulders, -1.0, early=0)
            ahead = grow(field, volume, seeds, ways, options, shoulders, early=0)
            led = (s.points.reshape(len(seeds), -1, 3) for s in (back, ahead))
            strands = lead_to_roots(strands, roots.positions, *led)
    return finish(replace(strands, root_uv=roots.uv), waves, tied, hull, field, options)


def grow(
    field: OrientationField,
    volume: SignedVolume,
    starts: Float32Array,
    ways: Float64Array,
    options: Options,
    shoulders: float = -np.inf,
    sign: float = 1.0,
    early: float = EARLY,
) -> Strands:
    """Return the strands grown from `starts` (N, 3), metres.

    Parameters
    ----------
    ways
        (N,) longest way from the scalp through the hair, metres. Strands slide only that far.
    shoulders
        Height below which strands that leave the hair may have met the shoulders, metres.
    sign
        1 to grow along the field, -1 against it.
    early
        Share of the way on which no strand ends by standing out of the hair.
    """
    steps = np.maximum(np.minimum(MAX_LENGTH, options.reach * ways) / options.step, 2)
    limits = np.stack([steps, ways / options.step], axis=1).astype(np.int64)
    points = np.zeros((len(starts), options.points, 3), np.float32)
    rules = Rules(
        options.step,
        options.bound,
        options.inertia,
        int(options.blind / options.step),
        int(options.patience / options.step),
        options.slide_sine,
        options.turn_sine,
        shoulders,
        options.pull,
        sign,
        float(early),  # of an integer, another kernel would be compiled
    )
    order = np.lexsort((field.grid.nearest_cell(starts) // BLOCK).T)
    growth = (volume, rules, for_kernel(starts), limits, order, points)
    parallel_for(_grow_strands, len(starts), *growth, min_chunk=MIN_STRANDS)
    return Strands(points.reshape(-1, 3), np.arange(len(starts) + 1) * options.points)


def signed_volume(
    field: OrientationField, direction: Float32Array, distance: Float32Array
) -> SignedVolume:
    """Return directions (X, Y, Z, 3), internal distance (X, Y, Z) and growth, side by side."""
    values = np.concatenate([direction, distance[..., None], field.growth[..., None]], axis=3)
    return SignedVolume(field.grid.origin, field.grid.spacing, values)


def _sign_directions(field: OrientationField) -> Float32Array:
    """Return the field's own signed direction, or its tensors' along the growth."""
    if field.direction is not None:
        return field.direction
    tensors = field.tensors()
    known = np.abs(tensors).max(axis=3) > 0
    main = np.linalg.eigh(symmetric_matrices(tensors[known]))[1][:, :, 2]
    slope = cell_slopes(field.growth, known)
    main *= np.where((main * slope).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    direction = np.zeros((*field.grid.shape, 3), np.float32)
    direction[known] = main
    return direction


def _distance(field: OrientationField, hull: Hull) -> Float32Array:
    """Return the field's internal distance, or 1 and the distance to the hull in centimetres."""
    if field.internal_distance is not None:
        return field.internal_distance
    filled = hull.dense | (hull.head_distance < 0)
    away = ndimage.distance_transform_edt(~filled) * (CENTIMETRES * hull.grid.spacing)
    return np.where(away > 0, 1 + away, 0.5).astype(np.float32)


class SignedVolume(NamedTuple):
    """The signed field and the internal distance, sampled together."""

    origin: Float64Array
    """(3,) lowest corner of the grid, metres, head frame."""
    spacing: float
    """Edge of a cell, metres."""
    values: Float32Array
    """(X, Y, Z, 5): direction, 0 where nothing is known, internal distance (`DISTANCE`) and growth
    potential (`GROWTH`)."""


class Rules(NamedTuple):
    """The options in the units of the growth; those without a text as in `Options` and `grow`."""

    step: float
    bound: float
    inertia: float
    blind_steps: int
    """Steps from the root on which nothing ends a strand."""
    patience_steps: int
    """Steps in a row outside the hair that do not end a strand."""
    slide_sine: float
    turn_sine: float
    shoulders: float
    """Height below which strands turn, metres."""
    pull: float
    sign: float
    early: float


@compiled_with(allocates=True)
def _grow_strands(
    first: int,
    last: int,
    volume: SignedVolume,
    rules: Rules,
    starts: Float32Array,
    limits: Int64Array,
    order: Int64Array,
    points: Float32Array,
) -> None:
    """Write strands order[first:last] into points (N, M, 3) of equal steps; `starts` is (N, 3).

    `limits` (N, 2) are the most steps of each strand, and those on which it may slide.
    """
    path = np.empty((int(MAX_LENGTH / rules.step) + 3, 3))
    for k in range(first, last):
        s = order[k]
        count = _grow_strand(volume, rules, starts[s], limits[s], path)
        _resample(path[:count], points[s])


@compiled
def _resample(path: Float64Array, points: Float32Array) -> None:
    """Write points (M, 3) at equal shares of a path (N, 3) of equal steps, N at least 2."""
    for m in range(len(points)):
        at = m * (len(path) - 1) / (len(points) - 1)
        before = min(int(at), len(path) - 2)
        for axis in range(3):
            first = path[before, axis]
            points[m, axis] = first + (path[before + 1, axis] - first) * (at - before)


@compiled_with(allocates=True, inside=True)
def _grow_strand(
    volume: SignedVolume, rules: Rules, start: Float32Array, limits: Int64Array, path: Float64Array
) -> int:
    """Write one strand's points into path (M, 3); return their number, at least 2."""
    p, d, found = np.empty(3), np.empty(3), np.empty(5)
    d[0], d[1], d[2] = 0.0, 0.0, 0.0
    copy_point(start, p)
    copy_point(p, path[0])
    count, inside, stands = 1, 1, False
    for i in range(1, limits[0] + 1):
        sample_at(volume.origin, volume.spacing, volume.values, p, found)
        known = make_unit(found[:3])
        if i <= min(rules.blind_steps, BLIND * limits[1]) or (
            known and found[DISTANCE] <= (LEFT if stands else rules.bound)
        ):
            inside = i
        elif i - inside > rules.patience_steps:
            break
        if known and i > 1:
            for axis in range(3):
                ahead = rules.sign * found[axis]
                d[axis] = rules.inertia * d[axis] + (1 - rules.inertia) * ahead
        elif known:
            for axis in range(3):
                d[axis] = rules.sign * found[axis]
        if not make_unit(d):
            break
        stands = False
        if rules.slide_sine > 0 and found[DISTANCE] >= 1:
            back = rules.pull * (found[DISTANCE] - 1)
            leaves = found[DISTANCE] > LEFT and i < rules.early * limits[1]
            stands = _slide(volume, rules, back, p, d, i < limits[1], leaves)
        for axis in range(3):
            p[axis] += rules.step * d[axis]
        copy_point(p, path[count])
        count += 1
    count = min(count, inside + 1)
    if count == 1:  # nothing is known at the root: a step upwards, since every root has a strand
        copy_point(path[0], path[1])
        path[1, 1] += rules.step
        count = 2
    return count


@compiled_with(allocates=True, inside=True)
def _slide(
    volume: SignedVolume,
    rules: Rules,
    back: float,
    p: Float64Array,
    d: Float64Array,
    slides: bool,
    leaves: bool,
) -> bool:
    """Bend d along the hair's surface, and `back` into the hair, where it `slides` or turns.

    It turns where it meets the shoulders, or `leaves` the hair near its root. Return whether it
    stands out of the hair, but for below.
    """
    normal = np.empty(3)
    distance = volume.values[..., DISTANCE : DISTANCE + 1]
    gradient_at(volume.origin, volume.spacing, distance, p, normal)
    outward = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]
    if outward < rules.slide_sine:
        if slides:
            for axis in range(3):
                d[axis] -= (max(outward, 0.0) + back) * normal[axis]
            make_unit(d)
        return False
    if leaves or (slides and p[1] < rules.shoulders):
        _turn(volume, rules, back, p, normal, d)
        return False
    return bool(normal[1] > BELOW)


@compiled_with(allocates=True)
def _turn(
    volume: SignedVolume,
    rules: Rules,
    back: float,
    p: Float64Array,
    normal: Float64Array,
    d: Float64Array,
) -> None:
    """Bend d along the surface of a normal (3,) where the way to the tips leads along it."""
    way = np.empty(3)
    gradient_at(volume.origin, volume.spacing, volume.values[..., GROWTH : GROWTH + 1], p, way)
    known = way[0] * way[0] + way[1] * way[1] + way[2] * way[2] > 0
    rise = way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]
    if known and 1 - rise * rise > rules.turn_sine**2:
        outward = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]
        for axis in range(3):
            d[axis] += way[axis] - (outward + rise + back) * normal[axis]
        make_unit(d)
