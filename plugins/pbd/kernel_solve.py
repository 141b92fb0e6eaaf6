"""Direct solvers of the kernels: banded, and dense for the lengths."""

from __future__ import annotations

import numpy as np

from .simd import lane_root, load, pick, store
from .simd_math import dot, load_three, minus, plus, row, store_three, times

LENGTH, FIRST, SECOND, PIVOT = 0, 8, 9, 10
EDGE, DIRECTION = 0, 3
PLACE, SPEED = 0, 3
ONE, ZERO, LEAST = np.float32(1), np.float32(0), np.float32(1e-6)
FASTEST_TURN, TINY = np.float32(1.0), np.float32(1e-20)


@row
def solve_banded(element, force, result) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write A^-1 force of the free nodes (rows 1 to n), by the factor L D L^T of two bands."""
    n = force.shape[0]
    a = b = times(ZERO, load_three(force, 0, 0))
    store_three(result, 0, 0, a)
    for j in range(1, n):
        one, two = load(element, (j - 1, FIRST)), load(element, (j - 1, SECOND))
        here = minus(load_three(force, j, 0), plus(times(one, a), times(two, b)))
        store_three(result, j, 0, here)
        a, b = here, a
    one = two = further = times(ZERO, a)[0]
    a = b = times(ZERO, a)
    for j in range(n - 1, 0, -1):
        # the entries below row j stand in the two rows after it
        here = times(load(element, (j - 1, PIVOT)), load_three(result, j, 0))
        here = minus(here, plus(times(one, a), times(two, b)))
        store_three(result, j, 0, here)
        a, b = here, a
        one, two = load(element, (j - 1, FIRST)), further
        further = load(element, (j - 1, SECOND))


@row
def excess_of(segment, change, element, excess) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the excess length of segments along their directions."""
    before = load_three(change, 0, 0)
    for j in range(segment.shape[0]):
        after = load_three(change, j + 1, 0)
        edge = plus(load_three(segment, j, EDGE), minus(after, before))
        store(excess, j, dot(edge, load_three(segment, j, DIRECTION)) - load(element, (j, LENGTH)))
        before = after


@row
def solve_lengths(metric, segment, factor, pivot, scaled, value) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Solve metric * (d d^T) for `value`, in place, by L D L^T row by row; `pivot` keeps 1/D.

    `metric` and `factor` hold lower rows packed; `scaled` (work) is the present row of L D.
    """
    m = segment.shape[0]
    for i in range(m):
        base, direction = i * (i + 1) // 2, load_three(segment, i, DIRECTION)
        floor, solved = load(metric, base + i), load(value, i)
        last = floor * dot(direction, direction)
        j = 0
        while j < i:
            if j + 1 < i:  # two columns at a time share each load of a scaled entry
                h, g = _two_entries(metric, segment, factor, scaled, direction, base, j)
                store(scaled, j + 1, g)
                entry = g * load(pivot, j + 1)
                store(factor, base + j + 1, entry)
                last = last - g * entry
                solved = solved - entry * load(value, j + 1)
            else:
                h = _entry(metric, segment, factor, scaled, direction, base, j)
            store(scaled, j, h)
            entry = h * load(pivot, j)
            store(factor, base + j, entry)
            last = last - h * entry
            solved = solved - entry * load(value, j)
            j += 2
        store(value, i, solved)
        floor = LEAST * floor
        store(pivot, i, ONE / pick(last, floor, floor, last))
    for i in range(m):
        store(value, i, load(value, i) * load(pivot, i))
    for k in range(m - 1, 0, -1):
        base, found = k * (k + 1) // 2, load(value, k)
        for i in range(k):
            store(value, i, load(value, i) - load(factor, base + i) * found)


@row
def _entry(metric, segment, factor, scaled, direction, base, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return one entry of the row of L D that starts at `base`."""
    h = load(metric, base + j) * dot(direction, load_three(segment, j, DIRECTION))
    other = j * (j + 1) // 2
    for k in range(j):
        h = h - load(scaled, k) * load(factor, other + k)
    return h


@row
def _two_entries(metric, segment, factor, scaled, direction, base, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return that entry and the next one."""
    h = load(metric, base + j) * dot(direction, load_three(segment, j, DIRECTION))
    g = load(metric, base + j + 1) * dot(direction, load_three(segment, j + 1, DIRECTION))
    other = j * (j + 1) // 2
    after = other + j + 1
    for k in range(j):
        known = load(scaled, k)
        h = h - known * load(factor, other + k)
        g = g - known * load(factor, after + k)
    return h, g - h * load(factor, after + j)


@row
def tension_to_force(tension, segment, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the node forces of tensions along the segments, except at the root."""
    m = segment.shape[0]
    before = times(load(tension, 0), load_three(segment, 0, DIRECTION))
    for j in range(1, m):
        after = times(load(tension, j), load_three(segment, j, DIRECTION))
        store_three(force, j, 0, minus(before, after))
        before = after
    store_three(force, m, 0, before)


@row
def keep_lengths(x, element, h) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Give segments their exact lengths, from the root to the tip; bound how fast they turn."""
    over = ONE / h
    place, speed = load_three(x, 0, PLACE), load_three(x, 0, SPEED)
    for j in range(x.shape[0] - 1):
        length, beyond = load(element, (j, LENGTH)), load_three(x, j + 1, PLACE)
        edge = minus(beyond, place)
        whole = times(length / lane_root(dot(edge, edge) + TINY), edge)
        place = plus(place, whole)
        way = times(over, minus(place, beyond))
        apart = minus(plus(load_three(x, j + 1, SPEED), way), speed)
        share = FASTEST_TURN * over * length / lane_root(dot(apart, apart) + TINY)
        speed = plus(speed, times(pick(share, ONE, share, ONE), apart))
        store_three(x, j + 1, PLACE, place)
        store_three(x, j + 1, SPEED, speed)
