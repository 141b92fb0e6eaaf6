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
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.stored import Float64Array

from .nodes import compiled, carried, node, onward, product, times, turns
from .rods import NODES, SHARES, WEIGHTS, Rods
from .touch import touch


class Motion(NamedTuple):
    """The hair's state, changed in place."""

    q: Float64Array
    """(E, 3) coordinates now."""
    q_before: Float64Array
    """(E, 3) one step ago."""
    points: Float64Array
    """(E, NODES, 3) Gauss points now, world."""
    points_before: Float64Array
    """(E, NODES, 3) one step ago."""
    velocity: Float64Array
    """(E, NODES, 3) metres per second."""
    velocity_before: Float64Array
    """(E, NODES, 3) one step ago."""


class Loads(NamedTuple):
    """What acts on the Gauss points during a step."""

    drag: Float64Array
    """(E, NODES) kilograms per second."""
    air: Float64Array
    """(E, NODES, 3) velocity that the drag pulls to, metres per second."""
    spring: Float64Array
    """(E, NODES) newton per metre, 0 where nothing holds the point."""
    anchor: Float64Array
    """(E, NODES, 3) where springs pull to, world."""
    gap: Float64Array
    """(E, NODES) distance from obstacles below which a point is pushed out, metres."""


class Step(NamedTuple):
    """One step, the same for all strands."""

    seconds: float
    """Its length."""
    two_step: bool
    """True for the second-order formula, which looks back two steps (BDF2); else Euler's."""
    friction: float
    """Internal friction, seconds: force per stiffness and rate of change of shape."""
    iterations: int
    """Newton iterations."""
    gravity: Float64Array
    """(3,) metres per second squared."""
    head: Float64Array
    """(4, 4) head_from_rest at the step's end."""
    head_before: Float64Array
    """(4, 4) at its start."""
    contact: float
    """Square of the rate at which obstacles push points out, per square second."""
    coulomb: float
    """Coefficient of friction on obstacles."""
    origin: Float64Array
    """(3,) of the obstacles' grid."""
    spacing: float
    """Of the obstacles' grid, metres."""
    distance: npt.NDArray[np.float32]
    """(X, Y, Z) of the obstacles, metres; empty for none."""


@compiled
def step_strands(
    rods: Rods, motion: Motion, loads: Loads, step: Step, begin: int, stop: int
) -> None:
    """Advance strands `begin` to `stop` by one step."""
    for strand in range(begin, stop):
        first, last = rods.offsets[strand], rods.offsets[strand + 1]
        root, frame = np.empty(3), np.empty((3, 3))
        carried(step.head, rods.roots[strand], rods.frames[strand], root, frame)
        start = np.empty((last - first, 3))
        for e in range(first, last):
            for k in range(3):
                now, ahead = motion.q[e, k], 2 * motion.q[e, k] - motion.q_before[e, k]
                before = (4 * now - motion.q_before[e, k]) / 3 if step.two_step else now
                start[e - first, k] = before
                motion.q_before[e, k] = now
                motion.q[e, k] = ahead
        for _ in range(step.iterations):
            newton(rods, motion, loads, step, first, last, root, frame, start)
        _keep(rods, motion, step, first, last, root, frame)


@compiled
def newton(
    rods: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    first: int,
    last: int,
    root: Float64Array,
    frame: Float64Array,
    start: Float64Array,
) -> None:
    """Change `motion.q` of one strand by one Newton iteration of the implicit step."""
    count = last - first
    h = step.seconds * 2 / 3 if step.two_step else step.seconds
    frames, ends = np.empty((count + 1, 3, 3)), np.empty((count + 1, 3))
    spin, shift = np.empty((count, 3, 3)), np.empty((count, 3, 3))
    form, gradient = np.zeros((count, 9, 9)), np.zeros((count, 9))
    frames[0], ends[0] = frame, root
    for k in range(count):
        e = first + k
        _element(rods, motion, loads, step, h, e, frames[k], ends[k], form[k], gradient[k])
        _onward(motion.q[e], rods.lengths[e], frames, ends, spin, shift, k)
        for j in range(3):
            stiff = rods.lengths[e] * rods.stiffness[e, j]
            form[k, 6 + j, 6 + j] += h * (h + step.friction) * stiff
            gradient[k, 6 + j] += h * stiff * (
                h * (motion.q[e, j] - rods.natural[e, j])
                + step.friction * (motion.q[e, j] - start[k, j])
            )
    _solve(form, gradient, ends, spin, shift)
    for k in range(count):
        # no element turns by more than a radian in one iteration
        size = rods.lengths[first + k] * math.sqrt(
            gradient[k, 6] ** 2 + gradient[k, 7] ** 2 + gradient[k, 8] ** 2
        )
        damp = 1.0 if size < 1.0 else 1.0 / size
        for j in range(3):
            motion.q[first + k, j] -= damp * gradient[k, 6 + j]


@compiled
def _element(
    rods: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    h: float,
    e: int,
    frame: Float64Array,
    end: Float64Array,
    form: Float64Array,
    gradient: Float64Array,
) -> None:
    """Add the Gauss points of element e to its form in (turn, move, dq) and its gradient."""
    local, slope = np.empty(3), np.empty((3, 3))
    by_twist, weight, pull = np.zeros((3, 9)), np.empty((3, 3)), np.empty(3)
    point, before, wanted, arm = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for g in range(NODES):
        node(motion.q[e], rods.lengths[e] * SHARES[g], local, slope)
        mass = rods.density[e] * rods.lengths[e] * WEIGHTS[g]
        drag, spring = h * loads.drag[e, g], h * h * loads.spring[e, g]
        times(frame, local, arm)
        for i in range(3):
            point[i] = end[i] + arm[i]
            old, rate = motion.points[e, g, i], motion.velocity[e, g, i]
            if step.two_step:
                old = (4 * old - motion.points_before[e, g, i]) / 3
                rate = (4 * rate - motion.velocity_before[e, g, i]) / 3
            before[i] = old
            wanted[i] = old + h * rate + h * h * step.gravity[i]
            pull[i] = (
                mass * (point[i] - wanted[i])
                + drag * (point[i] - before[i] - h * loads.air[e, g, i])
                + spring * (point[i] - loads.anchor[e, g, i])
            )
        weight[:] = 0.0
        for i in range(3):
            weight[i, i] = mass + drag + spring
        if len(step.distance):
            touch(step, mass, h, loads.gap[e, g], point, before, weight, pull)
        by_twist[0, 1], by_twist[0, 2] = arm[2], -arm[1]
        by_twist[1, 0], by_twist[1, 2] = -arm[2], arm[0]
        by_twist[2, 0], by_twist[2, 1] = arm[1], -arm[0]
        for i in range(3):
            by_twist[i, 3 + i] = 1.0
            for j in range(3):
                by_twist[i, 6 + j] = (
                    frame[i, 0] * slope[0, j] + frame[i, 1] * slope[1, j] + frame[i, 2] * slope[2, j]
                )
        for j in range(9):
            x = y = z = 0.0
            for i in range(3):
                x += weight[0, i] * by_twist[i, j]
                y += weight[1, i] * by_twist[i, j]
                z += weight[2, i] * by_twist[i, j]
            for i in range(j + 1):
                form[i, j] += by_twist[0, i] * x + by_twist[1, i] * y + by_twist[2, i] * z
            for i in range(3):
                gradient[j] += by_twist[i, j] * pull[i]


@compiled
def _solve(
    form: Float64Array,
    gradient: Float64Array,
    ends: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
) -> None:
    """Eliminate from the tip to the root, then go back; leaves -dq in `gradient[:, 6:]`."""
    count = len(form)
    tip, pull = np.zeros((6, 6)), np.zeros(6)
    for k in range(count - 1, -1, -1):
        a, b = form[k], gradient[k]
        for i in range(9):
            for j in range(i):
                a[i, j] = a[j, i]
        if k < count - 1:
            _join(a, b, tip, pull, ends[k + 1] - ends[k], spin[k], shift[k])
        _invert(a)
        _eliminate(a, b, tip, pull)
    twist, turned = np.zeros(6), np.zeros(6)
    for k in range(count):
        a, b = form[k], gradient[k]
        for i in range(3):
            for j in range(6):
                b[6 + i] += a[6 + i, j] * twist[j]  # holds A_qq^-1 (A_qV V + gradient) = -dq
        d = ends[k + 1] - ends[k]
        turned[:] = twist
        turned[3] += twist[1] * d[2] - twist[2] * d[1]
        turned[4] += twist[2] * d[0] - twist[0] * d[2]
        turned[5] += twist[0] * d[1] - twist[1] * d[0]
        for i in range(3):
            for j in range(3):
                turned[i] -= spin[k, i, j] * b[6 + j]
                turned[3 + i] -= shift[k, i, j] * b[6 + j]
        twist[:] = turned


@compiled
def _join(
    a: Float64Array,
    b: Float64Array,
    tip: Float64Array,
    pull: Float64Array,
    d: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
) -> None:
    """Add what hangs on an element's end: its twist is the element's own, moved, and S dq."""
    to = np.zeros((6, 9))
    for i in range(6):
        to[i, i] = 1.0
    to[3, 1], to[3, 2], to[4, 0] = d[2], -d[1], -d[2]
    to[4, 2], to[5, 0], to[5, 1] = d[0], d[1], -d[0]
    for i in range(3):
        for j in range(3):
            to[i, 6 + j], to[3 + i, 6 + j] = spin[i, j], shift[i, j]
    carried = np.zeros(6)
    for j in range(9):
        for i in range(6):
            total = 0.0
            for k in range(6):
                total += tip[i, k] * to[k, j]
            carried[i] = total
        for i in range(9):
            total = 0.0
            for k in range(6):
                total += to[k, i] * carried[k]
            a[i, j] += total
        for i in range(6):
            b[j] += to[i, j] * pull[i]


@compiled
def _invert(a: Float64Array) -> None:
    """Put the inverse of the symmetric block [6:, 6:] in its place."""
    p, q, r = a[6, 6], a[6, 7], a[6, 8]
    s, t, u = a[7, 7], a[7, 8], a[8, 8]
    # Cholesky, since the forms of twist and bending differ by many orders of magnitude
    l0 = math.sqrt(p)
    l1, l2 = q / l0, r / l0
    l3 = math.sqrt(s - l1 * l1)
    l4 = (t - l1 * l2) / l3
    l5 = math.sqrt(u - l2 * l2 - l4 * l4)
    i0, i3, i5 = 1 / l0, 1 / l3, 1 / l5
    i1 = -l1 * i0 * i3
    i4 = -l4 * i3 * i5
    i2 = -(l2 * i0 + l4 * i1) * i5
    a[6, 6] = i0 * i0 + i1 * i1 + i2 * i2
    a[7, 7] = i3 * i3 + i4 * i4
    a[8, 8] = i5 * i5
    a[6, 7] = a[7, 6] = i1 * i3 + i2 * i4
    a[6, 8] = a[8, 6] = i2 * i5
    a[7, 8] = a[8, 7] = i4 * i5


@compiled
def _eliminate(a: Float64Array, b: Float64Array, tip: Float64Array, pull: Float64Array) -> None:
    """Take dq out: the joint's form in `tip`, A_qq^-1 A_qV in a[6:, :6], A_qq^-1 g in b[6:]."""
    x, y, z = b[6], b[7], b[8]
    for i in range(3):
        b[6 + i] = a[6 + i, 6] * x + a[6 + i, 7] * y + a[6 + i, 8] * z
    for j in range(6):
        x, y, z = a[j, 6], a[j, 7], a[j, 8]
        for i in range(3):
            a[6 + i, j] = a[6 + i, 6] * x + a[6 + i, 7] * y + a[6 + i, 8] * z
    for i in range(6):
        pull[i] = b[i]
        for k in range(3):
            pull[i] -= a[i, 6 + k] * b[6 + k]
        for j in range(6):
            total = a[i, j]
            for k in range(3):
                total -= a[i, 6 + k] * a[6 + k, j]
            tip[i, j] = total


@compiled
def _onward(
    q: Float64Array,
    length: float,
    frames: Float64Array,
    ends: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
    k: int,
) -> None:
    """Place the end of element k and how it moves with dq."""
    local, slope, turn, mean = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    node(q, length, local, slope)
    turns(q, length, turn, mean)
    product(frames[k], turn, frames[k + 1])
    times(frames[k], local, ends[k + 1])
    for i in range(3):
        ends[k + 1, i] += ends[k, i]
    product(frames[k], mean, spin[k])
    product(frames[k], slope, shift[k])


@compiled
def _keep(
    rods: Rods,
    motion: Motion,
    step: Step,
    first: int,
    last: int,
    root: Float64Array,
    frame: Float64Array,
) -> None:
    """Place the Gauss points at the new coordinates and put the old ones one step back."""
    h = step.seconds * 2 / 3 if step.two_step else step.seconds
    local, slope, arm = np.empty(3), np.empty((3, 3)), np.empty(3)
    next_frame, next_root = np.empty((3, 3)), np.empty(3)
    for e in range(first, last):
        for g in range(NODES):
            node(motion.q[e], rods.lengths[e] * SHARES[g], local, slope)
            times(frame, local, arm)
            for i in range(3):
                old = now = motion.points[e, g, i]
                if step.two_step:
                    old = (4 * now - motion.points_before[e, g, i]) / 3
                motion.points_before[e, g, i] = now
                motion.points[e, g, i] = root[i] + arm[i]
                motion.velocity_before[e, g, i] = motion.velocity[e, g, i]
                motion.velocity[e, g, i] = (motion.points[e, g, i] - old) / h
        onward(motion.q[e], rods.lengths[e], frame, root, next_frame, next_root)
        frame[:], root[:] = next_frame, next_root


@compiled
def place_points(
    rods: Rods, q: Float64Array, head: Float64Array, points: Float64Array, begin: int, stop: int
) -> None:
    """Write the Gauss points (E, NODES, 3) of strands `begin` to `stop`, world."""
    local, slope, arm = np.empty(3), np.empty((3, 3)), np.empty(3)
    frame, root = np.empty((3, 3)), np.empty(3)
    next_frame, next_root = np.empty((3, 3)), np.empty(3)
    for strand in range(begin, stop):
        carried(head, rods.roots[strand], rods.frames[strand], root, frame)
        for e in range(rods.offsets[strand], rods.offsets[strand + 1]):
            for g in range(NODES):
                node(q[e], rods.lengths[e] * SHARES[g], local, slope)
                times(frame, local, arm)
                for i in range(3):
                    points[e, g, i] = root[i] + arm[i]
            onward(q[e], rods.lengths[e], frame, root, next_frame, next_root)
            frame[:], root[:] = next_frame, next_root
