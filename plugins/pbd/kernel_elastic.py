"""Kernels of the rods' forces: inertia and outer forces, frames, torsion, bending."""

from __future__ import annotations

from typing import Any

import numpy as np

from .kernel_math import (
    HALF,
    ONE,
    ZERO,
    Vector,
    cross,
    dot,
    four,
    half_way,
    inlined,
    larger,
    minus,
    moved,
    one,
    plus,
    product,
    put,
    put_four,
    put_one,
    rows_of,
    smaller,
    stage,
    swing_frame,
    three,
    times,
    turned,
    twist_angle,
)
from .linear_system import IMPLICIT
from .reference import DRIFT as DRIFT64
from .reference import LARGEST_SPIN as SPIN64
from .rods import SHARPEST as SHARPEST64
from .simd import root

AHEAD, PASSED = np.float32(1 / IMPLICIT), np.float32(1 - IMPLICIT)
DRIFT, SHARPEST, SPIN = np.float32(DRIFT64), np.float32(SHARPEST64), np.float32(SPIN64)
THIRD, FIFTH = np.float32(1 / 3), np.float32(1 / 5)


@stage
def lead_roots(x: Any, rod: Any, step: Any, h: Any) -> None:
    """Move the roots with the head, and let them hold the next nodes back.

    The inertia between them, a sixth of the segment's mass, is a third of the root's.
    """
    head, over = rows_of(step.head_step), ONE / h
    rest, place = three(rod[0].rest), moved(head, three(x[0].place))
    speed = times(over, minus(rest, place))
    gain = times(over, minus(speed, turned(head, three(x[0].speed))))
    jerk = minus(gain, times(PASSED, turned(head, three(x[0].gain))))
    put(x[0].place, rest)
    put(x[0].speed, speed)
    put(x[0].gain, gain)
    held = times(THIRD * AHEAD * one(rod[0].mass), jerk)
    put(x[1].force, minus(three(x[1].push), held))


@stage
def predict_nodes(x: Any, rod: Any, step: Any, h: Any, damping: Any) -> None:
    """Bring nodes to the new head axes, extrapolate them, and add the forces on them."""
    head, drift, air = rows_of(step.head_step), rows_of(step.drift), rows_of(step.air)
    gravity = (air[0][3], air[1][3], air[2][3])
    for j in range(1, len(x)):
        if j > 1:
            put(x[j].force, three(x[j].push))
        gain = turned(head, three(x[j].gain))
        speed = turned(head, three(x[j].speed))
        place = plus(moved(head, three(x[j].place)), times(h, plus(speed, times(DRIFT * h, gain))))
        gain = times(PASSED, gain)
        speed = plus(speed, times(h, gain))
        put(x[j].place, place)
        put(x[j].speed, speed)
        put(x[j].gain, gain)
        blown = minus(turned(air, three(x[j].wind)), speed)
        slower = minus(moved(drift, place), speed)
        pull = times(one(rod[j].shape), minus(three(rod[j].rest), place))
        outer = plus(times(one(rod[j].drag), blown), times(damping, slower))
        total = times(one(rod[j].mass), plus(plus(outer, pull), gravity))
        put(x[j].force, plus(three(x[j].force), total))


@stage
def transport_frames(x: Any, rod: Any, step: Any) -> None:
    """Write the segments, and transport their frames to the new directions."""
    turn = (step.turn[3], step.turn[0], step.turn[1], step.turn[2])
    for j in range(1, len(x)):
        edge = minus(three(x[j].place), three(x[j - 1].place))
        way = times(ONE / root(dot(edge, edge)), edge)
        put(x[j].edge, edge)
        put(x[j].reach, times(one(rod[j].over), edge))
        put(x[j].way, way)
        put_four(x[j].frame, swing_frame(product(turn, four(x[j].frame)), way))


@stage
def relax_twist(x: Any, rod: Any) -> None:
    """Rotate frames about their segments until torques balance: one Newton step, tridiagonal."""
    put_one(x[0].pivot, ZERO)
    put_one(x[0].value, ZERO)
    for j in range(1, len(x)):
        before, after = four(x[j - 1].frame), four(x[j].frame)
        away, here = three(x[j - 1].way), three(x[j].way)
        natural, quarter = half_way(before, after, three(rod[j].curve))
        turn = minus(here, away)
        spun = cross(natural, turn)
        aside = cross(quarter, spun)
        half, twist = HALF * one(rod[j].bend), one(rod[j].twist)
        torque = twist * (twist_angle(before, after) - one(rod[j].natural))
        firm = HALF * half * larger(dot(natural, turn), ZERO)
        put_one(x[j].torque, torque)
        put_one(x[j].pivot, twist + firm)
        put_one(x[j].beside, firm - twist)
        put_one(x[j].value, half * dot(here, plus(spun, aside)) - torque)
        put_one(x[j - 1].pivot, one(x[j - 1].pivot) + twist + firm)
        put_one(x[j - 1].value, one(x[j - 1].value) + half * dot(away, minus(spun, aside)) + torque)
    solve_tridiagonal(x)
    put_one(x[0].value, ZERO)
    for j in range(1, len(x)):
        # half angles by a rational cosine and sine; the angle by the arc tangent's series
        half = HALF * smaller(larger(one(x[j].value), -SPIN), SPIN)
        cosine = ONE / root(ONE + half * half)
        axis = times(half * cosine, three(x[j].way))
        spin = (cosine, axis[0], axis[1], axis[2])
        put_four(x[j].frame, product(spin, four(x[j].frame)))
        square = half * half
        angle = (half + half) * (ONE - square * (THIRD - FIFTH * square))
        put_one(x[j].value, angle)
        # exact for frames rotated about their own segments
        put_one(x[j].torque, one(x[j].torque) + one(rod[j].twist) * (angle - one(x[j - 1].value)))


@stage
def solve_tridiagonal(x: Any) -> None:
    """Solve the system of `pivot`, `beside` (this row and the one before) and `value`, in place."""
    pivot, value = ONE / one(x[1].pivot), one(x[1].value)
    put_one(x[1].pivot, pivot)
    for j in range(2, len(x)):
        beside = one(x[j].beside)
        factor = beside * pivot
        pivot = ONE / (one(x[j].pivot) - factor * beside)
        value = one(x[j].value) - factor * value
        put_one(x[j].pivot, pivot)
        put_one(x[j].value, value)
    value, beside = ZERO * value, ZERO * value
    for j in range(len(x) - 1, 0, -1):
        value = (one(x[j].value) - beside * value) * one(x[j].pivot)
        beside = one(x[j].beside)
        put_one(x[j].value, value)


@stage
def add_elastic(x: Any, rod: Any) -> None:
    """Add the node forces of bending and twist: minus the energy's gradient."""
    for j in range(1, len(x)):
        to_before, to_after = _pulls(x[j - 1], x[j], rod[j])
        put(x[j - 1].pull, plus(three(x[j - 1].pull), to_before))
        put(x[j].pull, to_after)
    for j in range(1, len(x)):
        pull = times(one(rod[j].over), three(x[j].pull))
        put(x[j - 1].force, minus(three(x[j - 1].force), pull))
        put(x[j].force, plus(three(x[j].force), pull))


@inlined
def _pulls(start: Any, end: Any, rod: Any) -> tuple[Vector, Vector]:
    """Return the generalised forces of an element on the segments before and after it."""
    before, after = four(start.frame), four(end.frame)
    away, here = three(start.way), three(end.way)
    natural, quarter = half_way(before, after, three(rod.curve))
    turn, bend = minus(three(end.reach), three(start.reach)), one(rod.bend)
    spun = times(HALF * bend, cross(natural, turn))
    aside = cross(quarter, spun)
    cosine = larger(ONE + dot(away, here), SHARPEST)
    twisting = times(one(end.torque) / cosine, cross(away, here))
    moment = times(bend, minus(natural, turn))
    to_before = minus(cross(minus(spun, aside), away), plus(moment, twisting))
    return to_before, plus(minus(moment, twisting), cross(plus(spun, aside), here))
