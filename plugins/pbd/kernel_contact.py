"""Contact in the kernels: penetration, Coulomb friction, then restoring the lengths."""

from __future__ import annotations

import numpy as np

from .simd import LANES, any_below, lane_root, load, load_number, pick, store, whole
from .simd_math import (
    absolute,
    dot,
    load_three,
    minus,
    plus,
    row,
    store_three,
    times,
    transform_rows,
    trilinear,
)

PLACE, SPEED, SLACK, GAIN, BESIDE = 0, 3, 6, 7, 10
SHIFT, TORSO, TORSO_SHIFT = 1, 6, 7
"""Of a substep's constants (`kernel_rows.constants_of`)."""
LENGTH, CLEAR, EASE = 0, 6, 7
START, END = 0, 3
GRIP, PRESS, PRESS_NEXT, LINES = 5, 6, 7, 8
"""Rows of `line`, and their number: the largest change of a node's velocity by friction, and how
far a segment's pull presses the nodes at its ends into the obstacle."""
ONE, HALF, ZERO, SOFTEST = np.float32(1), np.float32(0.5), np.float32(0), np.float32(1e-3)
FURTHER, ROOM = np.float32(1.05), np.float32(1.001)


@row
def resolve_contacts(  # type: ignore[no-untyped-def]
    x, node, constants, grids, settings, corners, normals, drifts, grips
):  # pragma: no cover - compiled
    """Push nodes out of the obstacles; write contact normals, else 0; return if there is any.

    `drifts` are how far an obstacle's surface has moved back in the substep, `grips` the largest
    changes of velocity by friction. The grids are read for a node only after it may have moved by
    its distance at the last lookup.
    """
    h, touching = settings[0], False
    with_torso = grids[1][0].shape[0] > 0
    for j in range(1, x.shape[0]):
        place, speed = load_three(x, j, PLACE), load_three(x, j, SPEED)
        way = times(h, minus(speed, times(HALF * h, load_three(x, j, GAIN))))
        drift, clear = transform_rows(constants[SHIFT], place), load(node, (j, CLEAR))
        normal = times(ZERO, place)
        slack = load(x, (j, SLACK)) - FURTHER * lane_root(_square(plus(way, drift)))
        if any_below(slack, ZERO):
            distance, normal = _distances(grids[0], place, slack, corners)
            slack = pick(slack, ZERO, distance - clear, slack)
        store(x, (j, SLACK), slack)
        store_three(normals, j, 0, normal)
        if with_torso:
            beside = transform_rows(constants[TORSO_SHIFT], place)
            slack = load(x, (j, BESIDE)) - FURTHER * lane_root(_square(plus(way, beside)))
            if any_below(slack, ZERO):
                distance, away = _torso(grids[1], constants[TORSO], place, slack, corners)
                slack = pick(slack, ZERO, distance - clear, slack)
                head = load(x, (j, SLACK))
                store_three(
                    normals, j, 0, _pick_three(slack, head, away, load_three(normals, j, 0))
                )
                drift = _pick_three(slack, head, beside, drift)
            store(x, (j, BESIDE), slack)
            slack = pick(slack, load(x, (j, SLACK)), slack, load(x, (j, SLACK)))
        store(grips, j, ZERO)
        if any_below(slack, ZERO):
            touching = True
            inside = pick(slack, ZERO, ONE + ZERO * slack, ZERO)
            normal = times(inside, load_three(normals, j, 0))
            store_three(normals, j, 0, normal)
            store_three(drifts, j, 0, drift)
            _out(x, j, drift, inside * (ZERO - slack), normal, settings, grips)
        else:
            store_three(normals, j, 0, (ZERO, ZERO, ZERO))
    return touching


@row
def _square(a):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the square of a vector's length."""
    return dot(a, a)


@row
def _torso(grid, pose, place, slack, corners):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return distances to the torso and their directions, head axes, as `_distances`."""
    distance, away = _distances(grid, transform_rows(pose, place), slack, corners)
    return distance, (
        pose[0][0] * away[0] + pose[1][0] * away[1] + pose[2][0] * away[2],
        pose[0][1] * away[0] + pose[1][1] * away[1] + pose[2][1] * away[2],
        pose[0][2] * away[0] + pose[1][2] * away[1] + pose[2][2] * away[2],
    )


@row
def _pick_three(a, b, below, otherwise):  # type: ignore[no-untyped-def] # pragma: no cover
    """Pick vectors as `pick` picks numbers."""
    return (
        pick(a, b, below[0], otherwise[0]),
        pick(a, b, below[1], otherwise[1]),
        pick(a, b, below[2], otherwise[2]),
    )


@row
def _distances(grid, place, slack, corners):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return trilinear distances and directions, undefined in lanes with slack."""
    values, frame = grid
    s0, s1, s2 = values.shape
    top = (np.float32(s0) - ROOM, np.float32(s1) - ROOM, np.float32(s2) - ROOM)
    raw = times(frame[3], minus(place, (frame[0], frame[1], frame[2])))
    u, v, w = (
        _clamp_lanes(raw[0], top[0]),
        _clamp_lanes(raw[1], top[1]),
        _clamp_lanes(raw[2], top[2]),
    )
    i, j, k = whole(u), whole(v), whole(w)
    store(corners, 8, i)
    store(corners, 9, j)
    store(corners, 10, k)
    store(corners, 11, slack)
    for lane in range(LANES):
        if corners[11, lane] < ZERO:
            _take_up(values, corners, lane)
    distance, slope = trilinear(_eight(corners), (u - i, v - j, w - k))
    beyond = absolute(u - raw[0]) + absolute(v - raw[1]) + absolute(w - raw[2])
    size = ONE / lane_root(dot(slope, slope) + np.float32(1e-24))
    return pick(ZERO, beyond, frame[4], distance), times(size, slope)


@row
def _eight(corners):  # type: ignore[no-untyped-def] # pragma: no cover
    """Load the values at the eight corners."""
    return (
        load(corners, 0), load(corners, 1), load(corners, 2), load(corners, 3),
        load(corners, 4), load(corners, 5), load(corners, 6), load(corners, 7),
    )  # fmt: skip


@row
def _clamp_lanes(u, top):  # type: ignore[no-untyped-def] # pragma: no cover
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
        corners[corner, lane] = load_number(values, first + further)


@row
def _out(x, j, drift, depth, normal, settings, grips) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Move nodes out by up to their depth, with friction; nothing happens where normals are 0."""
    h, friction, fastest = settings[0], settings[2], settings[3]
    place, speed = load_three(x, j, PLACE), load_three(x, j, SPEED)
    across = dot(plus(speed, times(ONE / h, drift)), normal)
    inward = pick(across, ZERO, ZERO - across, ZERO)
    most = h * (inward + fastest)
    out = pick(depth, most, depth, most)
    store(grips, j, friction * inward)
    store_three(x, j, SPEED, plus(speed, times(inward, normal)))
    store_three(x, j, PLACE, minus(place, times(ZERO - out, normal)))
    _brake(x, j, load_three(x, j, SPEED), drift, normal, h, grips)


@row
def _brake(x, j, speed, drift, normal, h, grips) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Slow a node along the obstacle by no more than its grip."""
    relative = plus(speed, times(ONE / h, drift))
    along = minus(relative, times(dot(relative, normal), normal))
    size = lane_root(dot(along, along)) + np.float32(1e-12)
    grip = load(grips, j)
    slowed = pick(ZERO, grip, grip, ZERO) / size
    slowed = pick(slowed, ONE, slowed, ONE)
    store(grips, j, grip - slowed * size)
    brake = times(slowed, along)
    store_three(x, j, SPEED, minus(speed, brake))
    store_three(x, j, PLACE, minus(load_three(x, j, PLACE), times(HALF * h, brake)))


@row
def apply_friction(x, settings, normals, drifts, grips) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Let nodes that touch rub once more, by what the strands' own tension adds to their grip."""
    for j in range(1, x.shape[0]):
        normal = load_three(normals, j, 0)
        if any_below(ZERO - dot(normal, normal), ZERO):
            # where nothing is touched the whole velocity is along, and grip is 0
            drift = load_three(drifts, j, 0)
            _brake(x, j, load_three(x, j, SPEED), drift, normal, settings[0], grips)


@row
def restore_lengths(x, node, element, segment, normals, line, settings) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Restore the lengths; a touching node moves only along the obstacle, and is pressed on it.

    One tridiagonal solve: elimination runs along with what it needs, row by row.
    """
    m = segment.shape[0]
    pivots, besides, pulls = line[0], line[1], line[2]
    presses, presses_next = line[PRESS], line[PRESS_NEXT]
    place, normal = load_three(x, 0, PLACE), load_three(normals, 1, 0)
    normal = times(ZERO, normal)
    ease, pivot, pull, end = load(node, (0, EASE)), ZERO * normal[0], ZERO * normal[0], normal
    for j in range(m):
        after, next_normal, next_ease = (
            load_three(x, j + 1, PLACE), load_three(normals, j + 1, 0), load(node, (j + 1, EASE)),
        )  # fmt: skip
        edge = minus(after, place)
        square = dot(edge, edge)
        size = ONE / lane_root(square)
        way = times(size, edge)
        beside = ZERO - dot(end, way)
        start = _mobility(ease, way, normal)
        end = _mobility(next_ease, way, next_normal)
        factor = beside * pivot
        pivot = ONE / (dot(way, plus(start, end)) + SOFTEST * (ease + next_ease) - factor * beside)
        pull = square * size - load(element, (j, LENGTH)) - factor * pull
        store_three(segment, j, START, start)
        store_three(segment, j, END, end)
        store(pivots, j, pivot)
        store(besides, j, beside)
        store(pulls, j, pull)
        store(presses, j, ease * dot(way, normal))
        store(presses_next, j, next_ease * dot(way, next_normal))
        place, normal, ease = after, next_normal, next_ease
    _shift_nodes(x, segment, line, settings)


@row
def _mobility(ease, way, normal):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the displacement of an end node by a unit pull of its segment."""
    return times(ease, minus(way, times(dot(way, normal), normal)))


@row
def _shift_nodes(x, segment, line, settings) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Back-substitute, and move the nodes by the pulls of their segments."""
    m, over = segment.shape[0], ONE / settings[0]
    pivots, besides, pulls, grips = line[0], line[1], line[2], line[GRIP]
    rough = settings[2] * over
    before = times(ZERO, load_three(segment, 0, START))
    coupled = pressed = before[0]
    for j in range(m - 1, -1, -1):
        pull = (load(pulls, j) - coupled) * load(pivots, j)
        move = minus(before, times(pull, load_three(segment, j, END)))
        store_three(x, j + 1, PLACE, plus(load_three(x, j + 1, PLACE), move))
        store_three(x, j + 1, SPEED, plus(load_three(x, j + 1, SPEED), times(over, move)))
        pressed = pull * load(line[PRESS_NEXT], j) - pressed
        store(grips, j + 1, load(grips, j + 1) + rough * pressed)
        pressed = pull * load(line[PRESS], j)
        before, coupled = times(pull, load_three(segment, j, START)), load(besides, j) * pull
