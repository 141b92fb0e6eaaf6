"""The fast backend's kernels: the reference's substep, float32, strands side by side.

Strands stand in blocks of `LANES`; the last axis of every array is the strand in its block, and a
row of it goes through registers as one (see `kernel_lanes`). A block does all substeps of a call
while it is in the cache. Masses are shares of the strand's mean node mass, so that stiffness is in
1/s^2.
"""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from numba import njit

from hairkit.arrays import Float32Array

from .kernel_contact import GRIP, LINES, brake_again, relengthen, touch
from .kernel_rows import bow, constants_of, predict, spin, swing, twist
from .kernel_solve import banded_solve, excess_of, lengths_solve, pull_back
from .simd import LANES, at, lane_root, put
from .simd_math import dot, four, minus, plus, put_three, row, three, times

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
EDGE, DIRECTION = 0, 3

ONE, ZERO = np.float32(1), np.float32(0)


@njit(nogil=True, fastmath=True, error_model="numpy", cache=True)
def run_substeps(  # type: ignore[no-untyped-def]
    first,
    last,
    x,
    q,
    root,
    node,
    element,
    metric,
    rides,
    turns,
    gravity,
    air,
    force,
    grid,
    settings,
) -> None:  # pragma: no cover - compiled
    """Advance blocks `first` to before `last` by as many substeps as there are rides, in place.

    Parameters
    ----------
    x, q
        (B, n, STATE, W) nodes and (B, n - 1, 4, W) frames.
    root, node, element, metric
        (B, 1, 7, W) frame and direction, (B, n, NODE, W), (B, n - 1, ELEMENT, W) and
        (B, n (n - 1) / 2, W) constants.
    rides, turns
        (K, 3, 12): the head axes' motion, the same less the identity, and the turn's quaternion in
        the first row; (K, 3, 4) from the world to the head axes after each substep.
    gravity, air, force
        (3,) world; (B, n, 3, W) world, or (1, 1, 3, W) for all; (B, n, 3, W) per mass, or
        (1, 1, 3, W) for none.
    grid
        Obstacles: values (X, Y, Z), and where they are (5,): origin, 1/spacing, and how far at
        least everything is outside.
    settings
        (7,) step, damping, friction, depenetration speed, iterations, contacts, rounds of friction.
    """
    n = x.shape[1]
    # work: segments (6), sums along the rod, forces, solutions and normals (3 each), factor, cells
    segment, line = np.empty((n - 1, 6, LANES), np.float32), np.empty((LINES, n, LANES), np.float32)
    vector = np.empty((4, n, 3, LANES), np.float32)
    factor = np.empty((metric.shape[1], LANES), np.float32)
    corners = np.zeros((12, LANES), np.float32)
    for block in range(first, last):
        wind, extra = air[min(block, air.shape[0] - 1)], force[min(block, force.shape[0] - 1)]
        for k in range(rides.shape[0]):
            _substep(
                x[block], q[block], root[block], node[block], element[block], metric[block],
                constants_of(rides[k], turns[k], gravity, settings), wind, extra, grid,
                settings, segment, vector, line, factor, corners,
            )  # fmt: skip


@row
def _substep(  # type: ignore[no-untyped-def]
    x, q, root, node, element, metric, constants, air, extra, grid, settings,
    segment, vector, line, factor, corners,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Do one substep of a block, in the reference's order."""
    n = x.shape[0]
    force, free, change, normals = vector[0], vector[1], vector[2], vector[3]
    for j in range(n):
        predict(x, node, air, constants, force, j)
    if extra.shape[0] == n:
        for j in range(n):
            put_three(force, j, 0, plus(three(force, j, 0), three(extra, j, 0)))
    for j in range(n - 1):
        swing(x, q, constants, segment, j)
    _untwist(q, root, segment, element, line)
    _elastic(q, root, segment, element, line, force)
    banded_solve(element, force, free)
    iterations = int(settings[4])
    for iteration in range(iterations):
        excess_of(segment, free, element, line[0])
        lengths_solve(metric, segment, factor, line[1], line[4], line[0])
        pull_back(line[0], segment, force)
        banded_solve(element, force, change)
        if iteration + 1 < iterations:
            _redirect(segment, free, change)
    over = constants[5][2]
    for j in range(1, n):
        move = minus(three(free, j, 0), three(change, j, 0))
        put_three(x, j, PLACE, plus(three(x, j, PLACE), move))
        put_three(x, j, SPEED, plus(three(x, j, SPEED), times(over, move)))
    if settings[5] > ZERO:
        touching = touch(x, node, constants, grid, settings, corners, normals, line[GRIP])
        relengthen(x, node, element, segment, normals, line, settings)
        # where nothing is touched, the second round finds the lengths as they should be
        for _ in range(int(settings[6] if touching else min(settings[6], ONE))):
            brake_again(x, constants, settings, normals, line[GRIP])
            relengthen(x, node, element, segment, normals, line, settings)


@row
def _untwist(q, root, segment, element, line) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Spin frames about their segments until torques balance: one Newton step, tridiagonal.

    Elimination runs along with the torques; a frame's row is whole once the next element is known.
    """
    m = segment.shape[0]
    before, away = four(root, 0), three(root, 0, 4)
    own = coupled = value = angle = ZERO * before[0]
    for j in range(m):
        after, here = four(q, j), three(segment, j, DIRECTION)
        torque, to_before, to_after, firm = twist(before, after, away, here, element, j)
        stiff = at(element, (j, TWIST))
        put(line, (3, j), torque)
        if j > 0:
            _eliminate(line, own + stiff + firm, coupled, value + to_before + torque, j - 1)
        own, coupled, value = stiff + firm, firm - stiff, to_after - torque
        before, away = after, here
    _eliminate(line, own, coupled, value, m - 1)
    spun = angle
    for j in range(m - 1, -1, -1):
        angle = (at(line, (1, j)) - coupled * angle) * at(line, (0, j))
        turn = spin(q, segment, angle, j)
        if j + 1 < m:
            _twist_more(line, element, spun - turn, j + 1)
        spun, coupled = turn, at(line, (2, j))
    _twist_more(line, element, spun, 0)


@row
def _twist_more(line, element, angle, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Spinning frames about their own segments adds to the twist between them, exactly."""
    put(line, (3, j), at(line, (3, j)) + angle * at(element, (j, TWIST)))


@row
def _eliminate(line, diagonal, beside, value, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write row j of a tridiagonal system as elimination leaves it: 1/pivot, value, beside."""
    if j > 0:
        factor = beside * at(line, (0, j - 1))
        diagonal = diagonal - factor * beside
        value = value - factor * at(line, (1, j - 1))
    put(line, (0, j), ONE / diagonal)
    put(line, (1, j), value)
    put(line, (2, j), beside)


@row
def _elastic(q, root, segment, element, line, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add bending and twist as forces on the nodes."""
    m = segment.shape[0]
    before, away = four(root, 0), three(root, 0, 4)
    reach, pull, over = away, times(ZERO, away), ZERO * away[0]
    for j in range(m):
        after, here = four(q, j), three(segment, j, DIRECTION)
        next_over = at(element, (j, OVER))
        next_reach = times(next_over, three(segment, j, EDGE))
        to_after, to_before = bow(
            before, after, away, here, minus(next_reach, reach), at(line, (3, j)), element, j
        )
        if j > 0:
            _act(force, times(over, plus(pull, to_before)), j - 1)
        before, away, reach, pull, over = after, here, next_reach, to_after, next_over
    _act(force, times(over, pull), m - 1)


@row
def _act(force, pull, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add what a segment's moments do to its two nodes."""
    put_three(force, j, 0, minus(three(force, j, 0), pull))
    put_three(force, j + 1, 0, plus(three(force, j + 1, 0), pull))


@row
def _redirect(segment, free, change) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Turn the directions to where the solution leads, for another round."""
    for j in range(segment.shape[0]):
        start = minus(three(free, j, 0), three(change, j, 0))
        end = minus(three(free, j + 1, 0), three(change, j + 1, 0))
        edge = plus(three(segment, j, EDGE), minus(end, start))
        size = ONE / lane_root(dot(edge, edge))
        put_three(segment, j, DIRECTION, times(size, edge))


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
