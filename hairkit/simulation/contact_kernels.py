"""Contact of nodes with head and torso, compiled, strands side by side: push-out and friction."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from hairkit.simulation import vectors as v
from hairkit.simulation.lanes import LANES, Four, One, Three, put, stage, three
from hairkit.simulation.obstacle_kernels import Field, Fields, distance_at
from hairkit.simulation.substeps import Settings, Step
from hairkit.simulation.vectors import HALF, ONE, ZERO, Floats, Number, Rows, inlined

FAR = 1.0
"""Metres up to which distances are exact: bounds would be looked up again sooner."""
NEAR = np.float32(0.0003)
"""Metres that a node near an obstacle moves before the next lookup: so long the plane of the last
one stands for the obstacle, off by less than 0.01 mm on a head's curvature."""
FURTHER = np.float32(1.05)
"""Safety factor on the distance that a node has moved since its last lookup."""
STILL = np.float32(1e-12)
HEAD = ((ONE, ZERO, ZERO, ZERO), (ZERO, ONE, ZERO, ZERO), (ZERO, ZERO, ONE, ZERO))


class Moving(Protocol):
    """Where a node is and how it moves, head axes."""

    place: Three
    """Metres."""
    room: One
    """How far the node may move before the next lookup of the head, metres."""
    speed: Three
    """m/s, in the world."""
    aside: One
    """As `room`, of the torso."""


class Touching(Moving, Protocol):
    """What contact reads and changes of a node."""

    wall: Four
    """Plane (unit normal and offset, metres) that stands for the head, its axes."""
    beside: Four
    """As `wall`, of the torso."""
    clear: One
    """Least distance from obstacles, metres."""


class Touch(Protocol):
    """What contact works out for a node in a substep."""

    pace: Three
    """Given: mean velocity in the substep, m/s."""
    value: One
    """Right-hand side, then solution, of what is solved within a step."""
    normal: Three
    """Of the obstacle that is met; 0 without one."""
    surface: Three
    """Velocity of that obstacle, m/s."""
    depth: One
    """In that obstacle, metres."""
    grip: One
    """Change of velocity that friction may bring, m/s."""


@stage
def touch(s: Touching, x: Touch, step: Step, fields: Fields, settings: Settings) -> bool:
    """Push nodes out of head and torso, which rub them; return whether one met any."""
    near, h = False, settings.seconds
    for w in range(LANES):
        put(x.normal, w, (ZERO, ZERO, ZERO))
        x.depth[w] = x.grip[w] = ZERO
    if use_room(s, x, s.room, step.drift, h):
        near = meets(s, x, s.room, s.wall, fields.head, HEAD, step.drift)
    if fields.torso.distance.shape[0] > 0 and use_room(s, x, s.aside, step.torso_drift, h):
        near |= meets(s, x, s.aside, s.beside, fields.torso, step.torso, step.torso_drift)
    if near:
        push_out(s, x, settings)
        rub(s, x, h)
    return near


@inlined
def use_room(s: Touching, x: Touch, room: Floats, drift: Rows, h: Number) -> bool:
    """Take from the room left to a body what a node may have moved; return whether one may meet it.

    `drift` is the body's motion.
    """
    for w in range(LANES):
        by = v.minus(three(x.pace, w), v.moved(drift, three(s.place, w)))
        x.value[w] = FURTHER * h * math.sqrt(v.dot(by, by))
    near = 0
    for w in range(LANES):
        room[w] -= x.value[w]
        near |= room[w] <= NEAR
    return near > 0


@inlined
def meets(
    s: Touching, x: Touch, room: Floats, wall: Floats, field: Field, pose: Rows, drift: Rows
) -> bool:
    """Note depth, normal and velocity of a body where it is the deepest yet; return if it is.

    The body is the plane `wall` (normal and offset, its own axes), which is looked up again where
    the `room` is used up. `pose` brings head axes to the body's.
    """
    for w in range(LANES):
        if room[w] < ZERO:
            at = v.moved(pose, three(s.place, w))
            distance, a, b, c = distance_at(field, at[0], at[1], at[2], FAR)
            room[w] = max(np.float32(distance) - s.clear[w], NEAR)
            wall[0, w], wall[1, w], wall[2, w] = a, b, c
            wall[3, w] = distance - (a * at[0] + b * at[1] + c * at[2])
    deeper = 0
    for w in range(LANES):
        place, n = three(s.place, w), three(wall, w)
        depth, deepest = s.clear[w] - (v.dot(n, v.moved(pose, place)) + wall[3, w]), x.depth[w]
        deeper |= depth > deepest
        ride = v.moved(drift, place)
        for c in range(3):
            across = pose[0][c] * n[0] + pose[1][c] * n[1] + pose[2][c] * n[2]
            x.normal[c, w] = across if depth > deepest else x.normal[c, w]
            x.surface[c, w] = ride[c] if depth > deepest else x.surface[c, w]
        x.depth[w] = max(depth, deepest)
    return deeper > 0


@stage
def push_out(s: Touching, x: Touch, settings: Settings) -> None:
    """Push nodes out of the obstacles, which grip them; nothing happens where normals are 0."""
    h = settings.seconds
    for w in range(LANES):
        normal, speed = three(x.normal, w), three(s.speed, w)
        inward = max(-v.dot(v.minus(speed, three(x.surface, w)), normal), ZERO)
        x.grip[w] = settings.friction * inward
        put(s.speed, w, v.plus(speed, v.times(inward, normal)))
        # depth of this substep is removed at once, older depth at a limited speed
        depth = min(x.depth[w], h * (inward + settings.fastest))
        put(s.place, w, v.plus(three(s.place, w), v.times(depth, normal)))


@stage
def rub(s: Touching, x: Touch, h: Number) -> None:
    """Let friction take from the speed along the obstacle as much as the grip holds (Coulomb)."""
    for w in range(LANES):
        speed, normal = three(s.speed, w), three(x.normal, w)
        relative = v.minus(speed, three(x.surface, w))
        slide = v.minus(relative, v.times(v.dot(relative, normal), normal))
        size = math.sqrt(v.dot(slide, slide)) + STILL
        slowed = min(max(x.grip[w], ZERO), size)
        brake = v.times(slowed / size, slide)
        x.grip[w] -= slowed
        put(s.speed, w, v.minus(speed, brake))
        put(s.place, w, v.minus(three(s.place, w), v.times(HALF * h, brake)))
