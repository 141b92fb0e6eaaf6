"""Kernels of contact: penetration, Coulomb friction, then the lengths of what has moved."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hairkit.simulation.lanes import LANES, put, stage, three
from hairkit.simulation.obstacle_kernels import Field, Fields, distance_at
from hairkit.simulation.vectors import (
    HALF,
    ONE,
    ZERO,
    Floats,
    Number,
    Rows,
    dot,
    inlined,
    minus,
    moved,
    plus,
    times,
)

from .block import Node, Settings, Step, Work

FAR = 1.0
"""Metres up to which distances are exact: bounds would be looked up again sooner."""
NEAR = np.float32(0.0003)
"""Metres that a node near an obstacle moves before the next lookup: so long the plane of the last
one stands for the obstacle, off by less than 0.01 mm on a head's curvature."""
FURTHER = np.float32(1.05)
"""Safety factor on the distance that a node has moved since its last lookup."""
SOFTEST = np.float32(1.001)
"""1 and the compliance added to the lengths of nodes in contact, as a share of a free one's."""
STILL = np.float32(1e-12)
HEAD = ((ONE, ZERO, ZERO, ZERO), (ZERO, ONE, ZERO, ZERO), (ZERO, ZERO, ONE, ZERO))


@stage
def resolve_contacts(
    s: Sequence[Node], x: Sequence[Work], step: Step, fields: Fields, settings: Settings
) -> None:
    """Push nodes out of the obstacles, then rub and restore the lengths by turns."""
    touching, h, with_torso = False, settings.seconds, fields.torso.distance.shape[0] > 0
    drift, pose, beside = step.drift, step.torso, step.torso_drift
    for j in range(1, len(s)):
        node, own, near = s[j], x[j], False
        for w in range(LANES):
            put(own.normal, w, (ZERO, ZERO, ZERO))
            own.depth[w] = own.grip[w] = ZERO
        if use_room(node, own, node.room, drift, h):
            near = meets(node, own, node.room, node.wall, fields.head, HEAD, drift)
        if with_torso and use_room(node, own, node.aside, beside, h):
            near |= meets(node, own, node.aside, node.beside, fields.torso, pose, beside)
        if near:
            push_out(node, own, settings)
            rub(node, own, h)
            touching = True
    restore_lengths(s, x, settings, False)
    # without contact, one more iteration is enough
    for _ in range(settings.rounds if touching else min(settings.rounds, 1)):
        restore_lengths(s, x, settings, touching)


@inlined
def use_room(s: Node, x: Work, room: Floats, drift: Rows, h: Number) -> bool:
    """Take from the room left to a body what a node may have moved; return whether one may meet it.

    `drift` is the body's motion.
    """
    for w in range(LANES):
        speed = minus(three(s.speed, w), times(HALF * h, three(s.gain, w)))
        by = minus(speed, moved(drift, three(s.place, w)))
        x.value[w] = FURTHER * h * math.sqrt(dot(by, by))
    near = 0
    for w in range(LANES):
        room[w] -= x.value[w]
        near |= room[w] <= NEAR
    return near > 0


@inlined
def meets(
    s: Node, x: Work, room: Floats, wall: Floats, field: Field, pose: Rows, drift: Rows
) -> bool:
    """Note depth, normal and velocity of a body where it is the deepest yet; return if it is.

    The body is the plane `wall` (normal and offset, its own axes), which is looked up again where
    the `room` is used up. `pose` brings head axes to the body's.
    """
    for w in range(LANES):
        if room[w] < ZERO:
            at = moved(pose, three(s.place, w))
            distance, a, b, c = distance_at(field, at[0], at[1], at[2], FAR)
            room[w] = max(np.float32(distance) - s.clear[w], NEAR)
            wall[0, w], wall[1, w], wall[2, w] = a, b, c
            wall[3, w] = distance - (a * at[0] + b * at[1] + c * at[2])
    deeper = 0
    for w in range(LANES):
        place, n = three(s.place, w), three(wall, w)
        depth, deepest = s.clear[w] - (dot(n, moved(pose, place)) + wall[3, w]), x.depth[w]
        deeper |= depth > deepest
        ride = moved(drift, place)
        for c in range(3):
            across = pose[0][c] * n[0] + pose[1][c] * n[1] + pose[2][c] * n[2]
            x.normal[c, w] = across if depth > deepest else x.normal[c, w]
            x.surface[c, w] = ride[c] if depth > deepest else x.surface[c, w]
        x.depth[w] = max(depth, deepest)
    return deeper > 0


@stage
def push_out(s: Node, x: Work, settings: Settings) -> None:
    """Push nodes out of the obstacles, which grip them; nothing happens where normals are 0."""
    h = settings.seconds
    for w in range(LANES):
        normal, speed = three(x.normal, w), three(s.speed, w)
        inward = max(-dot(minus(speed, three(x.surface, w)), normal), ZERO)
        x.grip[w] = settings.friction * inward
        put(s.speed, w, plus(speed, times(inward, normal)))
        # depth of this substep is removed at once, older depth at a limited speed
        depth = min(x.depth[w], h * (inward + settings.fastest))
        put(s.place, w, plus(three(s.place, w), times(depth, normal)))


@stage
def rub(s: Node, x: Work, h: Number) -> None:
    """Let friction take from the speed along the obstacle as much as the grip holds (Coulomb)."""
    for w in range(LANES):
        speed, normal = three(s.speed, w), three(x.normal, w)
        relative = minus(speed, three(x.surface, w))
        slide = minus(relative, times(dot(relative, normal), normal))
        size = math.sqrt(dot(slide, slide)) + STILL
        slowed = min(max(x.grip[w], ZERO), size)
        brake = times(slowed / size, slide)
        x.grip[w] -= slowed
        put(s.speed, w, minus(speed, brake))
        put(s.place, w, minus(three(s.place, w), times(HALF * h, brake)))


@stage
def restore_lengths(s: Sequence[Node], x: Sequence[Work], settings: Settings, rubs: bool) -> None:
    """Restore the lengths; a touching node moves only along the obstacle, and is pressed on it.

    One tridiagonal solve, eliminated on the way to the tip; the root, which does not move, takes no
    part. Nodes that touch rub before where `rubs`.
    """
    for j in range(1, len(s)):
        here, own, before, last = s[j], x[j], s[j - 1], x[j - 1]
        if rubs:
            rub(here, own, settings.seconds)
        for w in range(LANES):
            edge = minus(three(here.place, w), three(before.place, w))
            square = dot(edge, edge)
            size = ONE / math.sqrt(square)
            along, way = times(size, edge), three(last.way, w)
            normal, wall = three(last.normal, w), three(own.normal, w)
            start, end = dot(along, normal), dot(along, wall)
            beside = before.ease[w] * (dot(way, normal) * start - dot(way, along))
            factor = beside * last.pivot[w]
            firm = before.ease[w] * (SOFTEST - start * start)
            firm += here.ease[w] * (SOFTEST - end * end)
            put(own.way, w, along)
            own.beside[w] = beside
            own.pivot[w] = ONE / (firm - factor * beside)
            own.value[w] = square * size - here.length[w] - factor * last.value[w]
    for j in range(len(s) - 1, 0, -1):
        pull_node(s[j], x[j], x[j + 1], ONE / settings.seconds, settings.friction)


@inlined
def pull_node(s: Node, x: Work, after: Work, over: Number, friction: Number) -> None:
    """Move a node by the pulls of its segments, the one that ends there and the one after."""
    for w in range(LANES):
        value = (x.value[w] - after.beside[w] * after.value[w]) * x.pivot[w]
        x.value[w] = value
        pull = times(after.value[w], three(after.way, w))
        pull = minus(pull, times(value, three(x.way, w)))
        ease, normal = s.ease[w], three(x.normal, w)
        away = dot(pull, normal)
        change = times(ease, minus(pull, times(away, normal)))
        put(s.place, w, plus(three(s.place, w), change))
        put(s.speed, w, plus(three(s.speed, w), times(over, change)))
        x.grip[w] -= friction * over * ease * away
