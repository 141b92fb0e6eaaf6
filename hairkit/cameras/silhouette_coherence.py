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
from hairkit.parallel import compiled, compiled_with, parallel_for

REACH = 0.28
"""Rays are searched this far before and behind the head's origin, metres: heads are smaller."""
STEPS = (0.03, 0.0015)
"""Steps of two searches along a ray, metres: the second passes over what cannot beat the first."""
FINE = 3
"""Halvings of the step after them."""
STEEPEST = 1.5
"""Bound of the slope of signed distances: 1, but more between pixels and off the picture."""
FOREVER = 9.0
"""A step longer than any ray, metres."""
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
LINE = 7
RIGHT, RIGHT_START, DOWN, DOWN_START, DEPTH, DEPTH_START, FASTEST = range(LINE)
"""Numbers of a ray's line in a view: at depth z it is, in pixels of the field, at
`(z right + right_start, z down + down_start) / w` with `w = z depth + depth_start` (Hartley and
Zisserman, "Multiple view geometry", 2004, 9.1); the last, over w^2, bounds by how many pixels the
signed distance changes per metre of depth."""


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
        (V,) depth of the head's origin in each view, metres.
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
    """(V,) depth of the head's origin in each view, metres."""
    softness: float
    """Of the minimum over silhouettes, pixels."""


@compiled_with(allocates=True)
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
    count = len(views.focal)
    lines, distance = np.empty((count, LINE)), np.empty(count)
    work = np.empty((3, 3))
    for n in range(first, last):
        own = owners[n]
        right = (points[n, 0] - views.centre[own, 0]) / views.focal[own]
        down = (points[n, 1] - views.centre[own, 1]) / views.focal[own]
        _draw_ray(views, own, right, down, lines)
        value[n], z = _best_on_ray(views, own, lines, distance)
        work[0, 0], work[0, 1], work[0, 2] = right * z, down * z, z
        _add_slopes(views, own, lines, z, distance, work, slope[n])


@compiled_with(inside=True)
def _draw_ray(views: _Views, own: int, right: float, down: float, lines: Float64Array) -> None:
    """Write the lines (V, LINE) in all views of a ray that is at (right, down, 1) for `own`."""
    scale = views.scale
    for view in range(len(lines)):
        turn, focal = views.turns[own, view], views.focal[view] * scale
        depth = turn[2, 0] * right + turn[2, 1] * down + turn[2, 2]
        depth_start = views.shifts[own, view, 2]
        for axis in range(2):
            along = turn[axis, 0] * right + turn[axis, 1] * down + turn[axis, 2]
            middle = views.centre[view, axis] * scale - 0.5
            start = focal * views.shifts[own, view, axis] + middle * depth_start
            lines[view, 2 * axis] = focal * along + middle * depth
            lines[view, 2 * axis + 1] = start
        lines[view, DEPTH], lines[view, DEPTH_START] = depth, depth_start
        across = lines[view, RIGHT] * depth_start - lines[view, RIGHT_START] * depth
        below = lines[view, DOWN] * depth_start - lines[view, DOWN_START] * depth
        lines[view, FASTEST] = STEEPEST * np.hypot(across, below) / scale


@compiled_with(inside=True)
def _best_on_ray(
    views: _Views, own: int, lines: Float64Array, distance: Float64Array
) -> tuple[float, float]:
    """Return the largest of the rays' smallest distances, pixels, and its depth, metres.

    Coarse steps, finer ones where more may be found, then halvings about the best. `distance` (V,)
    is work space, and has the distances at that depth in the end.
    """
    middle = views.middle[own]
    z, best, step, nearest = middle, -np.inf, 0.0, own
    for step in STEPS:
        at = middle - REACH
        while at <= middle + REACH and best < CAP:
            here, nearest = _smallest_distance(views, own, lines, at, best, nearest)
            if here > best:
                best, z = here, at
                at += step
            else:
                at += max(step, _ruled_out(lines, nearest, at, best - here))
    best = _soft_distance(views, own, lines, z, distance)
    for _ in range(FINE):
        step *= 0.5
        for side in (-1.0, 1.0):
            at = z + side * step
            here = _soft_distance(views, own, lines, at, distance)
            if here > best:
                best, z = here, at
    return _soft_distance(views, own, lines, z, distance), z


@compiled_with(inside=True)
def _ruled_out(lines: Float64Array, view: int, z: float, short: float) -> float:
    """Return how far behind depth z a view's distance stays too small by `short` pixels, metres."""
    depth = z * lines[view, DEPTH] + lines[view, DEPTH_START]
    if depth < NEAREST:
        return 0.0
    rest = lines[view, FASTEST] - short * depth * lines[view, DEPTH]
    if rest <= 0:
        return FOREVER
    return float(short * depth * depth / rest)


@compiled_with(inside=True)
def _soft_distance(
    views: _Views, own: int, lines: Float64Array, z: float, distance: Float64Array
) -> float:
    """Return the soft minimum of all other silhouettes' distances (V,) at depth z, and write them.

    It equals the minimum where two silhouettes bound the ray equally, so that the derivative does
    not jump when others come to bound it.
    """
    least = CAP
    for view in range(len(lines)):
        distance[view] = CAP if view == own else _sample(views, lines, view, z)[0]
        least = min(least, distance[view])
    total = 0.0
    for view in range(len(lines)):
        if view != own:
            total += np.exp((least - distance[view]) / views.softness)
    return float(least - views.softness * np.log(total / 2.0))


@compiled_with(inside=True)
def _smallest_distance(
    views: _Views, own: int, lines: Float64Array, z: float, bar: float, likely: int
) -> tuple[float, int]:
    """Return the smallest distance of all other silhouettes at depth z, and whose it is.

    Below `bar`, any such; the view that is `likely` to have it is tried before the others.
    """
    best, nearest = CAP, likely
    if likely != own:
        best = _sample(views, lines, likely, z)[0]
    for view in range(len(lines)):
        if best < bar:
            break
        if view != own and view != likely:
            here = _sample(views, lines, view, z)[0]
            if here < best:
                best, nearest = here, view
    return best, nearest


@compiled
def _sample(views: _Views, lines: Float64Array, view: int, z: float) -> tuple[float, float, float]:
    """Return a view's signed distance at depth z of a ray and its derivatives by the pixel.

    Bilinear; CAP without slope where the distance is larger. Outside the picture, of which nothing
    is known, it grows from that at the edge by the distance from the edge.
    """
    depth = z * lines[view, DEPTH] + lines[view, DEPTH_START]
    if depth < NEAREST:
        return CAP, 0.0, 0.0
    x = (z * lines[view, RIGHT] + lines[view, RIGHT_START]) / depth
    y = (z * lines[view, DOWN] + lines[view, DOWN_START]) / depth
    field, scale = views.fields, views.scale
    right = min(max(x, 0.0), field.shape[2] - BORDER)
    down = min(max(y, 0.0), field.shape[1] - BORDER)
    i, j = int(down), int(right)
    fy, fx = down - i, right - j
    a, b = field[view, i, j], field[view, i, j + 1]
    c, d = field[view, i + 1, j], field[view, i + 1, j + 1]
    beyond = abs(x - right) + abs(y - down)
    value = (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy + beyond / scale
    if value > CAP:
        return CAP, 0.0, 0.0
    return (
        value,
        ((b - a) * (1 - fy) + (d - c) * fy) * scale if x == right else np.sign(x - right),
        ((c - a) * (1 - fx) + (d - b) * fx) * scale if y == down else np.sign(y - down),
    )


@compiled_with(inside=True)
def _add_slopes(
    views: _Views,
    own: int,
    lines: Float64Array,
    z: float,
    distance: Float64Array,
    work: Float64Array,
    slope: Float64Array,
) -> None:
    """Add to slope (V, MOTIONS) the derivative of the best value, at depth z of a ray.

    Every silhouette has the share that the soft minimum gives its distance (V,); at the best depth
    the derivative by depth is 0, so that depth may be held. `work` (3, 3) begins with the point.
    """
    least, total = CAP, 0.0
    for view in range(len(distance)):
        least = min(least, distance[view])
    if least >= CAP:
        return
    for view in range(len(distance)):
        share = 0.0 if view == own else np.exp((least - distance[view]) / views.softness)
        distance[view] = share
        total += share
    for view in range(len(distance)):
        if distance[view] > LEAST_SHARE * total:
            _add_slope(views, own, lines, z, view, distance[view] / total, work, slope)


@compiled_with(inside=True)
def _add_slope(
    views: _Views,
    own: int,
    lines: Float64Array,
    z: float,
    view: int,
    weight: float,
    work: Float64Array,
    slope: Float64Array,
) -> None:
    """Add a silhouette's share: its own camera moves the point, the ray's camera the ray."""
    _, by_u, by_v = _sample(views, lines, view, z)
    turn, shift, focal = views.turns[own, view], views.shifts[own, view], views.focal[view]
    x, y, depth = work[0]
    for i in range(3):
        work[1, i] = turn[i, 0] * x + turn[i, 1] * y + turn[i, 2] * depth + shift[i]
    there = work[1, 2]
    zoom = focal * (by_u * work[1, 0] + by_v * work[1, 1]) / there
    work[2, 0], work[2, 1], work[2, 2] = by_u * focal / there, by_v * focal / there, -zoom / there
    _add_moment(work[1], work[2], weight, slope[view])
    right, down, behind = work[2]
    for i in range(3):
        work[2, i] = turn[0, i] * right + turn[1, i] * down + turn[2, i] * behind
    _add_moment(work[0], work[2], -weight, slope[own])
    slope[view, ZOOM] += weight * zoom
    slope[own, ZOOM] -= weight * (x * work[2, 0] + y * work[2, 1])


@compiled_with(inside=True)
def _add_moment(
    place: Float64Array, force: Float64Array, weight: float, motion: Float64Array
) -> None:
    """Add weight times place x force to the turns of a motion (MOTIONS,), and force to shifts."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        motion[i] += weight * (place[j] * force[k] - place[k] * force[j])
        motion[i + 3] += weight * force[i]
