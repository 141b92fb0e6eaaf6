"""The fast backend's kernels: the reference's substep, float32, strands side by side.

Strands stand in blocks of `LANES`; the last axis of every array is the strand in its block, so that
each line below works on `LANES` strands at once. What makes them vector loops: every constant is
float32, a row function writes to one or two arrays, at constant rows, and nothing branches.
Masses are shares of the strand's mean node mass, so that stiffness is in 1/s^2.
"""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from numba import njit, prange

from hairkit.stored import Float32Array

from .kernel_math import LANES, row
from .kernel_rows import (
    DIRECTION,
    EDGE,
    FIRM,
    REACH,
    TO_AFTER,
    TO_BEFORE,
    TORQUE,
    constants_of,
    elastic_row,
    predict_row,
    spin_row,
    swing_row,
    twist_row,
)
from .kernel_solve import (
    banded_solve,
    excess_of,
    factorise_lengths,
    lengths_solve,
    pull_back,
    tridiagonal_solve,
)
from .kernel_touch import relengthen, touch

LENGTH, OVER, BEND, TWIST, CURVE, NATURAL, FIRST, SECOND, PIVOT = 0, 1, 2, 3, 4, 7, 8, 9, 10
"""Rows of an element's constants: length, 1/length, stiffnesses, natural turn (3), natural twist,
and the banded factor's two lower entries and reciprocal pivot."""
ELEMENT = 11
REST, MASS, DRAG, SHAPE, CLEAR, EASE = 0, 3, 4, 5, 6, 7
"""Rows of a node's constants: rest place (3), mass, rates, clearance, 1/mass (root 0)."""
NODE = 8
PLACE, SPEED, SLACK = 0, 3, 6
"""Rows of a node's state: place (3), velocity (3), and how far it may go before it is looked up."""
STATE = 7

ONE, ZERO = np.float32(1), np.float32(0)


@njit(parallel=True, fastmath=True, error_model="numpy", cache=True)
def run_substeps(  # type: ignore[no-untyped-def]
    x, q, root, node, element, metric, rides, turns, gravity, air, force, grid, settings
) -> None:  # pragma: no cover - compiled
    """Advance all blocks by as many substeps as there are rides, in place.

    Parameters
    ----------
    x, q
        (B, n, STATE, W) nodes and (B, n - 1, 4, W) frames.
    root, node, element, metric
        (B, 7, W) frame and direction, (B, n, NODE, W), (B, n - 1, ELEMENT, W) and
        (B, n (n - 1) / 2, W) constants.
    rides, turns
        (K, 3, 8): turn and shift of the head axes, with the turn's quaternion behind the first row;
        (K, 3, 3) from the world to the head axes after each substep.
    gravity, air, force
        (3,) world; (B, n, 3, W) world, or (1, 1, 3, W) for all; (B, n, 3, W) per mass, or
        (1, 1, 3, W) for none.
    grid
        Obstacles: values (X, Y, Z), and where they are (4,): origin and 1/spacing.
    settings
        (6,) step, damping, friction, depenetration speed, iterations, contacts.
    """
    for number in prange(x.shape[0]):
        block = np.int64(number)
        n = x.shape[1]
        # Rows of work: segments (9), elements (6), forces and changes (3 each), contact.
        segment = np.zeros((n, 9, LANES), np.float32)
        work = np.zeros((n, 6, LANES), np.float32)
        vector = np.zeros((6, n, 3, LANES), np.float32)
        line = np.zeros((5, n, LANES), np.float32)
        lengths = np.zeros((metric.shape[1], LANES), np.float32)
        wind = air[block] if air.shape[0] > 1 else air[0]
        extra = force[block] if force.shape[0] > 1 else force[0]
        for k in range(rides.shape[0]):
            _substep(
                x[block], q[block], root[block], node[block], element[block], metric[block],
                rides[k], turns[k], gravity, wind, extra, grid, settings,
                segment, work, vector, line, lengths,
            )  # fmt: skip


@row
def _substep(  # type: ignore[no-untyped-def]
    x, q, root, node, element, metric, ride, turn, gravity, air, extra, grid, settings,
    segment, work, vector, line, lengths,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Do one substep of a block, in the reference's order."""
    n = x.shape[0]
    force, free, change = vector[0], vector[1], vector[2]
    constants = constants_of(ride, turn, gravity, settings)
    uniform, pushed = air.shape[0] == 1, extra.shape[0] == n
    flat = x.reshape(n, STATE * LANES)
    for j in range(n):
        predict_row(
            flat[j], node[j].reshape(-1), air[0 if uniform else j].reshape(-1), constants,
            force[j].reshape(-1), j == 0,
        )  # fmt: skip
        if pushed:
            _add_row(extra[j].reshape(-1), force[j].reshape(-1))
    frames, parts = q.reshape(n - 1, 4 * LANES), segment.reshape(n, 9 * LANES)
    elements, works = element.reshape(n - 1, ELEMENT * LANES), work.reshape(n, 6 * LANES)
    held = root.reshape(7 * LANES)
    for j in range(n - 1):
        swing_row(flat[j], flat[j + 1], frames[j], elements[j], constants, parts[j])
    _untwist(frames, held, parts, elements, element, work, works, line)
    _elastic(frames, held, parts, elements, element, work, works, force)
    banded_solve(element, force, free)
    iterations = int(settings[4])
    for iteration in range(iterations):
        excess_of(segment, free, element, line[0])
        factorise_lengths(metric, segment, lengths, line[1], line[4])
        lengths_solve(lengths, line[1], line[0], n - 1)
        pull_back(line[0], segment, force)
        banded_solve(element, force, change)
        if iteration + 1 < iterations:
            _redirected(segment, free, change)
    for j in range(1, n):
        _apply_row(flat[j], free[j].reshape(-1), change[j].reshape(-1), ONE / settings[0])
    if settings[5] > ZERO:
        touch(x, node, ride, grid, settings, vector[3])
        relengthen(x, node, element, segment, vector[3], line, ONE / settings[0])


@row
def _untwist(q, root, parts, elements, element, work, works, line) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Spin frames about their segments until torques balance: one Newton step, tridiagonal."""
    m = q.shape[0]
    for j in range(m):
        before = root[: 4 * LANES] if j == 0 else q[j - 1]
        twist_row(before, q[j], parts[j], elements[j], works[j])
    diagonal, beside, angle = line[0], line[1], line[2]
    for j in range(m):
        here, el = work[j], element[j]
        for w in range(LANES):
            diagonal[j, w] = el[TWIST, w] + here[FIRM, w]
            beside[j, w] = here[FIRM, w] - el[TWIST, w]
            angle[j, w] = here[TO_AFTER, w] - here[TORQUE, w]
        if j + 1 < m:
            after, ea = work[j + 1], element[j + 1]
            for w in range(LANES):
                diagonal[j, w] += ea[TWIST, w] + after[FIRM, w]
            for w in range(LANES):
                angle[j, w] += after[TO_BEFORE, w] + after[TORQUE, w]
    tridiagonal_solve(diagonal, beside, angle, m)
    for j in range(m):
        spin_row(q[j], parts[j], angle[j])


@row
def _elastic(q, root, parts, elements, element, work, works, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Bending and twist as forces on the nodes."""
    m = q.shape[0]
    for j in range(m):
        before = root[: 4 * LANES] if j == 0 else q[j - 1]
        reach = root[4 * LANES :] if j == 0 else parts[j - 1, REACH * LANES :]
        elastic_row(before, q[j], reach, parts[j], elements[j], works[j])
    for j in range(m):
        here, after, el = work[j], work[min(j + 1, m - 1)], element[j]
        inner = ONE if j + 1 < m else ZERO
        fa, fb = force[j], force[j + 1]
        for c in range(3):
            for w in range(LANES):
                fa[c, w] -= (here[c, w] + inner * after[3 + c, w]) * el[OVER, w]
            for w in range(LANES):
                fb[c, w] += (here[c, w] + inner * after[3 + c, w]) * el[OVER, w]


@row
def _redirected(segment, free, change) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Turn the directions to where the solution leads, for another round."""
    for j in range(segment.shape[0] - 1):
        sj, fa, fb, ca, cb = segment[j], free[j], free[j + 1], change[j], change[j + 1]
        for w in range(LANES):
            e0 = sj[EDGE, w] + (fb[0, w] - cb[0, w]) - (fa[0, w] - ca[0, w])
            e1 = sj[EDGE + 1, w] + (fb[1, w] - cb[1, w]) - (fa[1, w] - ca[1, w])
            e2 = sj[EDGE + 2, w] + (fb[2, w] - cb[2, w]) - (fa[2, w] - ca[2, w])
            size = ONE / np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
            sj[DIRECTION, w] = e0 * size
            sj[DIRECTION + 1, w] = e1 * size
            sj[DIRECTION + 2, w] = e2 * size


@row
def _add_row(extra, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add further force."""
    for w in range(3 * LANES):
        force[w] += extra[w]


@row
def _apply_row(x, free, change, over) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Take the change on, place and velocity."""
    for w in range(LANES):
        m0, m1 = free[w] - change[w], free[LANES + w] - change[LANES + w]
        m2 = free[2 * LANES + w] - change[2 * LANES + w]
        x[w], x[LANES + w], x[2 * LANES + w] = (
            x[w] + m0,
            x[LANES + w] + m1,
            x[2 * LANES + w] + m2,
        )
        x[3 * LANES + w], x[4 * LANES + w], x[5 * LANES + w] = (
            x[3 * LANES + w] + m0 * over,
            x[4 * LANES + w] + m1 * over,
            x[5 * LANES + w] + m2 * over,
        )


def tell_of_compiling() -> None:
    """Warn where nothing compiled is kept yet: the first step will take half a minute."""
    if run_substeps.signatures:
        return
    if not any(Path(run_substeps.stats.cache_path or ".").glob("kernels.run_substeps-*.nbi")):
        logging.getLogger("hairkit").warning(
            "compiling the simulator, once per machine (half a minute)"
        )


def padded(values: Float32Array, lanes: int = LANES) -> Float32Array:
    """Return values (S, ...) as blocks (B, ..., W); the last strand fills the last block."""
    count = len(values)
    blocks = -(-count // lanes)
    rows = np.minimum(np.arange(blocks * lanes), count - 1)
    spread = values[rows].reshape(blocks, lanes, *values.shape[1:])
    return np.ascontiguousarray(np.moveaxis(spread, 1, -1), np.float32)
