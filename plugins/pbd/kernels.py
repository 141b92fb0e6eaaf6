"""The fast backend's kernels: the reference's substep, float32, strands side by side.

Strands are packed in blocks of `LANES`; the last axis of every array is the strand in its block, so
that a row is one SIMD register (see `simd`). A block does all substeps of a call while it is in the
cache. Masses are relative to the strand's mean node mass, so that stiffness is in 1/s^2.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.parallel import compiled_with

from .kernel_contact import GRIP, LINES, apply_friction, resolve_contacts, restore_lengths
from .kernel_rows import (
    bending_force,
    constants_of,
    lead_root,
    move_node,
    predict_node,
    spin_frame,
    transport_frame,
    twist_torque,
)
from .kernel_solve import excess_of, keep_lengths, solve_banded, solve_lengths, tension_to_force
from .simd import LANES, lane_root, load, store
from .simd_math import dot, load_four, load_three, minus, plus, row, store_three, times

LENGTH, OVER, BEND, TWIST, CURVE, NATURAL, FIRST, SECOND, PIVOT = 0, 1, 2, 3, 4, 7, 8, 9, 10
"""Rows of an element's constants: length, 1/length, stiffnesses, natural turn (3), natural twist,
and the banded factor's two lower entries and reciprocal pivot."""
ELEMENT = 11
REST, MASS, DRAG, SHAPE, CLEAR, EASE = 0, 3, 4, 5, 6, 7
"""Rows of a node's constants: rest place (3), mass, rates, clearance, 1/mass (root 0)."""
NODE = 8
PLACE, SPEED, SLACK, GAIN = 0, 3, 6, 7
"""Rows of a node's state: position (3), velocity (3), how far it may move before a lookup of the
head, the acceleration of the last substep before contact (3), and the same for the torso."""
STATE = 11
EDGE, DIRECTION = 0, 3

ONE, ZERO = np.float32(1), np.float32(0)


@compiled_with(fastmath=True)
def run_substeps(  # type: ignore[no-untyped-def]
    first,
    last,
    x,
    q,
    root,
    node,
    element,
    metric,
    head_steps,
    turns,
    gravity,
    air,
    force,
    grids,
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
        (K, 3, 20): the head axes' motion, the same less the identity, the turn's quaternion in the
        first row, the torso's place and its motion less the identity (see `TorsoStep`);
        (K, 3, 4) from the world to the head axes after each substep.
    gravity, air, force
        (3,) world; (B, n, 3, W) world, or (1, 1, 3, W) for all; (B, n, 3, W) per mass, or
        (1, 1, 3, W) for none.
    grids
        Of head and torso: values (X, Y, Z), empty for none, and where they are (5,): origin,
        1/spacing, and how far at least everything is outside.
    settings
        (7,) step, damping, friction, depenetration speed, iterations, contacts, rounds of friction.
    """
    n = x.shape[1]
    # work: segments (6), sums along the rod, vectors of nodes, factor, cells
    segment, line = np.empty((n - 1, 6, LANES), np.float32), np.empty((LINES, n, LANES), np.float32)
    vector = np.empty((5, n, 3, LANES), np.float32)
    factor = np.empty((metric.shape[1], LANES), np.float32)
    corners = np.zeros((12, LANES), np.float32)
    for block in range(first, last):
        wind, extra = air[min(block, air.shape[0] - 1)], force[min(block, force.shape[0] - 1)]
        for k in range(head_steps.shape[0]):
            _substep(
                x[block], q[block], root[block], node[block], element[block], metric[block],
                constants_of(head_steps[k], turns[k], gravity, settings), wind, extra, grids,
                settings, segment, vector, line, factor, corners,
            )  # fmt: skip


@row
def _substep(  # type: ignore[no-untyped-def]
    x, q, root, node, element, metric, constants, air, extra, grids, settings,
    segment, vector, line, factor, corners,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Do one substep of a block, in the reference's order."""
    n = x.shape[0]
    force, free, change, normals, drifts = vector[0], vector[1], vector[2], vector[3], vector[4]
    coupled = lead_root(x, node, constants)
    for j in range(1, n):
        predict_node(x, node, air, constants, force, j)
    store_three(force, 1, 0, minus(load_three(force, 1, 0), coupled))
    if extra.shape[0] == n:
        for j in range(n):
            store_three(force, j, 0, plus(load_three(force, j, 0), load_three(extra, j, 0)))
    for j in range(n - 1):
        transport_frame(x, q, constants, segment, j)
    _untwist(q, root, segment, element, line)
    _elastic(q, root, segment, element, line, force)
    solve_banded(element, force, free)
    iterations = int(settings[4])
    for iteration in range(iterations):
        excess_of(segment, free, element, line[0])
        solve_lengths(metric, segment, factor, line[1], line[4], line[0])
        tension_to_force(line[0], segment, force)
        solve_banded(element, force, change)
        if iteration + 1 < iterations:
            _redirect(segment, free, change)
    for j in range(1, n):
        move_node(x, minus(load_three(free, j, 0), load_three(change, j, 0)), constants, j)
    if settings[5] > ZERO:
        touching = resolve_contacts(
            x, node, constants, grids, settings, corners, normals, drifts, line[GRIP]
        )
        restore_lengths(x, node, element, segment, normals, line, settings)
        # without contact, one more iteration is enough
        for _ in range(int(settings[6] if touching else min(settings[6], ONE))):
            apply_friction(x, settings, normals, drifts, line[GRIP])
            restore_lengths(x, node, element, segment, normals, line, settings)
    keep_lengths(x, element, constants[5][0])


@row
def _untwist(q, root, segment, element, line) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Rotate frames about their segments until torques balance: one Newton step, tridiagonal.

    Elimination runs along with the torques; a frame's row is complete after the next element.
    """
    m = segment.shape[0]
    before, away = load_four(root, 0), load_three(root, 0, 4)
    own = coupled = value = angle = ZERO * before[0]
    for j in range(m):
        after, here = load_four(q, j), load_three(segment, j, DIRECTION)
        torque, to_before, to_after, firm = twist_torque(before, after, away, here, element, j)
        stiff = load(element, (j, TWIST))
        store(line, (3, j), torque)
        if j > 0:
            _eliminate(line, own + stiff + firm, coupled, value + to_before + torque, j - 1)
        own, coupled, value = stiff + firm, firm - stiff, to_after - torque
        before, away = after, here
    _eliminate(line, own, coupled, value, m - 1)
    spun = angle
    for j in range(m - 1, -1, -1):
        angle = (load(line, (1, j)) - coupled * angle) * load(line, (0, j))
        turn = spin_frame(q, segment, angle, j)
        if j + 1 < m:
            _twist_more(line, element, spun - turn, j + 1)
        spun, coupled = turn, load(line, (2, j))
    _twist_more(line, element, spun, 0)


@row
def _twist_more(line, element, angle, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Update the twist torque for frames rotated about their own segments, which is exact."""
    store(line, (3, j), load(line, (3, j)) + angle * load(element, (j, TWIST)))


@row
def _eliminate(line, diagonal, beside, value, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Eliminate row j of a tridiagonal system: write 1/pivot, value, off-diagonal."""
    if j > 0:
        factor = beside * load(line, (0, j - 1))
        diagonal = diagonal - factor * beside
        value = value - factor * load(line, (1, j - 1))
    store(line, (0, j), ONE / diagonal)
    store(line, (1, j), value)
    store(line, (2, j), beside)


@row
def _elastic(q, root, segment, element, line, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add the node forces of bending and twist."""
    m = segment.shape[0]
    before, away = load_four(root, 0), load_three(root, 0, 4)
    reach, pull, over = away, times(ZERO, away), ZERO * away[0]
    for j in range(m):
        after, here = load_four(q, j), load_three(segment, j, DIRECTION)
        next_over = load(element, (j, OVER))
        next_reach = times(next_over, load_three(segment, j, EDGE))
        to_after, to_before = bending_force(
            before, after, away, here, minus(next_reach, reach), load(line, (3, j)), element, j
        )
        if j > 0:
            _act(force, times(over, plus(pull, to_before)), j - 1)
        before, away, reach, pull, over = after, here, next_reach, to_after, next_over
    _act(force, times(over, pull), m - 1)


@row
def _act(force, pull, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add the forces of a segment's moments on its two nodes."""
    store_three(force, j, 0, minus(load_three(force, j, 0), pull))
    store_three(force, j + 1, 0, plus(load_three(force, j + 1, 0), pull))


@row
def _redirect(segment, free, change) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Update the directions from the solution, for another iteration."""
    for j in range(segment.shape[0]):
        start = minus(load_three(free, j, 0), load_three(change, j, 0))
        end = minus(load_three(free, j + 1, 0), load_three(change, j + 1, 0))
        edge = plus(load_three(segment, j, EDGE), minus(end, start))
        size = ONE / lane_root(dot(edge, edge))
        store_three(segment, j, DIRECTION, times(size, edge))


def pack_lanes(values: Float32Array, lanes: int = LANES) -> Float32Array:
    """Pack values (S, ...) into blocks (B, ..., W), padded with the last strand."""
    count = len(values)
    blocks = -(-count // lanes)
    rows = np.minimum(np.arange(blocks * lanes), count - 1)
    spread = values[rows].reshape(blocks, lanes, *values.shape[1:])
    return np.ascontiguousarray(np.moveaxis(spread, 1, -1), np.float32)
