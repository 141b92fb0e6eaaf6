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
COARSE = 48
"""Steps of the first search along a ray."""
FINE = 8
"""Halvings of the step after it."""
FASTEST = 1.6
"""A point on a ray moves at most this times (pixels per metre at the turn's centre) in a view."""
NEAREST = 1e-3
"""Points less far in front of a camera, metres, are not seen."""
TOUCHING = 1.0
"""Silhouettes whose distances differ by less than this, pixels, bound a ray together."""
CAP = 40.0
"""Signed distances are cut at this many pixels; outside its picture a silhouette says nothing."""
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
    middle: float,
) -> tuple[Float64Array, Float64Array]:
    """Return how far each contour ray stays inside all other silhouettes, and its derivative.

    Parameters
    ----------
    rotation, translation, focal, centre
        Cameras (V, 3, 3), (V, 3), (V,), (V, 2).
    middle
        Depth of the turn's centre in all views, metres.

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
        np.ascontiguousarray(centre, np.float64), float(middle),
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
    middle: float
    """Depth of the turn's centre in all views, metres."""


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
    along: Float64Array
    """(V,) by the point's depth on the ray, pixels per metre."""
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

    Coarse steps, then halvings about the best. Distances change along a ray by at most `fastest`
    pixels a metre, so that steps may be longer where a silhouette is far off.
    """
    step = 2 * REACH / (COARSE - 1)
    fastest = FASTEST * views.focal[ray.own] / views.middle
    z, best = views.middle, -np.inf
    at = views.middle - REACH
    while at <= views.middle + REACH:
        here = _smallest_distance(views, ray, at, best)
        if here > best:
            best, z = here, at
        at += max(step, (best - here) / fastest)
    for _ in range(FINE):
        step *= 0.5
        for side in (-1.0, 1.0):
            at = z + side * step
            here = _smallest_distance(views, ray, at, best)
            if here > best:
                best, z = here, at
    return best, z


@compiled
def _smallest_distance(views: _Views, ray: _Ray, z: float, bar: float) -> float:
    """Return the smallest distance of all other silhouettes at depth z; below `bar`, any such."""
    best = CAP
    for view in range(len(views.fields)):
        if view == ray.own:
            continue
        x = z * ray.relative[view, 0] + ray.offset[view, 0]
        y = z * ray.relative[view, 1] + ray.offset[view, 1]
        depth = z * ray.relative[view, 2] + ray.offset[view, 2]
        if depth < NEAREST:
            continue
        u = views.focal[view] * x / depth + views.centre[view, 0]
        v = views.focal[view] * y / depth + views.centre[view, 1]
        best = min(best, _sample(views.fields[view], views.scale, u, v)[0])
        if best < bar:
            return best
    return best


@compiled
def _sample(field: Float32Array, scale: float, u: float, v: float) -> tuple[float, float, float]:
    """Return the signed distance at a picture pixel and its derivatives by u and v.

    Bilinear; CAP without slope outside the picture and where the distance is larger.
    """
    x, y = u * scale - 0.5, v * scale - 0.5
    height, width = field.shape
    if not (x >= 0.0 and y >= 0.0 and x < width - 1 and y < height - 1):
        return CAP, 0.0, 0.0
    i, j = int(y), int(x)
    fy, fx = y - i, x - j
    a, b, c, d = field[i, j], field[i, j + 1], field[i + 1, j], field[i + 1, j + 1]
    value = (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy
    if value > CAP:
        return CAP, 0.0, 0.0
    return (
        value,
        ((b - a) * (1 - fy) + (d - c) * fy) * scale,
        ((c - a) * (1 - fx) + (d - b) * fx) * scale,
    )


@compiled
def _slopes_at(views: _Views, ray: _Ray, z: float) -> _Slopes:
    """Return how the distances of all other silhouettes change at depth z of a ray."""
    count = len(views.fields)
    distance, along = np.full(count, CAP), np.zeros(count)
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
        for axis in range(3):
            along[view] += gradient[view, axis] * ray.relative[view, axis]
    return _Slopes(distance, along, gradient, zoom)


@compiled
def _opposite(slopes: _Slopes, first: int) -> int:
    """Return the nearest silhouette that bounds the ray on the other side than `first`, or -1."""
    second = -1
    for view in range(len(slopes.distance)):
        if view == first or slopes.along[view] * slopes.along[first] >= 0.0:
            continue
        if slopes.distance[view] - slopes.distance[first] < TOUCHING and (
            second < 0 or slopes.distance[view] < slopes.distance[second]
        ):
            second = view
    return second


@compiled
def _add_slopes(views: _Views, ray: _Ray, z: float, slope: Float64Array) -> None:
    """Add to slope (V, MOTIONS) the derivative of the best value, at depth z of a ray.

    One silhouette bounds it, or two on opposite sides: then the best depth moves so that both
    distances stay equal, and the derivative is the mean by which the depth drops out.
    """
    slopes = _slopes_at(views, ray, z)
    first = int(np.argmin(slopes.distance))
    if slopes.distance[first] >= CAP:
        return
    second = _opposite(slopes, first)
    share = 1.0
    if second >= 0:
        share = slopes.along[second] / (slopes.along[second] - slopes.along[first])
    for view, weight in ((first, share), (second, 1.0 - share)):
        if view >= 0 and weight != 0.0:
            _add_slope(views, ray, z, slopes, view, weight, slope)


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
