"""Silhouette coherence: how well rays through one view's outline touch the other silhouettes.

A point of an outline is the picture of a point on the subject, and that point lies inside every
other silhouette. So somewhere along the ray the smallest signed distance to the other silhouettes
must reach 0 (Hernandez, Schmitt and Cipolla, "Silhouette coherence for camera calibration under
circular motion", 2007).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.cameras.outlines import Outlines
from hairkit.parallel import compiled, parallel_for

REACH = 0.28
"""Rays are searched this far before and behind the turn's centre, metres: heads are smaller."""
STEPS = (0.012, 0.0015)
"""Steps of two searches along a ray, metres: the second passes over what cannot beat the first."""
FINE = 5
"""Halvings of the step after them."""
FASTEST = 3.0
"""A point on a ray moves at most this times (pixels per metre at the turn's centre) in a view."""
NEAREST = 1e-3
"""Points less far in front of a camera, metres, are not seen."""
CAP = 40.0
"""Signed distances are cut at this many pixels: so far inside a silhouette says nothing."""
BORDER = 1.001
"""Samples are taken at most this many pixels before the last, so that the next pixel exists."""
LEAST_SHARE = 1e-3
"""Silhouettes with less of the soft minimum are left out of its derivative."""
MIN_RAYS = 16
"""Least number of rays that are worth another thread."""
MOTIONS = 7
"""Small motions of a camera: turns about its axes, shifts along them, log of the focal length."""
ZOOM = 6
"""The motion that scales the focal length."""


def coherence(
    outlines: Outlines,
    rotation: Float64Array,
    translation: Float64Array,
    focal: Float64Array,
    centre: Float64Array,
    middle: Float64Array,
    softness: float = 1.0,
) -> tuple[Float64Array, Float64Array]:
    """Return how far each contour ray stays inside all other silhouettes, and its derivative.

    Parameters
    ----------
    rotation, translation, focal, centre
        Cameras (V, 3, 3), (V, 3), (V,), (V, 2).
    middle
        (V,) depth of the turn's centre in each view, metres.
    softness
        Of the minimum over silhouettes, pixels: less than the outlines' noise.

    Returns
    -------
    value
        (N,) pixels, below 0 where the ray misses some silhouette.
    slope
        (N, V, 7) derivative by each camera's small motion (see `Turn.tangents`).
    """
    value = np.empty(len(outlines.points))
    slope = np.zeros((len(outlines.points), len(rotation), MOTIONS))
    turns = np.ascontiguousarray(np.einsum("vij,okj->ovik", rotation, rotation))
    shifts = translation[None] - np.einsum("ovik,ok->ovi", turns, translation)
    views = _Views(
        outlines.fields, outlines.scale, turns, shifts, np.ascontiguousarray(focal, np.float64),
        np.ascontiguousarray(centre, np.float64), np.ascontiguousarray(middle, np.float64),
        float(softness),
    )  # fmt: skip
    parallel_for(
        _search_rays, len(value), views, outlines.points, outlines.views, value, slope,
        min_chunk=MIN_RAYS,
    )  # fmt: skip
    return value, slope


class _Views(NamedTuple):
    """Silhouettes and cameras of all views."""

    fields: Float32Array
    """(V, H, W) signed distance, see `Outlines`."""
    scale: float
    """Field pixels per picture pixel."""
    turns: Float64Array
    """(V, V, 3, 3) [own, view] rotation from camera axes of `own` to those of `view`."""
    shifts: Float64Array
    """(V, V, 3) the translation that follows it, metres."""
    focal: Float64Array
    """(V,) pixels."""
    centre: Float64Array
    """(V, 2) principal points, pixels."""
    middle: Float64Array
    """(V,) depth of the turn's centre in each view, metres."""
    softness: float
    """Of the minimum over silhouettes, pixels."""


class _Ray(NamedTuple):
    """A viewing ray in all views; a point on it at depth z is `z * relative + offset`."""

    own: int
    """The view whose outline it goes through."""
    direction: Float64Array
    """(3,) in camera axes of that view, depth 1."""
    relative: Float64Array
    """(V, 3) direction in camera axes of all views."""
    offset: Float64Array
    """(V, 3) camera coordinates of its start, metres."""


class _Slopes(NamedTuple):
    """Gradients of the other silhouettes' distances at a point on a ray."""

    distance: Float64Array
    """(V,) pixels."""
    gradient: Float64Array
    """(V, 3) by the point's camera coordinates, pixels per metre."""
    zoom: Float64Array
    """(V,) by the logarithm of the view's focal length, pixels."""


@compiled
def _search_rays(
    first: int,
    last: int,
    views: _Views,
    points: Float64Array,
    owners: Int64Array,
    value: Float64Array,
    slope: Float64Array,
) -> None:
    """Write value (N,) and slope (N, V, MOTIONS) of the contour points `first` to `last`."""
    for n in range(first, last):
        ray = _ray(views, owners[n], points[n])
        value[n], z = _best_on_ray(views, ray)
        _add_slopes(views, ray, z, slope[n])


@compiled
def _ray(views: _Views, own: int, point: Float64Array) -> _Ray:
    """Return the ray through a picture point (2,) of a view."""
    direction = np.empty(3)
    direction[0] = (point[0] - views.centre[own, 0]) / views.focal[own]
    direction[1] = (point[1] - views.centre[own, 1]) / views.focal[own]
    direction[2] = 1.0
    relative = np.empty((len(views.focal), 3))
    for view in range(len(relative)):
        _rotate(views.turns[own, view], direction, relative[view])
    return _Ray(own, direction, relative, views.shifts[own])


@compiled
def _rotate(turn: Float64Array, vector: Float64Array, result: Float64Array) -> None:
    """Write turn (3, 3) times vector (3,)."""
    for i in range(3):
        result[i] = turn[i, 0] * vector[0] + turn[i, 1] * vector[1] + turn[i, 2] * vector[2]


@compiled
def _best_on_ray(views: _Views, ray: _Ray) -> tuple[float, float]:
    """Return the largest of the rays' smallest distances, pixels, and its depth, metres.

    Coarse steps, finer ones where more may be found, then halvings about the best. Distances change
    along a ray by at most `fastest` pixels a metre, so that steps may be longer where a silhouette
    is far off.
    """
    middle = views.middle[ray.own]
    fastest = FASTEST * views.focal[ray.own] / middle
    z, best, step = middle, -np.inf, 0.0
    for step in STEPS:
        at = middle - REACH
        while at <= middle + REACH and best < CAP:
            here = _smallest_distance(views, ray, at, best)
            if here > best:
                best, z = here, at
            at += max(step, (best - here) / fastest)
    best = _soft_distance(views, ray, z)
    for _ in range(FINE):
        step *= 0.5
        for side in (-1.0, 1.0):
            at = z + side * step
            here = _soft_distance(views, ray, at)
            if here > best:
                best, z = here, at
    return best, z


@compiled
def _soft_distance(views: _Views, ray: _Ray, z: float) -> float:
    """Return the soft minimum of all other silhouettes' distances at depth z.

    It equals the minimum where two silhouettes bound the ray equally, so that the derivative does
    not jump when others come to bound it.
    """
    least = _smallest_distance(views, ray, z, -np.inf)
    total = 0.0
    for view in range(len(views.fields)):
        if view != ray.own:
            total += np.exp((least - _distance(views, ray, view, z)) / views.softness)
    result: float = least - views.softness * np.log(total / 2.0)
    return result


@compiled
def _smallest_distance(views: _Views, ray: _Ray, z: float, bar: float) -> float:
    """Return the smallest distance of all other silhouettes at depth z; below `bar`, any such."""
    best = CAP
    for view in range(len(views.fields)):
        if view == ray.own:
            continue
        best = min(best, _distance(views, ray, view, z))
        if best < bar:
            return best
    return best


@compiled
def _distance(views: _Views, ray: _Ray, view: int, z: float) -> float:
    """Return the signed distance of a point on a ray to a view's silhouette, pixels."""
    x = z * ray.relative[view, 0] + ray.offset[view, 0]
    y = z * ray.relative[view, 1] + ray.offset[view, 1]
    depth = z * ray.relative[view, 2] + ray.offset[view, 2]
    if depth < NEAREST:
        return CAP
    u = views.focal[view] * x / depth + views.centre[view, 0]
    v = views.focal[view] * y / depth + views.centre[view, 1]
    return _sample(views.fields[view], views.scale, u, v)[0]


@compiled
def _sample(field: Float32Array, scale: float, u: float, v: float) -> tuple[float, float, float]:
    """Return the signed distance at a picture pixel and its derivatives by u and v.

    Bilinear; CAP without slope where the distance is larger. Outside the picture, of which nothing
    is known, it grows from that at the edge by the distance from the edge.
    """
    height, width = field.shape
    x, y = u * scale - 0.5, v * scale - 0.5
    right, down = min(max(x, 0.0), width - BORDER), min(max(y, 0.0), height - BORDER)
    i, j = int(down), int(right)
    fy, fx = down - i, right - j
    a, b, c, d = field[i, j], field[i, j + 1], field[i + 1, j], field[i + 1, j + 1]
    beyond = abs(x - right) + abs(y - down)
    value = (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy + beyond / scale
    if value > CAP:
        return CAP, 0.0, 0.0
    return (
        value,
        ((b - a) * (1 - fy) + (d - c) * fy) * scale if x == right else np.sign(x - right),
        ((c - a) * (1 - fx) + (d - b) * fx) * scale if y == down else np.sign(y - down),
    )


@compiled
def _slopes_at(views: _Views, ray: _Ray, z: float) -> _Slopes:
    """Return how the distances of all other silhouettes change at depth z of a ray."""
    count = len(views.fields)
    distance = np.full(count, CAP)
    gradient, zoom = np.zeros((count, 3)), np.zeros(count)
    for view in range(count):
        local = z * ray.relative[view] + ray.offset[view]
        if view == ray.own or local[2] < NEAREST:
            continue
        focal = views.focal[view]
        x, y = focal * local[0] / local[2], focal * local[1] / local[2]
        distance[view], by_u, by_v = _sample(
            views.fields[view], views.scale, x + views.centre[view, 0], y + views.centre[view, 1]
        )
        gradient[view, 0] = by_u * focal / local[2]
        gradient[view, 1] = by_v * focal / local[2]
        gradient[view, 2] = -(by_u * x + by_v * y) / local[2]
        zoom[view] = by_u * x + by_v * y
    return _Slopes(distance, gradient, zoom)


@compiled
def _add_slopes(views: _Views, ray: _Ray, z: float, slope: Float64Array) -> None:
    """Add to slope (V, MOTIONS) the derivative of the best value, at depth z of a ray.

    Every silhouette has the share that the soft minimum gives it; at the best depth the derivative
    by depth is 0, so that depth may be held.
    """
    slopes = _slopes_at(views, ray, z)
    least = slopes.distance.min()
    if least >= CAP:
        return
    share = np.exp((least - slopes.distance) / views.softness)
    share /= share.sum()
    for view in range(len(share)):
        if share[view] > LEAST_SHARE:
            _add_slope(views, ray, z, slopes, view, share[view], slope)


@compiled
def _add_slope(
    views: _Views,
    ray: _Ray,
    z: float,
    slopes: _Slopes,
    view: int,
    weight: float,
    slope: Float64Array,
) -> None:
    """Add a silhouette's share: its own camera moves the point, the ray's camera the ray."""
    own, g, back = ray.own, slopes.gradient[view], np.empty(3)
    local, seen = z * ray.relative[view] + ray.offset[view], z * ray.direction
    _rotate(views.turns[view, own], g, back)
    _add_moment(local, g, weight, slope[view])
    _add_moment(seen, back, -weight, slope[own])
    slope[view, ZOOM] += weight * slopes.zoom[view]
    slope[own, ZOOM] -= weight * (seen[0] * back[0] + seen[1] * back[1])


@compiled
def _add_moment(
    place: Float64Array, force: Float64Array, weight: float, motion: Float64Array
) -> None:
    """Add weight times place x force to the turns of a motion (MOTIONS,), and force to shifts."""
    turn, shift = motion[:3], motion[3:ZOOM]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[i] += weight * (place[j] * force[k] - place[k] * force[j])
        shift[i] += weight * force[i]
