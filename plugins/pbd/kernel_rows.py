"""The rows of a substep: what is done to one node or element of all strands of a block."""

from __future__ import annotations

import numpy as np

from .simd import at, lane_root, pick
from .simd_math import (
    carry,
    cross,
    dot,
    four,
    half_way,
    minus,
    plus,
    product,
    put_four,
    put_three,
    row,
    rows_of,
    swing_frame,
    three,
    times,
    turned,
    twist_angle,
)

PLACE, SPEED = 0, 3
REST, MASS, DRAG, SHAPE = 0, 3, 4, 5
OVER, BEND, TWIST, CURVE, NATURAL = 1, 2, 3, 4, 7
EDGE, DIRECTION = 0, 3
"""Rows of a segment: its vector and its direction."""
ONE, HALF, QUARTER, ZERO = np.float32(1), np.float32(0.5), np.float32(0.25), np.float32(0)
TWO, THIRD, FIFTH = np.float32(2), np.float32(1 / 3), np.float32(0.2)
SHARPEST, LARGEST_SPIN = np.float32(0.3), np.float32(0.3)


@row
def constants_of(ride, turn, gravity, settings):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the substep's scalars: motion, what it moves by, its turn, world to head, pull, step.

    See `kernels.run_substeps` for the arguments.
    """
    world = rows_of(turn, 0)
    return (
        rows_of(ride, 0),
        rows_of(ride, 4),
        (ride[0, 8], ride[0, 9], ride[0, 10], ride[0, 11]),
        world,
        turned(world, (gravity[0], gravity[1], gravity[2])),
        (settings[0], settings[1], ONE / settings[0]),
    )


@row
def predict(x, node, air, constants, force, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Carry a node into the new head axes, go on straight, and write what acts on it."""
    ride, shift, _, world, gravity, step = constants
    h, damping, over = step
    rest = three(node, j, REST)
    place, speed = carry(ride, three(x, j, PLACE)), turned(ride, three(x, j, SPEED))
    if j == 0:
        speed = times(over, minus(rest, place))
    place = plus(place, times(h, speed))
    put_three(x, j, PLACE, place)
    put_three(x, j, SPEED, speed)
    blown = minus(turned(world, three(air, min(j, air.shape[0] - 1), 0)), speed)
    # velocity of a point that rides on the head, against that of the node
    riding = plus(times(over, carry(shift, place)), speed)
    apart = minus(rest, place)
    mass, drag, shape = at(node, (j, MASS)), at(node, (j, DRAG)), at(node, (j, SHAPE))
    pull = plus(plus(times(drag, blown), times(shape, apart)), gravity)
    put_three(force, j, 0, times(mass, minus(pull, times(damping, riding))))


@row
def swing(x, q, constants, segment, j) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """A segment as predicted, and its frame transported on to it."""
    edge = minus(three(x, j + 1, PLACE), three(x, j, PLACE))
    direction = times(ONE / lane_root(dot(edge, edge)), edge)
    put_three(segment, j, EDGE, edge)
    put_three(segment, j, DIRECTION, direction)
    put_four(q, j, swing_frame(product(constants[2], four(q, j)), direction))


@row
def twist(before, after, away, here, element, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Torque of an element's twist, what its bending turns the frames at its ends with, firmness.

    `away` and `here` are the directions before and after it.
    """
    natural, quarter = half_way(before, after, three(element, j, CURVE))
    turn = minus(here, away)
    bend = HALF * at(element, (j, BEND))
    spun = cross(natural, turn)
    aside = cross(quarter, spun)
    curved = dot(natural, turn)
    torque = at(element, (j, TWIST)) * (twist_angle(before, after) - at(element, (j, NATURAL)))
    firm = HALF * bend * pick(curved, ZERO, ZERO, curved)
    return torque, bend * dot(away, minus(spun, aside)), bend * dot(here, plus(spun, aside)), firm


@row
def spin(q, segment, angle, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Spin a frame about its segment; return the angle (the series of the arc tangent)."""
    angle = pick(angle, LARGEST_SPIN, angle, LARGEST_SPIN)
    half = HALF * pick(angle, -LARGEST_SPIN, -LARGEST_SPIN, angle)
    cosine = ONE / lane_root(ONE + half * half)
    axis = times(half * cosine, three(segment, j, DIRECTION))
    put_four(q, j, product((cosine, axis[0], axis[1], axis[2]), four(q, j)))
    return TWO * half * (ONE - half * half * (THIRD - FIFTH * half * half))


@row
def bow(before, after, away, here, turn, torque, element, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Pull of an element on the direction after it and on the one before it.

    `away` and `here` are those directions, `turn` the difference of the segments' reaches,
    `torque` that of the twist.
    """
    natural, quarter = half_way(before, after, three(element, j, CURVE))
    bend = at(element, (j, BEND))
    spun = times(HALF * bend, cross(natural, turn))
    aside = cross(quarter, spun)
    cosine = ONE + dot(away, here)
    twisting = times(torque / pick(cosine, SHARPEST, SHARPEST, cosine), cross(away, here))
    moment = times(bend, minus(natural, turn))
    to_after = plus(minus(moment, twisting), cross(plus(spun, aside), here))
    to_before = minus(cross(minus(spun, aside), away), plus(moment, twisting))
    return to_after, to_before
