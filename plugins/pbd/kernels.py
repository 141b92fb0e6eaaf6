"""Substeps in head axes, compiled; strands lie side by side (see `hairkit.simulation.lanes`)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled_with
from hairkit.simulation import vectors as v
from hairkit.simulation.lanes import LANES, put, stage, three
from hairkit.simulation.obstacle_kernels import Fields, nearest_body
from hairkit.simulation.vectors import ONE, ZERO, Floats, Number

TINY = np.float32(1e-12)
"""Metres, and square metres: keeps coincident nodes from a division by zero."""
OUTSIDE = 0.02
"""Metres to a body from outside its grid, at least."""


class Hair(NamedTuple):
    """Blocks of strands of n nodes, (B, n, parts, LANES), head axes, metres and seconds."""

    near: Floats  # 2: rest lengths to the next node and to the next but one
    clear: Floats  # least distance to the bodies
    place: Floats  # 3: position
    velocity: Floats  # 3
    slack: Floats  # way that a node may go before it can touch a body
    steady: Floats  # 3: acceleration by the air, and by what bears the hair at rest
    goal: Floats  # 3: where a node is pulled to
    pull: Floats  # squared frequency of that pull


class Steps(NamedTuple):
    """K substeps, and their numbers."""

    change: Floats  # (K, 3, 4) from the head axes before each to those after it, less the identity
    gravity: Floats  # (K, 3) head axes
    torso: Float64Array  # (K, 4, 4) from head axes to the torso's
    ways: Floats  # (K,) metres by which the torso may come nearer
    seconds: Number
    soft: Number  # compliance of bending over seconds^2, times a node's mass (XPBD, equation 4)
    drag: Number  # 1/s
    lost: Number  # share of the velocity relative to the head
    friction: Number
    iterations: int


@compiled_with(allocates=True, fastmath=True)
def move(first: int, last: int, hair: Hair, steps: Steps, head: Fields, torso: Fields) -> None:
    """Do all substeps of blocks `first` to before `last` (XPBD, algorithm 1)."""
    start = np.empty(hair.place.shape[1:], hair.place.dtype)
    force = np.empty(hair.near.shape[1:], hair.place.dtype)
    for block in range(first, last):
        place, near = hair.place[block], hair.near[block]
        for k in range(len(steps.ways)):
            start[:] = place
            force[:] = ZERO
            _predict(hair, block, steps, k)
            for _ in range(steps.iterations):
                for j in range(len(place) - 1):
                    _join(place, near, force, ZERO, j, 1)
                    if j + 2 < len(place):
                        _join(place, near, force, steps.soft, j, 2)
            _touch(hair, block, start, steps, k, head, torso)
            _take_velocity(place, start, hair.velocity[block], steps, k)


@stage
def _predict(hair: Hair, block: int, steps: Steps, n: int) -> None:
    """Move nodes by velocity and forces, drag and pull taken implicitly; two stay on the head.

    None goes farther than a segment is long.
    """
    place, speed, h = hair.place[block], hair.velocity[block], steps.seconds
    steady, goal, pull = hair.steady[block], hair.goal[block], hair.pull[block]
    change, down, near = v.rows_of(steps.change[n]), steps.gravity[n], hair.near[block]
    gravity = (down[0], down[1], down[2])
    for j in range(2, len(place)):
        for w in range(LANES):
            at, past = three(place[j], w), three(speed[j], w)
            drift, k = v.moved(change, at), pull[j, w]
            back = v.times(k, v.minus(v.minus(three(goal[j], w), at), drift))
            more = v.times(h, v.plus(v.plus(gravity, three(steady[j], w)), back))
            fast = v.plus(v.plus(past, v.turned(change, past)), more)
            way = v.plus(drift, v.times(h / (ONE + h * steps.drag + h * h * k), fast))
            far = near[j - 1, 0, w] / (math.sqrt(v.dot(way, way)) + TINY)
            put(place[j], w, v.plus(at, v.times(min(ONE, far), way)))


@stage
def _join(place: Floats, near: Floats, force: Floats, soft: Number, j: int, apart: int) -> None:
    """Move both ends of constraints (equations 17 and 18 of XPBD); rigid where `soft` is 0."""
    start, end, size, pull = place[j], place[j + apart], near[j, apart - 1], force[j, apart - 1]
    a, b = np.float32(j > 1), np.float32(j + apart > 1)
    over = ONE / (a + b + soft + TINY)
    for w in range(LANES):
        way = v.minus(three(end, w), three(start, w))
        reach = math.sqrt(v.dot(way, way)) + TINY
        change = (reach - size[w] - soft * pull[w]) * over
        pull[w] += change
        put(start, w, v.plus(three(start, w), v.times(a * change / reach, way)))
        put(end, w, v.minus(three(end, w), v.times(b * change / reach, way)))


@stage
def _touch(
    hair: Hair, block: int, start: Floats, steps: Steps, k: int, head: Fields, torso: Fields
) -> None:
    """Push nodes out that may have come to a body since they were last so near."""
    place, slack, clear, pose = hair.place[block], hair.slack[block], hair.clear[block], steps.torso
    for j in range(2, len(place)):
        for w in range(LANES):
            way = v.minus(three(place[j], w), three(start[j], w))
            slack[j, w] -= math.sqrt(v.dot(way, way)) + steps.ways[k]
        for w in range(LANES):
            if slack[j, w] <= ZERO:
                off = _push_out(place[j], start[j], w, clear[j, w], head, pose[k], steps.friction)
                beside = _push_out(place[j], start[j], w, clear[j, w], torso, pose[k], ZERO)
                slack[j, w] = min(off, beside)


@stage
def _push_out(
    at: Floats, start: Floats, w: int, clear: Number, body: Fields, pose: Float64Array, grip: Number
) -> float:
    """Push a node out of a body, held by friction against its way; return how far off it is."""
    x, y, z = three(at, w)
    distance, a, b, c = nearest_body(body, pose, x, y, z, float(clear))
    depth = clear - min(distance, OUTSIDE)
    if depth <= 0:
        return float(-depth)
    n = (a, b, c)
    slide = v.minus((x, y, z), three(start, w))
    slide = v.minus(slide, v.times(v.dot(slide, n), n))
    held = min(1.0, grip * depth / math.sqrt(v.dot(slide, slide) + TINY))
    put(at, w, v.plus(v.minus((x, y, z), v.times(held, slide)), v.times(depth, n)))
    return 0.0


@stage
def _take_velocity(place: Floats, start: Floats, speed: Floats, steps: Steps, k: int) -> None:
    """Set velocities to the way of the substep, less what is lost of that on the head."""
    change, over = v.rows_of(steps.change[k]), ONE / steps.seconds
    for j in range(len(place)):
        for w in range(LANES):
            before = three(start[j], w)
            way = v.minus(three(place[j], w), before)
            kept = v.minus(v.times(ONE - steps.lost, way), v.moved(change, before))
            put(speed[j], w, v.times(over, kept))
