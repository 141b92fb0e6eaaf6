"""One implicit step of all strands in time linear in their elements: the default solver.

The step's matrix J'WJ + D has the shape of a chain's mass matrix plus a block diagonal. With the
twist V = (turn, move) of an element's first frame and its own change dq, an element costs a small
quadratic form; eliminating dq from the tip to the root leaves one form in V at each joint (the
articulated inertia of Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 7, here with
elements that bend), and going back from the clamped root gives all dq. Bertails, "Linear time
super-helices", Eurographics 2009. `reference.py` forms and solves the same system densely.
"""

from __future__ import annotations

import math

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled, compiled_with

from .contact import touch
from .element_kernels import advance_frame, node, place_clamped_end, product, times, turns
from .elimination import TWIST, eliminate
from .rods import NODES, SHARES, WEIGHTS, Rods
from .state import CLOSE, FAR, Loads, Motion, Step

POINTS, ARMS, TOUCH, SCRATCH = 3, 4, 5, 6
"""Rows of the scratch space that hold points, levers and what contact needs, and their number."""


@compiled_with(allocates=True)
def step_strands(
    begin: int, stop: int, rods: Rods, motion: Motion, loads: Loads, step: Step
) -> None:
    """Advance strands `begin` to `stop` by one step."""
    for strand in range(begin, stop):
        first, last = rods.offsets[strand], rods.offsets[strand + 1]
        root, frame = np.empty(3), np.empty((3, 3))
        place_clamped_end(step.head, rods.roots[strand], rods.frames[strand], root, frame)
        now, two_step = motion.q[first:last].copy(), step.two_step
        converged = _solve_step(
            rods, motion, loads, step, two_step, step.iterations, first, last, root, frame, now
        )
        if not converged:
            # not converged: redo with backward Euler, which dissipates energy
            two_step = False
            motion.q_before[first:last] = now
            more = 2 * step.iterations
            _solve_step(rods, motion, loads, step, two_step, more, first, last, root, frame, now)
        motion.q_before[first:last] = now
        _update_motion(rods, motion, step, two_step, first, last, root, frame)


@compiled_with(allocates=True)
def _solve_step(
    rods: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    two_step: bool,
    iterations: int,
    first: int,
    last: int,
    root: Float64Array,
    frame: Float64Array,
    now: Float64Array,
) -> bool:
    """Extrapolate one strand's coordinates, iterate, and return whether the step converged."""
    start = np.empty((last - first, 3))
    for k in range(last - first):
        for j in range(3):
            before = motion.q_before[first + k, j]
            start[k, j] = (4 * now[k, j] - before) / 3 if two_step else now[k, j]
            motion.q[first + k, j] = 2 * now[k, j] - before
    turn = 0.0
    for _ in range(iterations):
        turn = newton(rods, motion, loads, step, two_step, first, last, root, frame, start)
        if turn < CLOSE:
            break
    return turn < FAR


@compiled_with(allocates=True)
def newton(
    rods: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    two_step: bool,
    first: int,
    last: int,
    root: Float64Array,
    frame: Float64Array,
    start: Float64Array,
) -> float:
    """Change `motion.q` of one strand by one Newton iteration of the implicit step.

    Return the largest rotation of an element in it, radians.
    """
    count = last - first
    h = step.seconds * 2 / 3 if two_step else step.seconds
    frames, ends = np.empty((count + 1, 3, 3)), np.empty((count + 1, 3))
    spin, shift = np.empty((count, 3, 3)), np.empty((count, 3, 3))
    form, gradient = np.zeros((count, 9, 9)), np.zeros((count, 9))
    scratch = np.empty((SCRATCH, 3, 3))
    frames[0], ends[0] = frame, root
    for k in range(count):
        e = first + k
        own = (frames[k], ends[k], form[k], gradient[k])
        _element(rods, motion, loads, step, two_step, h, e, *own, scratch)
        _advance_element(motion.q[e], rods.lengths[e], frames, ends, spin, shift, k, scratch)
        for j in range(3):
            stiff = rods.lengths[e] * rods.stiffness[e, j]
            form[k, 6 + j, 6 + j] += h * (h + step.friction) * stiff
            gradient[k, 6 + j] += (
                h
                * stiff
                * (
                    h * (motion.q[e, j] - rods.natural[e, j])
                    + step.friction * (motion.q[e, j] - start[k, j])
                )
            )
    eliminate(form, gradient, ends, spin, shift)
    most = 0.0
    for k in range(count):
        # no element turns by more than a radian in one iteration
        dq = gradient[k, TWIST:]
        size = rods.lengths[first + k] * math.sqrt(dq[0] ** 2 + dq[1] ** 2 + dq[2] ** 2)
        most = max(most, size)
        damp = 1.0 if size < 1.0 else 1.0 / size
        for j in range(3):
            motion.q[first + k, j] -= damp * gradient[k, 6 + j]
    return most


@compiled
def _element(
    rods: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    two_step: bool,
    h: float,
    e: int,
    frame: Float64Array,
    end: Float64Array,
    form: Float64Array,
    gradient: Float64Array,
    scratch: Float64Array,
) -> None:
    """Add the Gauss points of element e to its form in (turn, move, dq) and its gradient."""
    slope, by_change, weight = scratch[0], scratch[1], scratch[2]
    local, pull, point = scratch[POINTS, 0], scratch[POINTS, 1], scratch[POINTS, 2]
    before, arm = scratch[ARMS, 0], scratch[ARMS, 1]
    for g in range(NODES):
        node(motion.q[e], rods.lengths[e] * SHARES[g], local, slope)
        mass = rods.density[e] * rods.lengths[e] * WEIGHTS[g]
        drag, spring = h * loads.drag[e, g], h * h * loads.spring[e, g]
        times(frame, local, arm)
        for i in range(3):
            point[i] = end[i] + arm[i]
            old, rate = motion.points[e, g, i], motion.velocity[e, g, i]
            if two_step:
                old = (4 * old - motion.points_before[e, g, i]) / 3
                rate = (4 * rate - motion.velocity_before[e, g, i]) / 3
            before[i] = old
            wanted = old + h * rate + h * h * step.gravity[i]
            pull[i] = (
                mass * (point[i] - wanted)
                + drag * (point[i] - before[i] - h * loads.air[e, g, i])
                + spring * (point[i] - loads.anchor[e, g, i])
            )
        product(frame, slope, by_change)
        total = mass + drag + spring
        for i in range(3):
            for k in range(3):
                weight[i, k] = total if i == k else 0.0
        touched = False
        for body in step.bodies:
            if len(body.field.distance):
                gap, room = loads.gap[e, g], scratch[TOUCH]
                touched |= touch(step, body, mass, h, gap, point, before, weight, pull, room)
        if touched:
            _add_point(form, gradient, arm, by_change, weight, pull)
        else:
            _add_isotropic_point(form, gradient, arm, by_change, total, pull)


@compiled_with(allocates=True)
def _add_point(
    form: Float64Array,
    gradient: Float64Array,
    arm: Float64Array,
    by_change: Float64Array,
    weight: Float64Array,
    pull: Float64Array,
) -> None:
    """Add a point with a weight (3, 3): it moves by move + turn x arm + by_change dq."""
    by = np.zeros((3, 9))
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3
        by[i, p], by[i, q], by[i, 3 + i] = arm[q], -arm[p], 1.0
        for j in range(3):
            by[i, 6 + j] = by_change[i, j]
    for j in range(9):
        x = y = z = 0.0
        for i in range(3):
            x += weight[0, i] * by[i, j]
            y += weight[1, i] * by[i, j]
            z += weight[2, i] * by[i, j]
        for i in range(j + 1):
            form[i, j] += by[0, i] * x + by[1, i] * y + by[2, i] * z
        for i in range(3):
            gradient[j] += by[i, j] * pull[i]


@compiled
def _add_isotropic_point(
    form: Float64Array,
    gradient: Float64Array,
    arm: Float64Array,
    by_change: Float64Array,
    weight: float,
    pull: Float64Array,
) -> None:
    """Add a point whose weight is a multiple of the identity: `_add_point` with fewer products."""
    square = arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2]
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3
        form[i, i] += weight * square
        form[3 + i, 3 + i] += weight
        form[i, 3 + q] += weight * arm[p]
        form[i, 3 + p] -= weight * arm[q]
        gradient[i] += arm[p] * pull[q] - arm[q] * pull[p]
        gradient[3 + i] += pull[i]
        for j in range(3):
            if i <= j:
                form[i, j] -= weight * arm[i] * arm[j]
                form[6 + i, 6 + j] += weight * (
                    by_change[0, i] * by_change[0, j]
                    + by_change[1, i] * by_change[1, j]
                    + by_change[2, i] * by_change[2, j]
                )
            form[i, 6 + j] += weight * (arm[p] * by_change[q, j] - arm[q] * by_change[p, j])
            form[3 + i, 6 + j] += weight * by_change[i, j]
            gradient[6 + j] += by_change[i, j] * pull[i]


@compiled
def _advance_element(
    q: Float64Array,
    length: float,
    frames: Float64Array,
    ends: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
    k: int,
    scratch: Float64Array,
) -> None:
    """Write the frame and end after element k, and their derivatives by its dq."""
    slope, turn, mean, local = scratch[0], scratch[1], scratch[2], scratch[POINTS, 0]
    node(q, length, local, slope)
    turns(q, length, turn, mean)
    product(frames[k], turn, frames[k + 1])
    times(frames[k], local, ends[k + 1])
    for i in range(3):
        ends[k + 1, i] += ends[k, i]
    product(frames[k], mean, spin[k])
    product(frames[k], slope, shift[k])


@compiled_with(allocates=True)
def _update_motion(
    rods: Rods,
    motion: Motion,
    step: Step,
    two_step: bool,
    first: int,
    last: int,
    root: Float64Array,
    frame: Float64Array,
) -> None:
    """Write the Gauss points of the new coordinates, and keep those of the step before."""
    h = step.seconds * 2 / 3 if two_step else step.seconds
    local, slope, arm = np.empty(3), np.empty((3, 3)), np.empty(3)
    next_frame, next_root = np.empty((3, 3)), np.empty(3)
    for e in range(first, last):
        for g in range(NODES):
            node(motion.q[e], rods.lengths[e] * SHARES[g], local, slope)
            times(frame, local, arm)
            for i in range(3):
                old = now = motion.points[e, g, i]
                if two_step:
                    old = (4 * now - motion.points_before[e, g, i]) / 3
                motion.points_before[e, g, i] = now
                motion.points[e, g, i] = root[i] + arm[i]
                motion.velocity_before[e, g, i] = motion.velocity[e, g, i]
                motion.velocity[e, g, i] = (motion.points[e, g, i] - old) / h
        advance_frame(motion.q[e], rods.lengths[e], frame, root, next_frame, next_root)
        frame[:], root[:] = next_frame, next_root


@compiled_with(allocates=True)
def place_points(
    begin: int, stop: int, rods: Rods, q: Float64Array, head: Float64Array, points: Float64Array
) -> None:
    """Write the Gauss points (E, NODES, 3) of strands `begin` to `stop`, world."""
    local, slope, arm = np.empty(3), np.empty((3, 3)), np.empty(3)
    frame, root = np.empty((3, 3)), np.empty(3)
    next_frame, next_root = np.empty((3, 3)), np.empty(3)
    for strand in range(begin, stop):
        place_clamped_end(head, rods.roots[strand], rods.frames[strand], root, frame)
        for e in range(rods.offsets[strand], rods.offsets[strand + 1]):
            for g in range(NODES):
                node(q[e], rods.lengths[e] * SHARES[g], local, slope)
                times(frame, local, arm)
                for i in range(3):
                    points[e, g, i] = root[i] + arm[i]
            advance_frame(q[e], rods.lengths[e], frame, root, next_frame, next_root)
            frame[:], root[:] = next_frame, next_root
