"""One implicit step of all strands in time linear in their elements: the default solver.

The step's matrix J'WJ + D has the shape of a chain's mass matrix plus a block diagonal. With the
twist V = (turn, move) of an element's first frame and its own change dq, an element costs a small
quadratic form; eliminating dq from the tip to the root leaves one form in V at each joint (the
articulated inertia of Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 7, here with
elements that bend), and going back from the clamped root gives all dq. Bertails, "Linear time
super-helices", Eurographics 2009. Tests form and solve the same system densely.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled_with

from .contact import Point, touch
from .element_kernels import advance_frame, node, place_clamped_end, product, times, turns
from .elimination import TWIST, eliminate
from .rods import NODES, SHARES, WEIGHTS, Rods
from .state import CLOSE, FAR, Loads, Motion, Step

POINTS, ARMS, TOUCH, SCRATCH = 3, 4, 5, 6
"""Rows of the scratch space that hold points, levers and what contact needs, and their number."""


class Strand(NamedTuple):
    """A strand during a try of a step."""

    first: int
    """Its first element."""
    last: int
    """The first element after it."""
    root: Float64Array
    """(3,) where the head holds it at the step's end, metres."""
    frame: Float64Array
    """(3, 3) how."""
    two_step: bool
    """As in `Step`, of this try."""


class Chain(NamedTuple):
    """The elements of a strand in an iteration, from the root on."""

    frames: Float64Array
    """(n + 1, 3, 3) at the elements' ends."""
    ends: Float64Array
    """(n + 1, 3) metres, world."""
    spin: Float64Array
    """(n, 3, 3) turn of the end after an element by its dq."""
    shift: Float64Array
    """(n, 3, 3) move of that end by its dq."""
    form: Float64Array
    """(n, 9, 9) quadratic form of each in (turn, move, dq)."""
    gradient: Float64Array
    """(n, 9) and the gradient."""


@compiled_with(inside=True)
def _effective_seconds(step: Step, strand: Strand) -> float:
    """Return the time by which an acceleration changes the velocity in the step's formula."""
    return step.seconds * 2 / 3 if strand.two_step else step.seconds


@compiled_with(allocates=True)
def step_strands(
    begin: int, stop: int, rods: Rods, motion: Motion, loads: Loads, step: Step
) -> None:
    """Advance strands `begin` to `stop` by one step."""
    for strand in range(begin, stop):
        first, last = rods.offsets[strand], rods.offsets[strand + 1]
        root, frame = np.empty(3), np.empty((3, 3))
        place_clamped_end(step.head, rods.roots[strand], rods.frames[strand], root, frame)
        now, own = motion.q[first:last].copy(), Strand(first, last, root, frame, step.two_step)
        if not _solve_step(rods, motion, loads, step, own, step.iterations, now):
            # not converged: redo with backward Euler, which dissipates energy
            own = Strand(first, last, root, frame, False)
            motion.q_before[first:last] = now
            _solve_step(rods, motion, loads, step, own, 2 * step.iterations, now)
        motion.q_before[first:last] = now
        _update_motion(rods, motion, step, own)


@compiled_with(allocates=True, inside=True)
def _solve_step(
    rods: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    strand: Strand,
    iterations: int,
    now: Float64Array,
) -> bool:
    """Extrapolate one strand's coordinates, iterate, and return whether the step converged."""
    first, count = strand.first, strand.last - strand.first
    start = np.empty((count, 3))
    for k in range(count):
        for j in range(3):
            before = motion.q_before[first + k, j]
            start[k, j] = (4 * now[k, j] - before) / 3 if strand.two_step else now[k, j]
            motion.q[first + k, j] = 2 * now[k, j] - before
    turn = 0.0
    for _ in range(iterations):
        turn = newton(rods, motion, loads, step, strand, start)
        if turn < CLOSE:
            break
    return turn < FAR


@compiled_with(allocates=True)
def newton(
    rods: Rods, motion: Motion, loads: Loads, step: Step, strand: Strand, start: Float64Array
) -> float:
    """Change `motion.q` of one strand by one Newton iteration of the implicit step.

    Return the largest rotation of an element in it, radians.
    """
    first, count = strand.first, strand.last - strand.first
    h = _effective_seconds(step, strand)
    chain = Chain(
        np.empty((count + 1, 3, 3)),
        np.empty((count + 1, 3)),
        np.empty((count, 3, 3)),
        np.empty((count, 3, 3)),
        np.zeros((count, 9, 9)),
        np.zeros((count, 9)),
    )
    form, gradient, scratch = chain.form, chain.gradient, np.empty((SCRATCH, 3, 3))
    chain.frames[0], chain.ends[0] = strand.frame, strand.root
    for k in range(count):
        e = first + k
        _element(rods, motion, loads, step, strand, chain, k, scratch)
        _advance_element(motion.q[e], rods.lengths[e], chain, k, scratch)
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
    eliminate(form, gradient, chain.ends, chain.spin, chain.shift)
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


@compiled_with(inside=True)
def _element(
    rods: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    strand: Strand,
    chain: Chain,
    k: int,
    scratch: Float64Array,
) -> None:
    """Add the Gauss points of element k to its form in (turn, move, dq) and its gradient."""
    e, h, two_step = strand.first + k, _effective_seconds(step, strand), strand.two_step
    frame, end, form, gradient = chain.frames[k], chain.ends[k], chain.form[k], chain.gradient[k]
    slope, by_change, weight = scratch[0], scratch[1], scratch[2]
    local, pull, point = scratch[POINTS, 0], scratch[POINTS, 1], scratch[POINTS, 2]
    before, arm = scratch[ARMS, 0], scratch[ARMS, 1]
    own = Point(point, before, weight, pull)
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
            for j in range(3):
                weight[i, j] = total if i == j else 0.0
        touched = False
        for body in step.bodies:
            if len(body.field.distance):
                touched |= touch(step, body, mass, h, loads.gap[e, g], own, scratch[TOUCH])
        if touched:
            _add_point(form, gradient, arm, by_change, weight, pull)
        else:
            _add_isotropic_point(form, gradient, arm, by_change, total, pull)


@compiled_with(allocates=True, inside=True)
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


@compiled_with(inside=True)
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


@compiled_with(inside=True)
def _advance_element(
    q: Float64Array, length: float, chain: Chain, k: int, scratch: Float64Array
) -> None:
    """Write the frame and end after element k, and their derivatives by its dq."""
    frames, ends = chain.frames, chain.ends
    slope, turn, mean, local = scratch[0], scratch[1], scratch[2], scratch[POINTS, 0]
    node(q, length, local, slope)
    turns(q, length, turn, mean)
    product(frames[k], turn, frames[k + 1])
    times(frames[k], local, ends[k + 1])
    for i in range(3):
        ends[k + 1, i] += ends[k, i]
    product(frames[k], mean, chain.spin[k])
    product(frames[k], slope, chain.shift[k])


@compiled_with(allocates=True, inside=True)
def _update_motion(rods: Rods, motion: Motion, step: Step, strand: Strand) -> None:
    """Write the Gauss points of the new coordinates, and keep those of the step before."""
    h, two_step = _effective_seconds(step, strand), strand.two_step
    root, frame = strand.root, strand.frame
    local, slope, arm = np.empty(3), np.empty((3, 3)), np.empty(3)
    next_frame, next_root = np.empty((3, 3)), np.empty(3)
    for e in range(strand.first, strand.last):
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
