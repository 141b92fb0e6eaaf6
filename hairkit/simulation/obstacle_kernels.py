"""Compiled distances to obstacles, and drawn points that stay out of them, for all simulators."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.parallel import compiled, compiled_with

Points = Float64Array | Float32Array
"""(P, 3) metres."""
CHASE = 0.3
"""Share of the way back to its curve that a drawn point takes."""
TINY = 1e-20
"""Square metres added to squares before a division."""
OUTSIDE = 1.0
"""Distance off the grid, metres."""
DIAGONAL = 1.8
"""Cells; bound of the change of distance within a cell."""
PUSHES = 3
"""Times that a drawn point is pushed out: keeping its length moves it again."""
WORTH = 4096
"""Points that are worth another thread's while."""


class Field(NamedTuple):
    """Signed distances to a body on a grid."""

    first: Float64Array
    """(3,) place of the first value, metres, the body's axes."""
    spacing: float
    """Metres between values."""
    distance: Float32Array
    """(X, Y, Z) metres, negative inside; empty where there is no body."""


class Fields(NamedTuple):
    """The bodies that hair touches."""

    head: Field
    """In head axes."""
    torso: Field
    """In the torso's axes, which are the head's at rest."""


_NOTHING = Field(np.zeros(3), 1.0, np.zeros((0, 0, 0), np.float32))
NO_FIELDS = Fields(_NOTHING, _NOTHING)
"""Where there is nothing to touch."""


class Drawn(NamedTuple):
    """The guides' own points."""

    starts: Int64Array
    """(S + 1,) bounds of the strands."""
    length: Float64Array
    """(P,) metres to the point before."""
    deepest: Float64Array
    """(P,) least distance to the bodies, metres; (0,) without bodies."""


@compiled
def distance_at(
    field: Field, x: float, y: float, z: float, far: float
) -> tuple[float, float, float, float]:
    """Return the trilinear distance at a place in the body's axes, and its unit gradient.

    Where one value says that the distance is above `far`, that bound and no direction.
    """
    value = field.distance
    u = (x - field.first[0]) / field.spacing
    v = (y - field.first[1]) / field.spacing
    w = (z - field.first[2]) / field.spacing
    s0, s1, s2 = value.shape
    if not (0 <= u <= s0 - 1 and 0 <= v <= s1 - 1 and 0 <= w <= s2 - 1):
        return OUTSIDE, 0.0, 0.0, 0.0
    i, j, k = min(int(u), s0 - 2), min(int(v), s1 - 2), min(int(w), s2 - 2)
    least = value[i, j, k] - DIAGONAL * field.spacing
    if least > far:
        return least, 0.0, 0.0, 0.0
    u, v, w = u - i, v - j, w - k
    # along z, then y, then x
    near, far_edge = value[i, j, k], value[i, j, k + 1]
    d0, p0 = far_edge - near, near + w * (far_edge - near)
    near, far_edge = value[i, j + 1, k], value[i, j + 1, k + 1]
    d1, p1 = far_edge - near, near + w * (far_edge - near)
    near, far_edge = value[i + 1, j, k], value[i + 1, j, k + 1]
    d2, p2 = far_edge - near, near + w * (far_edge - near)
    near, far_edge = value[i + 1, j + 1, k], value[i + 1, j + 1, k + 1]
    d3, p3 = far_edge - near, near + w * (far_edge - near)
    low, high = p0 + v * (p1 - p0), p2 + v * (p3 - p2)
    a, b = high - low, (1 - u) * (p1 - p0) + u * (p3 - p2)
    c = (1 - u) * (d0 + v * (d1 - d0)) + u * (d2 + v * (d3 - d2))
    size = 1.0 / max(math.sqrt(a * a + b * b + c * c), 1e-12)
    return low + u * a, size * a, size * b, size * c


@compiled
def nearest_body(
    fields: Fields, pose: Float64Array, x: float, y: float, z: float, far: float
) -> tuple[float, float, float, float]:
    """Return distance and direction of the nearer body at a place, as `distance_at`; head axes.

    `pose` (3 or 4, 4) brings head axes to the torso's.
    """
    found = distance_at(fields.head, x, y, z, far)
    if fields.torso.distance.shape[0] == 0:
        return found
    distance, a, b, c = distance_at(
        fields.torso,
        pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z + pose[0, 3],
        pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z + pose[1, 3],
        pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3],
        far,
    )
    if distance >= found[0]:
        return found
    return (
        distance,
        pose[0, 0] * a + pose[1, 0] * b + pose[2, 0] * c,
        pose[0, 1] * a + pose[1, 1] * b + pose[2, 1] * c,
        pose[0, 2] * a + pose[1, 2] * b + pose[2, 2] * c,
    )


@compiled
def draw_points(
    begin: int, stop: int, drawn: Drawn, fields: Fields, pose: Float64Array, points: Points
) -> None:
    """Move the points (P, 3) of strands `begin` to `stop` from their curves to where they are seen.

    `points` are in head axes, where the rods carry them. Each follows that curve at its own
    distance from the point before: it goes along the curve and a share `CHASE` of the way back to
    it. One that lies deeper in a body than it may is pushed out; `pose` is that of `nearest_body`.
    """
    for strand in range(begin, stop):
        first = drawn.starts[strand]
        x, y, z = points[first, 0], points[first, 1], points[first, 2]
        x0, y0, z0 = x, y, z
        for i in range(first + 1, drawn.starts[strand + 1]):
            x1, y1, z1 = points[i, 0], points[i, 1], points[i, 2]
            a = x1 - x0 + CHASE * (x0 - x)
            b = y1 - y0 + CHASE * (y0 - y)
            c = z1 - z0 + CHASE * (z0 - z)
            x0, y0, z0 = x1, y1, z1
            a, b, c = _step_of(drawn.length[i], a, b, c)
            for _ in range(PUSHES if drawn.deepest.shape[0] and drawn.length[i] > 0 else 0):
                least = drawn.deepest[i]
                distance, p, q, r = nearest_body(fields, pose, x + a, y + b, z + c, least)
                out = least - distance
                if out <= 0:
                    break
                a, b, c = _step_of(drawn.length[i], a + out * p, b + out * q, c + out * r)
            x, y, z = x + a, y + b, z + c
            points[i, 0], points[i, 1], points[i, 2] = x, y, z


@compiled_with(inside=True)
def _step_of(length: float, a: float, b: float, c: float) -> tuple[float, float, float]:
    """Return a vector's direction times a length."""
    size = length / math.sqrt(a * a + b * b + c * c + TINY)
    return size * a, size * b, size * c


@compiled
def depths(
    begin: int,
    stop: int,
    fields: Fields,
    pose: Float64Array,
    points: Float64Array,
    least: Float64Array,
    depth: Float64Array,
) -> None:
    """Write by how much points `begin` to `stop` are nearer to a body than `least`, metres, or 0.

    `points` (P, 3) are in head axes, `pose` is that of `nearest_body`.
    """
    for i in range(begin, stop):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        depth[i] = max(least[i] - nearest_body(fields, pose, x, y, z, least[i])[0], 0.0)
