"""Steps of a substep on one node or element of all strands of a block."""

from __future__ import annotations

import numpy as np

from . import linear_system as system
from . import reference
from .simd import lane_root, load, pick
from .simd_math import (
    cross,
    dot,
    half_way,
    load_four,
    load_three,
    minus,
    plus,
    product,
    rotate_rows,
    row,
    rows_of,
    store_four,
    store_three,
    swing_frame,
    times,
    transform_rows,
    twist_angle,
)

PLACE, SPEED, GAIN = 0, 3, 7
REST, MASS, DRAG, SHAPE = 0, 3, 4, 5
OVER, BEND, TWIST, CURVE, NATURAL = 1, 2, 3, 4, 7
EDGE, DIRECTION = 0, 3
"""Rows of a segment: its vector and its direction."""
ONE, HALF, QUARTER, ZERO = np.float32(1), np.float32(0.5), np.float32(0.25), np.float32(0)
TWO, THIRD, FIFTH = np.float32(2), np.float32(1 / 3), np.float32(0.2)
IMPLICIT, PASSED = np.float32(system.IMPLICIT), np.float32(1 - system.IMPLICIT)
DRIFT, TINY = np.float32(reference.DRIFT), np.float32(reference.TINY)
FASTEST_CHANGE = np.float32(reference.FASTEST_CHANGE)
SHARPEST, LARGEST_SPIN = np.float32(0.3), np.float32(0.3)


@row
def constants_of(head_step, turn, gravity, settings):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the substep's scalars: motion, displacement, rotation, world to head, gravity, step,
    head to torso, displacement of the torso.

    See `kernels.run_substeps` for the arguments.
    """
    world = rows_of(turn, 0)
    return (
        rows_of(head_step, 0),
        rows_of(head_step, 4),
        (head_step[0, 8], head_step[0, 9], head_step[0, 10], head_step[0, 11]),
        world,
        rotate_rows(world, (gravity[0], gravity[1], gravity[2])),
        (settings[0], settings[1], ONE / settings[0]),
        rows_of(head_step, 12),
        rows_of(head_step, 16),
    )


@row
def lead_root(x, node, constants):  # type: ignore[no-untyped-def] # pragma: no cover
    """Move the root with the head; return the force by which it holds the next node back.

    The inertia between them, a sixth of the segment's mass, is a third of the root's.
    """
    head_step, over = constants[0], constants[5][2]
    rest, place = load_three(node, 0, REST), transform_rows(head_step, load_three(x, 0, PLACE))
    speed = times(over, minus(rest, place))
    gain = times(over, minus(speed, rotate_rows(head_step, load_three(x, 0, SPEED))))
    jerk = minus(gain, times(PASSED, rotate_rows(head_step, load_three(x, 0, GAIN))))
    store_three(x, 0, PLACE, rest)
    store_three(x, 0, SPEED, speed)
    store_three(x, 0, GAIN, gain)
    return times(THIRD / IMPLICIT * load(node, (0, MASS)), jerk)


@row
def predict_node(x, node, air, constants, force, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Transform a node to the new head axes, extrapolate it, and write the force on it."""
    head_step, shift, _, world, gravity, step, _, _ = constants
    h, damping, over = step
    rest = load_three(node, j, REST)
    place, speed, gain = (
        transform_rows(head_step, load_three(x, j, PLACE)),
        rotate_rows(head_step, load_three(x, j, SPEED)),
        rotate_rows(head_step, load_three(x, j, GAIN)),
    )
    place = plus(place, times(h, plus(speed, times(DRIFT * h, gain))))
    gain = times(PASSED, gain)
    speed = plus(speed, times(h, gain))
    store_three(x, j, PLACE, place)
    store_three(x, j, SPEED, speed)
    store_three(x, j, GAIN, gain)
    blown = minus(rotate_rows(world, load_three(air, min(j, air.shape[0] - 1), 0)), speed)
    # velocity of a point that rides on the head, against that of the node
    head_velocity = plus(times(over, transform_rows(shift, place)), speed)
    apart = minus(rest, place)
    mass, drag, shape = load(node, (j, MASS)), load(node, (j, DRAG)), load(node, (j, SHAPE))
    pull = plus(plus(times(drag, blown), times(shape, apart)), gravity)
    store_three(force, j, 0, times(mass, minus(pull, times(damping, head_velocity))))


@row
def move_node(x, move, constants, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Move a node by the solution, which adds to its velocity and acceleration."""
    over = constants[5][2]
    added = times(over / IMPLICIT, move)
    store_three(x, j, PLACE, plus(load_three(x, j, PLACE), move))
    store_three(x, j, SPEED, plus(load_three(x, j, SPEED), added))
    gain = plus(load_three(x, j, GAIN), times(over, added))
    share = FASTEST_CHANGE / lane_root(dot(gain, gain) + TINY)
    store_three(x, j, GAIN, times(pick(share, ONE, share, ONE), gain))


@row
def transport_frame(x, q, constants, segment, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write a predicted segment, and transport its frame to the new direction."""
    edge = minus(load_three(x, j + 1, PLACE), load_three(x, j, PLACE))
    direction = times(ONE / lane_root(dot(edge, edge)), edge)
    store_three(segment, j, EDGE, edge)
    store_three(segment, j, DIRECTION, direction)
    store_four(q, j, swing_frame(product(constants[2], load_four(q, j)), direction))


@row
def twist_torque(before, after, away, here, element, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return an element's twist torque, its bending torques on both frames, and their stiffness.

    `away` and `here` are the directions before and after it.
    """
    natural, quarter = half_way(before, after, load_three(element, j, CURVE))
    turn = minus(here, away)
    bend = HALF * load(element, (j, BEND))
    spun = cross(natural, turn)
    aside = cross(quarter, spun)
    curved = dot(natural, turn)
    torque = load(element, (j, TWIST)) * (twist_angle(before, after) - load(element, (j, NATURAL)))
    firm = HALF * bend * pick(curved, ZERO, ZERO, curved)
    return torque, bend * dot(away, minus(spun, aside)), bend * dot(here, plus(spun, aside)), firm


@row
def spin_frame(q, segment, angle, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Rotate a frame about its segment; return the angle, by the series of the arc tangent."""
    angle = pick(angle, LARGEST_SPIN, angle, LARGEST_SPIN)
    half = HALF * pick(angle, -LARGEST_SPIN, -LARGEST_SPIN, angle)
    cosine = ONE / lane_root(ONE + half * half)
    axis = times(half * cosine, load_three(segment, j, DIRECTION))
    store_four(q, j, product((cosine, axis[0], axis[1], axis[2]), load_four(q, j)))
    return TWO * half * (ONE - half * half * (THIRD - FIFTH * half * half))


@row
def bending_force(before, after, away, here, turn, torque, element, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the generalised force of an element on the directions after and before it.

    `away` and `here` are those directions, `turn` the difference of the segments' reaches,
    `torque` that of the twist.
    """
    natural, quarter = half_way(before, after, load_three(element, j, CURVE))
    bend = load(element, (j, BEND))
    spun = times(HALF * bend, cross(natural, turn))
    aside = cross(quarter, spun)
    cosine = ONE + dot(away, here)
    twisting = times(torque / pick(cosine, SHARPEST, SHARPEST, cosine), cross(away, here))
    moment = times(bend, minus(natural, turn))
    to_after = plus(minus(moment, twisting), cross(plus(spun, aside), here))
    to_before = minus(cross(minus(spun, aside), away), plus(moment, twisting))
    return to_after, to_before
