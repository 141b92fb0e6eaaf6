"""The fast backend's kernels: the reference's substep, float32, strands side by side."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.parallel import compiled_with
from hairkit.simulation.obstacle_kernels import Fields

from .block import WORK, Packed, Records, Settings
from .kernel_contact import resolve_contacts
from .linear_system import IMPLICIT
from .reference import DRIFT as DRIFT64
from .reference import FASTEST_CHANGE as CHANGE64
from .reference import FASTEST_TURN as TURN64
from .reference import LARGEST_SPIN as SPIN64
from .reference import TINY as TINY64
from .rods import SHARPEST as SHARPEST64
from .simd import (
    HALF,
    LANES,
    ONE,
    ZERO,
    Frame,
    Vector,
    cross,
    dot,
    four,
    half_way,
    inlined,
    larger,
    load,
    minus,
    moved,
    one,
    plus,
    product,
    put,
    put_four,
    put_one,
    root,
    rows_of,
    smaller,
    stage,
    store,
    swing_frame,
    third_axis,
    three,
    times,
    turned,
    twist_angle,
)

AHEAD, PASSED = np.float32(1 / IMPLICIT), np.float32(1 - IMPLICIT)
DRIFT, SHARPEST, SPIN = np.float32(DRIFT64), np.float32(SHARPEST64), np.float32(SPIN64)
CHANGE, TURN, TINY = np.float32(CHANGE64), np.float32(TURN64), np.float32(TINY64)
THIRD, FIFTH = np.float32(1 / 3), np.float32(1 / 5)
LEAST = np.float32(1e-6)
"""Least pivot of the lengths, as a share of the metric's diagonal."""


@compiled_with(fastmath=True)
def run_substeps(
    first: int,
    last: int,
    state: Records,
    packed: Packed,
    steps: Records,
    air: Float32Array,
    force: Float32Array,
    fields: Fields,
    settings: Settings,
) -> None:
    """Advance blocks `first` to before `last` by as many substeps as there are `steps`, in place.

    `air` (B, n, 3, LANES), world, and `force` alike per mass, head axes, may have one block and
    node for all.
    """
    n, h = state.shape[1], settings.seconds
    x, matrix = np.empty(n, WORK), np.empty((n * n, LANES), np.float32)
    for block in range(first, last):
        s, rod, metric = state[block], packed.nodes[block], packed.metric[block]
        wind, push = air[min(block, len(air) - 1)], force[min(block, len(force) - 1)]
        for k in range(len(steps)):
            lead_roots(s, x, rod, steps[k], h)
            predict_nodes(s, x, rod, steps[k], settings, wind, push)
            transport_frames(s, x, rod, steps[k])
            relax_twist(s, x, rod)
            add_elastic(s, x, rod)
            solve_banded(x, rod)
            keep_linear_lengths(x, rod, metric, matrix)
            move_nodes(s, x, h)
            if settings.rounds >= 0:
                resolve_contacts(s, x, rod, steps[k], fields, settings)
            keep_lengths(s, x, rod, h)


@stage
def lead_roots(s: Any, x: Any, rod: Any, step: Any, h: Any) -> None:
    """Move the roots with the head, and let them hold the next nodes back.

    The inertia between them, a sixth of the segment's mass, is a third of the root's.
    """
    head, over = rows_of(step.head_step), ONE / h
    rest, place = three(rod[0].rest), moved(head, three(s[0].place))
    speed = times(over, minus(rest, place))
    gain = times(over, minus(speed, turned(head, three(s[0].speed))))
    jerk = minus(gain, times(PASSED, turned(head, three(s[0].gain))))
    put(s[0].place, rest)
    put(s[0].speed, speed)
    put(s[0].gain, gain)
    axis = third_axis(four(s[0].frame))
    put(x[0].way, axis)
    put(x[0].reach, axis)
    held = times(THIRD * AHEAD * one(rod[0].mass), jerk)
    put(x[1].force, times(-ONE, held))


@stage
def predict_nodes(s: Any, x: Any, rod: Any, step: Any, settings: Any, wind: Any, push: Any) -> None:
    """Bring nodes to the new head axes, extrapolate them, and add the forces on them."""
    head, drift, air = rows_of(step.head_step), rows_of(step.drift), rows_of(step.air)
    gravity, h = (air[0][3], air[1][3], air[2][3]), settings.seconds
    for j in range(1, len(x)):
        gain = turned(head, three(s[j].gain))
        speed = turned(head, three(s[j].speed))
        place = plus(moved(head, three(s[j].place)), times(h, plus(speed, times(DRIFT * h, gain))))
        gain = times(PASSED, gain)
        speed = plus(speed, times(h, gain))
        put(s[j].place, place)
        put(s[j].speed, speed)
        put(s[j].gain, gain)
        blown = minus(turned(air, three(wind[min(j, len(wind) - 1)])), speed)
        slower = minus(moved(drift, place), speed)
        pull = times(one(rod[j].shape), minus(three(rod[j].rest), place))
        outer = plus(times(one(rod[j].drag), blown), times(settings.damping, slower))
        total = times(one(rod[j].mass), plus(plus(outer, pull), gravity))
        total = plus(total, three(push[min(j, len(push) - 1)]))
        put(x[j].force, plus(total, three(x[1].force)) if j == 1 else total)


@stage
def transport_frames(s: Any, x: Any, rod: Any, step: Any) -> None:
    """Write the segments, and transport their frames to the new directions."""
    turn = (step.turn[0], step.turn[1], step.turn[2], step.turn[3])
    for j in range(1, len(x)):
        edge = minus(three(s[j].place), three(s[j - 1].place))
        way = times(ONE / root(dot(edge, edge)), edge)
        put(x[j].edge, edge)
        put(x[j].reach, times(one(rod[j].over), edge))
        put(x[j].way, way)
        put_four(s[j].frame, swing_frame(product(turn, four(s[j].frame)), way))


@stage
def relax_twist(s: Any, x: Any, rod: Any) -> None:
    """Rotate frames about their segments until torques balance: one Newton step, tridiagonal."""
    put_one(x[0].pivot, ZERO)
    put_one(x[0].value, ZERO)
    for j in range(1, len(x)):
        before, after = four(s[j - 1].frame), four(s[j].frame)
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
        put_four(s[j].frame, product(spin, four(s[j].frame)))
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
def add_elastic(s: Any, x: Any, rod: Any) -> None:
    """Add the node forces of bending and twist: minus the energy's gradient."""
    for j in range(1, len(x)):
        to_before, to_after = _pulls(four(s[j - 1].frame), four(s[j].frame), x[j - 1], x[j], rod[j])
        put(x[j - 1].pull, plus(three(x[j - 1].pull), to_before))
        put(x[j].pull, to_after)
    for j in range(1, len(x)):
        pull = times(one(rod[j].over), three(x[j].pull))
        put(x[j - 1].force, minus(three(x[j - 1].force), pull))
        put(x[j].force, plus(three(x[j].force), pull))


@inlined
def _pulls(before: Frame, after: Frame, start: Any, end: Any, rod: Any) -> tuple[Vector, Vector]:
    """Return the generalised forces of an element on the segments before and after it."""
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


@stage
def solve_banded(x: Any, rod: Any) -> None:
    """Write `solved`, A^-1 `force` of the free nodes, by the factor L D L^T of two bands."""
    n = len(x)
    put(x[0].solved, (ZERO, ZERO, ZERO))
    before = beyond = three(x[0].solved)
    for j in range(1, n):
        known = plus(times(one(rod[j].first), before), times(one(rod[j].second), beyond))
        before, beyond = minus(three(x[j].force), known), before
        put(x[j].solved, before)
    before = beyond = three(x[0].solved)
    for j in range(n - 1, 0, -1):
        # the entries below row j stand in the two rows after it
        k, further = min(j + 1, n - 1), min(j + 2, n - 1)
        known = plus(times(one(rod[k].first), before), times(one(rod[further].second), beyond))
        here = minus(times(one(rod[j].pivot), three(x[j].solved)), known)
        before, beyond = here, before
        put(x[j].solved, here)


@stage
def keep_linear_lengths(x: Any, rod: Any, metric: Any, matrix: Any) -> None:
    """Write `free` and `solved`, what tensions take from it so that segments keep their lengths."""
    put(x[0].free, three(x[0].solved))
    for j in range(1, len(x)):
        put(x[j].free, three(x[j].solved))
        change = minus(three(x[j].free), three(x[j - 1].free))
        reach = dot(plus(three(x[j].edge), change), three(x[j].way))
        put_one(x[j].value, reach - one(rod[j].length))
    solve_lengths(x, metric, matrix)
    last = len(x) - 1
    after = times(one(x[last].value), three(x[last].way))
    put(x[last].force, after)
    for j in range(last - 1, 0, -1):
        pull = times(one(x[j].value), three(x[j].way))
        put(x[j].force, minus(pull, after))
        after = pull
    solve_banded(x, rod)


@stage
def solve_lengths(x: Any, metric: Any, matrix: Any) -> None:
    """Solve metric * (d d^T) for `value`, in place, by elimination; `matrix` (n n) is work.

    Rows of its upper triangle are eliminated from those below; what stays is D L^T.
    """
    n, pair = len(x), 0
    for j in range(1, n):
        way = three(x[j].way)
        for i in range(1, j + 1):
            store(matrix, i * n + j, load(metric, pair) * dot(three(x[i].way), way))
            pair += 1
    for j in range(1, n, 2):  # two rows at a time share each load and store of those below
        _take_pivot(x, metric, matrix, j)
        p, a = one(x[j].pivot), one(x[j].value)
        if j + 1 == n:
            break
        share = p * load(matrix, j * n + j + 1)
        put_one(x[j + 1].value, one(x[j + 1].value) - share * a)
        for k in range(j + 1, n):
            left = load(matrix, j * n + n + k) - share * load(matrix, j * n + k)
            store(matrix, j * n + n + k, left)
        _take_pivot(x, metric, matrix, j + 1)
        q, b = one(x[j + 1].pivot), one(x[j + 1].value)
        for i in range(j + 2, n):
            s, t = p * load(matrix, j * n + i), q * load(matrix, j * n + n + i)
            put_one(x[i].value, one(x[i].value) - (s * a + t * b))
            for k in range(i, n):
                u, v = load(matrix, j * n + k), load(matrix, j * n + n + k)
                left = load(matrix, i * n + k) - (s * u + t * v)
                store(matrix, i * n + k, left)
    for j in range(n - 1, 0, -1):
        value = one(x[j].value)
        for i in range(j + 1, n):
            value = value - load(matrix, j * n + i) * one(x[i].value)
        put_one(x[j].value, one(x[j].pivot) * value)


@inlined
def _take_pivot(x: Any, metric: Any, matrix: Any, j: int) -> None:
    """Write 1 / D of row j."""
    least = LEAST * load(metric, (j - 1) * (j + 2) // 2)
    put_one(x[j].pivot, ONE / larger(load(matrix, j * len(x) + j), least))


@stage
def move_nodes(s: Any, x: Any, h: Any) -> None:
    """Move nodes by the solution, which adds to their velocity and acceleration."""
    over = ONE / h
    for j in range(1, len(x)):
        move = minus(three(x[j].free), three(x[j].solved))
        added = times(over * AHEAD, move)
        put(s[j].place, plus(three(s[j].place), move))
        put(s[j].speed, plus(three(s[j].speed), added))
        gain = plus(three(s[j].gain), times(over, added))
        share = smaller(CHANGE / root(dot(gain, gain) + TINY), ONE)
        put(s[j].gain, times(share, gain))


@stage
def keep_lengths(s: Any, x: Any, rod: Any, h: Any) -> None:
    """Give segments their exact lengths, from the root to the tip; bound how fast they turn."""
    over = ONE / h
    for j in range(1, len(x)):
        edge = minus(three(s[j].place), three(s[j - 1].place))
        length = one(rod[j].length)
        way = times(length / root(dot(edge, edge) + TINY) - ONE, edge)
        put(s[j].place, plus(three(s[j].place), way))
        before = three(s[j - 1].speed)
        apart = minus(plus(three(s[j].speed), times(over, way)), before)
        share = smaller(TURN * over * length / root(dot(apart, apart) + TINY), ONE)
        put(s[j].speed, plus(before, times(share, apart)))
