"""Kernels of contact: penetration, Coulomb friction, then the lengths of what has moved."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.simulation.obstacle_kernels import distance_at

from .reference import SOFTEST as SOFTEST64
from .simd import (
    HALF,
    LANES,
    ONE,
    ZERO,
    Vector,
    dot,
    inlined,
    larger,
    least,
    load,
    minus,
    moved,
    one,
    pick,
    plus,
    put,
    put_one,
    root,
    rows_of,
    smaller,
    stage,
    store,
    three,
    times,
)

FAR = 1.0
"""Metres up to which distances are exact: bounds would be looked up again sooner."""
NEAR = np.float32(0.0003)
"""Metres that a node near an obstacle moves before the next lookup: so long the plane of the last
one stands for the obstacle, off by less than 0.01 mm on a head's curvature."""
FURTHER = np.float32(1.05)
"""Safety factor on the distance that a node has moved since its last lookup."""
SOFTEST, STILL = np.float32(1 + SOFTEST64), np.float32(1e-12)
HEAD = ((ONE, ZERO, ZERO, ZERO), (ZERO, ONE, ZERO, ZERO), (ZERO, ZERO, ONE, ZERO))


@stage
def resolve_contacts(s: Any, x: Any, rod: Any, step: Any, fields: Any, settings: Any) -> None:
    """Push nodes out of the obstacles, with friction, and restore the lengths."""
    touching, h, with_torso = False, settings.seconds, fields.torso.distance.shape[0] > 0
    drift, pose, beside = rows_of(step.drift), rows_of(step.torso), rows_of(step.torso_drift)
    for j in range(1, len(x)):
        put(x[j].normal, (ZERO, ZERO, ZERO))
        put(x[j].surface, (ZERO, ZERO, ZERO))
        put_one(x[j].depth, ZERO)
        put_one(x[j].grip, ZERO)
        place = three(s[j].place)
        way = times(h, minus(three(s[j].speed), times(HALF * h, three(s[j].gain))))
        ride, clear = moved(drift, place), rod[j].clear
        by = minus(way, times(h, ride))
        near = meets(x[j], s[j].room, s[j].wall, place, by, fields.head, HEAD, ride, clear)
        if with_torso:
            ride = moved(beside, place)
            by = minus(way, times(h, ride))
            near |= meets(x[j], s[j].aside, s[j].beside, place, by, fields.torso, pose, ride, clear)
        if near:
            push_out(s[j], x[j], settings)
            touching = True
    restore_lengths(s, x, rod, settings, False)
    # without contact, one more iteration is enough
    for _ in range(settings.rounds if touching else min(settings.rounds, 1)):
        restore_lengths(s, x, rod, settings, touching)


@inlined
def meets(
    node: Any,
    room: Any,
    wall: Any,
    place: Vector,
    by: Vector,
    field: Any,
    pose: Any,
    ride: Vector,
    clear: Any,
) -> bool:
    """Note depth, normal and velocity of a body where it is the deepest yet; return if it is.

    The body is the plane `wall` (normal and offset, its own axes), which is looked up again where
    the way `by` against it has used up the `room`. `pose` brings head axes to the body's, `ride` is
    the velocity of a point that rides on it.
    """
    left = one(room) - FURTHER * root(dot(by, by))
    put_one(room, left)
    closest = least(left)
    if closest > NEAR:
        return False
    at = moved(pose, place)
    if closest < ZERO:
        put(node.way, at)
        for w in range(LANES):
            if room[w] < ZERO:
                x, y, z = node.way[0, w], node.way[1, w], node.way[2, w]
                distance, a, b, c = distance_at(field, x, y, z, FAR)
                room[w] = max(np.float32(distance) - clear[w], NEAR)
                wall[0, w], wall[1, w], wall[2, w] = a, b, c
                wall[-1, w] = distance - (a * x + b * y + c * z)
    n = three(wall)
    depth, deepest = one(clear) - (dot(n, at) + load(wall, len(wall) - 1)), one(node.depth)
    if least(deepest - depth) >= ZERO:
        return False
    put_one(node.depth, larger(depth, deepest))
    for c in range(3):
        across = pose[0][c] * n[0] + pose[1][c] * n[1] + pose[2][c] * n[2]
        store(node.normal, c, pick(deepest, depth, across, load(node.normal, c)))
        store(node.surface, c, pick(deepest, depth, ride[c], load(node.surface, c)))
    return True


@inlined
def push_out(s: Any, x: Any, settings: Any) -> None:
    """Push nodes out of the obstacles, with friction; nothing happens where normals are 0."""
    h, normal = settings.seconds, three(x.normal)
    relative = minus(three(s.speed), three(x.surface))
    across = dot(relative, normal)
    inward = larger(ZERO - across, ZERO)
    # depth of this substep is removed at once, older depth at a limited speed
    depth = smaller(one(x.depth), h * (inward + settings.fastest))
    slide = minus(relative, times(across, normal))
    brake, grip = braked(slide, settings.friction * inward)
    put_one(x.grip, grip)
    put(s.speed, plus(three(s.speed), minus(times(inward, normal), brake)))
    put(s.place, plus(three(s.place), minus(times(depth, normal), times(HALF * h, brake))))


@inlined
def braked(slide: Vector, grip: Any) -> tuple[Vector, Any]:
    """Return what friction takes of a speed along the obstacle, and what is left of the grip."""
    size = root(dot(slide, slide)) + STILL
    slowed = smaller(larger(grip, ZERO), size)
    return times(slowed / size, slide), grip - slowed


@inlined
def rub(s: Any, x: Any, h: Any) -> None:
    """Let a node that touches rub once more, by what the strand's own tension adds to its grip."""
    speed, normal = three(s.speed), three(x.normal)
    relative = minus(speed, three(x.surface))
    brake, grip = braked(minus(relative, times(dot(relative, normal), normal)), one(x.grip))
    put_one(x.grip, grip)
    put(s.speed, minus(speed, brake))
    put(s.place, minus(three(s.place), times(HALF * h, brake)))


@stage
def restore_lengths(s: Any, x: Any, rod: Any, settings: Any, rubs: bool) -> None:
    """Restore the lengths; a touching node moves only along the obstacle, and is pressed on it.

    One tridiagonal solve, eliminated on the way to the tip; nodes that touch rub before where
    `rubs`.
    """
    last, zero = len(x) - 1, ZERO * one(rod[1].ease)
    place, ease, normal = three(s[0].place), one(rod[0].ease), (zero, zero, zero)
    way, across, pivot, value = normal, zero, zero, zero
    for j in range(1, last + 1):
        if rubs:
            rub(s[j], x[j], settings.seconds)
        here, wall, own = three(s[j].place), three(x[j].normal), one(rod[j].ease)
        edge = minus(here, place)
        square = dot(edge, edge)
        size = ONE / root(square)
        along = times(size, edge)
        start, end = dot(along, normal), dot(along, wall)
        beside = ease * (across * start - dot(way, along))
        factor = beside * pivot
        firm = ease * (SOFTEST - start * start) + own * (SOFTEST - end * end)
        pivot = ONE / (firm - factor * beside)
        value = square * size - one(rod[j].length) - factor * value
        put(x[j].way, along)
        put_one(x[j].beside, beside)
        put_one(x[j].pivot, pivot)
        put_one(x[j].value, value)
        place, ease, normal, way, across = here, own, wall, along, end
    over = ONE / settings.seconds
    value, beside, after = zero, zero, (zero, zero, zero)
    for j in range(last, 0, -1):
        value, beside = (one(x[j].value) - beside * value) * one(x[j].pivot), one(x[j].beside)
        own = times(value, three(x[j].way))
        pull, normal, ease = minus(after, own), three(x[j].normal), one(rod[j].ease)
        away, after = dot(pull, normal), own
        change = times(ease, minus(pull, times(away, normal)))
        put(s[j].place, plus(three(s[j].place), change))
        put(s[j].speed, plus(three(s[j].speed), times(over, change)))
        put_one(x[j].grip, one(x[j].grip) - settings.friction * over * ease * away)
