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
from hairkit.arrays import Float32Array
from hairkit.field.growth_prior import hair_length, scalp_way
from hairkit.field.sampling_kernels import gradient_at, make_unit, sample_at
from hairkit.grooming.postprocess import FinishOptions, finished
from hairkit.options import option
from hairkit.types.volume import cell_slopes, symmetric_matrices

NEAR = 4
"""Cells of the grid in a row whose roots are grown together."""
PARTS = 64
"""Runs of roots that are grown side by side."""


@dataclass(frozen=True)
class Options(FinishOptions):
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
    strands = grown(field, _signed(field), _distance(field, hull), roots.positions, way, options)
    return finished(replace(strands, root_uv=roots.uv), scene, masks, orientations, hull, options)


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
    points = np.zeros((len(starts), options.points, 3), np.float32)
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
    # neighbours grow one after the other: what they read of the field is still in the cache
    order = np.lexsort((field.grid.nearest_cell(starts) // NEAR).T)
    _grow(field.grid.origin, field.grid.spacing, volume, rules, starts, order, points)
    return Strands(points.reshape(-1, 3), np.arange(len(starts) + 1) * options.points)


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
def _grow(origin, spacing, volume, rules, starts, order, points):  # type: ignore[no-untyped-def]
    """Write strands (N, M, 3) of equal steps, grown in `order` (N,)."""
    parts = min(PARTS, len(order))
    for part in prange(parts):
        course = np.empty((rules[4] + 1, 3))
        for k in range(part * len(order) // parts, (part + 1) * len(order) // parts):
            s = order[k]
            count = _grow_one(origin, spacing, volume, rules, starts[s], course)
            _evenly(course, count, points[s])


@njit(cache=True)
def _evenly(course, count, points):  # type: ignore[no-untyped-def]
    """Write points (M, 3) at equal shares of a course of `count` points, all steps equal."""
    for m in range(len(points)):
        at = m * (count - 1) / (len(points) - 1)
        before = min(int(at), count - 2)
        for axis in range(3):
            first = course[before, axis]
            points[m, axis] = first + (course[before + 1, axis] - first) * (at - before)


@njit(cache=True)
def _grow_one(origin, spacing, volume, rules, start, course):  # type: ignore[no-untyped-def]
    """Write one strand's points into course (M, 3); returns how many, at least two."""
    step, bound, inertia, blind, steps, sine, skin, sliding = rules
    p, d, found = np.empty(3), np.zeros(3), np.empty(4)
    p[:] = start
    course[0] = p
    count = 1
    for i in range(1, steps + 1):
        sample_at(origin, spacing, volume, p, found)
        known = make_unit(found[:3])
        if i > blind and (found[3] > bound or not known):
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
        course[count] = p
        count += 1
    if count == 1:  # nothing is known at the root: a stub keeps the strand's place
        course[1] = course[0]
        course[1, 1] += step
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
