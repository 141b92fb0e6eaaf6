"""Contact in the kernels: nodes out of the obstacles with friction, then the lengths again."""

from __future__ import annotations

import numpy as np

from .simd import LANES, any_below, at, lane_root, number_at, pick, put, whole
from .simd_math import absolute, carry, dot, minus, mixed, plus, put_three, row, three, times

PLACE, SPEED, SLACK = 0, 3, 6
LENGTH, CLEAR, EASE = 0, 6, 7
START, END = 0, 3
GRIP, PRESS, PRESS_NEXT, LINES = 5, 6, 7, 8
"""Rows of `line`, and how many: what friction may still change a node's velocity by, and how far a
segment's pull presses the nodes at its ends into what they touch."""
ONE, ZERO, SOFTEST = np.float32(1), np.float32(0), np.float32(1e-3)
FURTHER, ROOM = np.float32(1.05), np.float32(1.001)


@row
def touch(x, node, constants, grid, settings, corners, normals, grips):  # type: ignore[no-untyped-def] # pragma: no cover
    """Bring nodes out of the obstacles; write normals where they touch, else 0; return if any does.

    `grips` are what friction may still change their velocity by.
    A node is looked up again only when it may have gone as far as it was away the last time.
    """
    shift, h, touching = constants[1], settings[0], False
    for j in range(1, x.shape[0]):
        place, speed = three(x, j, PLACE), three(x, j, SPEED)
        way = plus(times(h, speed), carry(shift, place))
        slack = at(x, (j, SLACK)) - FURTHER * lane_root(dot(way, way))
        put(x, (j, SLACK), slack)
        put_three(normals, j, 0, (ZERO, ZERO, ZERO))
        put(grips, j, ZERO)
        if any_below(slack, ZERO):
            distance, normal = _distances(grid, place, slack, corners)
            clear = at(node, (j, CLEAR))
            put(x, (j, SLACK), pick(slack, ZERO, distance - clear, slack))
            depth = pick(slack, ZERO, clear - distance, ZERO)
            if any_below(ZERO - depth, ZERO):
                touching = True
                inside = pick(ZERO, depth, ONE + ZERO * depth, ZERO)
                normal = times(inside, normal)
                put_three(normals, j, 0, normal)
                _out(x, j, shift, inside * depth, normal, settings, grips)
    return touching


@row
def _distances(grid, place, slack, corners):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return trilinear distances and their directions, in lanes without slack; others are void."""
    values, frame = grid
    s0, s1, s2 = values.shape
    top = (np.float32(s0) - ROOM, np.float32(s1) - ROOM, np.float32(s2) - ROOM)
    raw = times(frame[3], minus(place, (frame[0], frame[1], frame[2])))
    u, v, w = _clipped(raw[0], top[0]), _clipped(raw[1], top[1]), _clipped(raw[2], top[2])
    i, j, k = whole(u), whole(v), whole(w)
    put(corners, 8, i)
    put(corners, 9, j)
    put(corners, 10, k)
    put(corners, 11, slack)
    for lane in range(LANES):
        if corners[11, lane] < ZERO:
            _take_up(values, corners, lane)
    distance, slope = mixed(_eight(corners), (u - i, v - j, w - k))
    beyond = absolute(u - raw[0]) + absolute(v - raw[1]) + absolute(w - raw[2])
    size = ONE / lane_root(dot(slope, slope) + np.float32(1e-24))
    return pick(ZERO, beyond, frame[4], distance), times(size, slope)


@row
def _eight(corners):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return what stands at the corners."""
    return (
        at(corners, 0), at(corners, 1), at(corners, 2), at(corners, 3),
        at(corners, 4), at(corners, 5), at(corners, 6), at(corners, 7),
    )  # fmt: skip


@row
def _clipped(u, top):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return a place between the first and the last value."""
    u = pick(u, ZERO, ZERO, u)
    return pick(u, top, u, top)


@row
def _take_up(values, corners, lane) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the values at the corners of the cell of one lane."""
    i, j, k = int(corners[8, lane]), int(corners[9, lane]), int(corners[10, lane])
    layer, line = values.shape[1] * values.shape[2], values.shape[2]
    first = i * layer + j * line + k
    for corner in range(8):
        further = (corner >> 2) * layer + (corner >> 1 & 1) * line + (corner & 1)
        corners[corner, lane] = number_at(values, first + further)


@row
def _out(x, j, shift, depth, normal, settings, grips) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Move nodes out by up to their depth, with friction; nothing happens where normals are 0."""
    h, friction, fastest = settings[0], settings[2], settings[3]
    place, speed = three(x, j, PLACE), three(x, j, SPEED)
    across = dot(plus(speed, times(ONE / h, carry(shift, place))), normal)
    inward = pick(across, ZERO, ZERO - across, ZERO)
    most = h * (inward + fastest)
    out = pick(depth, most, depth, most)
    put(grips, j, friction * inward)
    put_three(x, j, SPEED, plus(speed, times(inward, normal)))
    put_three(x, j, PLACE, minus(place, times(ZERO - out, normal)))
    _brake(x, j, three(x, j, SPEED), place, shift, normal, h, grips)


@row
def _brake(x, j, speed, place, shift, normal, h, grips) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Slow a node along the obstacle by no more than its grip; `place` says how the head goes."""
    relative = plus(speed, times(ONE / h, carry(shift, place)))
    along = minus(relative, times(dot(relative, normal), normal))
    size = lane_root(dot(along, along)) + np.float32(1e-12)
    grip = at(grips, j)
    slowed = pick(ZERO, grip, grip, ZERO) / size
    slowed = pick(slowed, ONE, slowed, ONE)
    put(grips, j, grip - slowed * size)
    brake = times(slowed, along)
    put_three(x, j, SPEED, minus(speed, brake))
    put_three(x, j, PLACE, minus(three(x, j, PLACE), times(h, brake)))


@row
def brake_again(x, constants, settings, normals, grips) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Let nodes that touch rub once more, by what the strands' own tension adds to their grip."""
    for j in range(1, x.shape[0]):
        normal = three(normals, j, 0)
        if any_below(ZERO - dot(normal, normal), ZERO):
            speed, place = three(x, j, SPEED), three(x, j, PLACE)
            # where nothing is touched the whole velocity is along, and grip is 0
            _brake(x, j, speed, place, constants[1], normal, settings[0], grips)


@row
def relengthen(x, node, element, segment, normals, line, settings) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Restore the lengths; a touching node moves only along the obstacle, and is pressed on it.

    One tridiagonal solve: elimination runs along with what it needs, row by row.
    """
    m = segment.shape[0]
    pivots, besides, pulls = line[0], line[1], line[2]
    presses, presses_next = line[PRESS], line[PRESS_NEXT]
    place, normal = three(x, 0, PLACE), three(normals, 1, 0)
    normal = times(ZERO, normal)
    ease, pivot, pull, end = at(node, (0, EASE)), ZERO * normal[0], ZERO * normal[0], normal
    for j in range(m):
        after, next_normal, next_ease = (
            three(x, j + 1, PLACE), three(normals, j + 1, 0), at(node, (j + 1, EASE)),
        )  # fmt: skip
        edge = minus(after, place)
        square = dot(edge, edge)
        size = ONE / lane_root(square)
        way = times(size, edge)
        beside = ZERO - dot(end, way)
        start = _eased(ease, way, normal)
        end = _eased(next_ease, way, next_normal)
        factor = beside * pivot
        pivot = ONE / (dot(way, plus(start, end)) + SOFTEST * (ease + next_ease) - factor * beside)
        pull = square * size - at(element, (j, LENGTH)) - factor * pull
        put_three(segment, j, START, start)
        put_three(segment, j, END, end)
        put(pivots, j, pivot)
        put(besides, j, beside)
        put(pulls, j, pull)
        put(presses, j, ease * dot(way, normal))
        put(presses_next, j, next_ease * dot(way, next_normal))
        place, normal, ease = after, next_normal, next_ease
    _shift_nodes(x, segment, line, settings)


@row
def _eased(ease, way, normal):  # type: ignore[no-untyped-def] # pragma: no cover
    """What a segment's pull does to a node at its end."""
    return times(ease, minus(way, times(dot(way, normal), normal)))


@row
def _shift_nodes(x, segment, line, settings) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Substitute backwards, and move the nodes by the pulls before and after them."""
    m, over = segment.shape[0], ONE / settings[0]
    pivots, besides, pulls, grips = line[0], line[1], line[2], line[GRIP]
    rough = settings[2] * over
    before = times(ZERO, three(segment, 0, START))
    coupled = pressed = before[0]
    for j in range(m - 1, -1, -1):
        pull = (at(pulls, j) - coupled) * at(pivots, j)
        move = minus(before, times(pull, three(segment, j, END)))
        put_three(x, j + 1, PLACE, plus(three(x, j + 1, PLACE), move))
        put_three(x, j + 1, SPEED, plus(three(x, j + 1, SPEED), times(over, move)))
        pressed = pull * at(line[PRESS_NEXT], j) - pressed
        put(grips, j + 1, at(grips, j + 1) + rough * pressed)
        pressed = pull * at(line[PRESS], j)
        before, coupled = times(pull, three(segment, j, START)), at(besides, j) * pull
