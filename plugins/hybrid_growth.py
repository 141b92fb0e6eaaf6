"""Growth along a signed field: the patent's rules, one point after the other from every root.

`p_i = p_(i-1) + delta H(p_(i-1)) / |H|` with a step delta of 1 mm, until the internal distance says
that the point has left the hair (I > 1.1) or the strand is as long as it may be. With a field that
has no signs of its own, its tensors are followed along the growth potential.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit, prange
from scipy import ndimage

from hairkit import Hull, Mask, OrientationField, OrientationMap, Roots, Scene, Strands, hookimpl
from hairkit.clearance import kept_outside
from hairkit.combing import hair_length, scalp_way
from hairkit.field_sampling import gradient_at, make_unit, sample_at
from hairkit.options import option
from hairkit.stored import Float32Array
from hairkit.volume import cell_slopes, symmetric_matrices
from hairkit.waves import add_waves, measure_waves

KEPT = 4
"""Every so many steps a point is kept: strands are resampled anyway."""
BLOCK = 20_000
"""Strands grown at a time, which bounds the memory."""


@dataclass(frozen=True)
class Options:
    """Settings of the growth."""

    step: float = option(0.001, low=1e-4, high=0.01, unit="m", doc="Length of a step (delta).")
    bound: float = option(
        1.1, low=1, high=10, doc="Internal distance at which a strand has left the hair."
    )
    max_length: float = option(1.2, low=0.01, high=5, unit="m", doc="Longest strand.")
    reach: float = option(
        2.0,
        low=0.1,
        high=5,
        doc="Strands grow no longer than this share of the longest way through the hair.",
    )
    blind: float = option(
        0.02, low=0, high=0.2, unit="m", doc="Way after the root on which nothing ends a strand."
    )
    slide_sine: float = option(
        0.35,
        low=0,
        high=1,
        doc="Strands that leave the hair at an angle of a smaller sine run on along its surface;"
        " 0: never.",
    )
    slide_from: float = option(
        1.0, low=0, high=10, doc="Internal distance from which strands run along the surface."
    )
    inertia: float = option(
        0.92, low=0, high=0.99, doc="Share of the previous direction in the next step's."
    )
    clearance: float = option(0.001, low=0, high=0.02, unit="m", doc="Distance kept from the head.")
    waves: bool = option(True, doc="Wind the strands as the photos' waves do.")
    points: int = option(64, low=2, high=255, doc="Points of every strand; equal segments.")


@hookimpl
def track(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    options: Options,
) -> Strands:
    """Grow one strand from every root."""
    way = hair_length(hull, scalp_way(scene.head, hull))
    direction = _signed(field)
    distance = _distance(field, hull)
    parts = [
        grown(field, direction, distance, roots.positions[i : i + BLOCK], way, options)
        for i in range(0, len(roots), BLOCK)
    ]
    points = np.concatenate([part.points for part in parts])
    ends = [0, *np.cumsum([len(part.points) for part in parts[:-1]])]
    offsets = [part.offsets[1:] + end for part, end in zip(parts, ends, strict=True)]
    strands = Strands(points, np.concatenate([[0], *offsets])).resampled(options.points)
    strands = replace(strands, root_uv=roots.uv)
    if options.waves:
        strands = add_waves(strands, measure_waves(orientations, masks, scene.cameras))
    return kept_outside(strands, hull, options.clearance)


def grown(
    field: OrientationField,
    direction: Float32Array,
    distance: Float32Array,
    starts: Float32Array,
    way: float,
    options: Options,
) -> Strands:
    """Return the strands grown from `starts` (N, 3), metres, by the rules.

    Parameters
    ----------
    direction
        (X, Y, Z, 3) signed field, 0 where nothing is known.
    distance
        (X, Y, Z) internal distance.
    way
        Longest way through the hair, metres; strands slide along its surface only up to there.
    """
    steps = max(int(min(options.max_length, options.reach * way) / options.step), 2)
    points = np.zeros((len(starts), steps // KEPT + 2, 3), np.float32)
    counts = np.zeros(len(starts), np.int64)
    rules = (
        options.step,
        options.bound,
        options.inertia,
        int(options.blind / options.step),
        steps,
        options.slide_sine,
        options.slide_from,
        int(way / options.step),
    )
    volume = np.concatenate([direction, distance[..., None]], axis=3)
    _grow(field.grid.origin, field.grid.spacing, volume, rules, starts, points, counts)
    rows = np.arange(points.shape[1])[None] < counts[:, None]
    return Strands(points[rows], np.concatenate([[0], np.cumsum(counts)]))


def _signed(field: OrientationField) -> Float32Array:
    """Return the field's own signed direction, or its tensors' along the growth."""
    if field.direction is not None:
        return field.direction
    known = np.abs(field.tensor).max(axis=3) > 0
    main = np.linalg.eigh(symmetric_matrices(field.tensor[known]))[1][:, :, 2]
    slope = cell_slopes(field.growth)[known]
    main *= np.where((main * slope).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    direction = np.zeros((*field.grid.shape, 3), np.float32)
    direction[known] = main
    return direction


def _distance(field: OrientationField, hull: Hull) -> Float32Array:
    """Return the field's internal distance, or 1 and the distance to the hull in centimetres."""
    if field.internal_distance is not None:
        return field.internal_distance
    filled = hull.dense | (hull.head_distance < 0)
    away = ndimage.distance_transform_edt(~filled) * (100 * hull.grid.spacing)
    return np.where(away > 0, 1 + away, 0.5).astype(np.float32)


@njit(cache=True, parallel=True)
def _grow(origin, spacing, volume, rules, starts, points, counts):  # type: ignore[no-untyped-def]
    for s in prange(len(starts)):
        counts[s] = _grow_one(origin, spacing, volume, rules, starts[s], points[s])


@njit(cache=True)
def _grow_one(origin, spacing, volume, rules, start, points):  # type: ignore[no-untyped-def]
    """Write every KEPT-th point of one strand, and its last; returns how many, at least two."""
    step, bound, inertia, blind, steps, sine, skin, sliding = rules
    p, d, found = np.empty(3), np.zeros(3), np.empty(4)
    p[:] = start
    points[0] = p
    count = 1
    for i in range(1, steps + 1):
        sample_at(origin, spacing, volume, p, found)
        known = make_unit(found[:3])
        if i > blind and (found[3] > bound or not known):
            if (i - 1) % KEPT != 0:
                points[count] = p
                count += 1
            break
        if known and i > 1:
            for axis in range(3):
                d[axis] = inertia * d[axis] + (1 - inertia) * found[axis]
        elif known:
            d[:] = found[:3]
        if not make_unit(d):
            break
        if i < sliding and found[3] >= skin:
            _slide(origin, spacing, volume, p, sine, d)
        for axis in range(3):
            p[axis] += step * d[axis]
        if i % KEPT == 0 or i == steps:
            points[count] = p
            count += 1
    if count == 1:  # nothing is known at the root: a stub keeps the strand's place
        points[1] = points[0]
        points[1, 1] += step
        count = 2
    return count


@njit(cache=True)
def _slide(origin, spacing, volume, p, sine, d):  # type: ignore[no-untyped-def]
    """Take from d (3,) its part along the internal distance's gradient, p beyond the surface."""
    normal = np.empty(3)
    gradient_at(origin, spacing, volume[..., 3:], p, normal)
    outward = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]
    if 0 < outward < sine:
        for axis in range(3):
            d[axis] -= outward * normal[axis]
        make_unit(d)
