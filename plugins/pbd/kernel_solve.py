"""Direct solvers of the kernels: banded, tridiagonal, and the dense one of the lengths."""

from __future__ import annotations

import numpy as np

from .simd import at, pick, put
from .simd_math import dot, minus, plus, put_three, row, three, times

LENGTH, FIRST, SECOND, PIVOT = 0, 8, 9, 10
EDGE, DIRECTION = 0, 3
ONE, ZERO, LEAST = np.float32(1), np.float32(0), np.float32(1e-6)


@row
def banded_solve(element, force, result) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write A^-1 force of the free nodes (rows 1 to n), by the factor L D L^T of two bands."""
    n = force.shape[0]
    a = b = times(ZERO, three(force, 0, 0))
    put_three(result, 0, 0, a)
    for j in range(1, n):
        one, two = at(element, (j - 1, FIRST)), at(element, (j - 1, SECOND))
        here = minus(three(force, j, 0), plus(times(one, a), times(two, b)))
        put_three(result, j, 0, here)
        a, b = here, a
    one = two = further = times(ZERO, a)[0]
    a = b = times(ZERO, a)
    for j in range(n - 1, 0, -1):
        # the entries below row j stand in the two rows after it
        here = times(at(element, (j - 1, PIVOT)), three(result, j, 0))
        here = minus(here, plus(times(one, a), times(two, b)))
        put_three(result, j, 0, here)
        a, b = here, a
        one, two = at(element, (j - 1, FIRST)), further
        further = at(element, (j - 1, SECOND))


@row
def excess_of(segment, change, element, excess) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write by how much segments are too long along their directions."""
    before = three(change, 0, 0)
    for j in range(segment.shape[0]):
        after = three(change, j + 1, 0)
        edge = plus(three(segment, j, EDGE), minus(after, before))
        put(excess, j, dot(edge, three(segment, j, DIRECTION)) - at(element, (j, LENGTH)))
        before = after


@row
def lengths_solve(metric, segment, factor, pivot, scaled, value) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Solve metric * (d d^T) for `value`, in place, by L D L^T row by row; `pivot` keeps 1/D.

    `metric` and `factor` hold lower rows packed; `scaled` (work) is the present row of L D.
    """
    m = segment.shape[0]
    for i in range(m):
        base, direction = i * (i + 1) // 2, three(segment, i, DIRECTION)
        floor, solved = at(metric, base + i), at(value, i)
        last = floor * dot(direction, direction)
        j = 0
        while j < i:
            if j + 1 < i:  # columns go in pairs: each scaled entry is taken up once for both
                h, g = _two_entries(metric, segment, factor, scaled, direction, base, j)
                put(scaled, j + 1, g)
                entry = g * at(pivot, j + 1)
                put(factor, base + j + 1, entry)
                last = last - g * entry
                solved = solved - entry * at(value, j + 1)
            else:
                h = _entry(metric, segment, factor, scaled, direction, base, j)
            put(scaled, j, h)
            entry = h * at(pivot, j)
            put(factor, base + j, entry)
            last = last - h * entry
            solved = solved - entry * at(value, j)
            j += 2
        put(value, i, solved)
        floor = LEAST * floor
        put(pivot, i, ONE / pick(last, floor, floor, last))
    for i in range(m):
        put(value, i, at(value, i) * at(pivot, i))
    for k in range(m - 1, 0, -1):
        base, found = k * (k + 1) // 2, at(value, k)
        for i in range(k):
            put(value, i, at(value, i) - at(factor, base + i) * found)


@row
def _entry(metric, segment, factor, scaled, direction, base, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return one entry of the row of L D that starts at `base`."""
    h = at(metric, base + j) * dot(direction, three(segment, j, DIRECTION))
    other = j * (j + 1) // 2
    for k in range(j):
        h = h - at(scaled, k) * at(factor, other + k)
    return h


@row
def _two_entries(metric, segment, factor, scaled, direction, base, j):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return that entry and the one after it."""
    h = at(metric, base + j) * dot(direction, three(segment, j, DIRECTION))
    g = at(metric, base + j + 1) * dot(direction, three(segment, j + 1, DIRECTION))
    other = j * (j + 1) // 2
    after = other + j + 1
    for k in range(j):
        known = at(scaled, k)
        h = h - known * at(factor, other + k)
        g = g - known * at(factor, after + k)
    return h, g - h * at(factor, after + j)


@row
def pull_back(tension, segment, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the force on the nodes of tensions along the segments; the root's is not needed."""
    m = segment.shape[0]
    before = times(at(tension, 0), three(segment, 0, DIRECTION))
    for j in range(1, m):
        after = times(at(tension, j), three(segment, j, DIRECTION))
        put_three(force, j, 0, minus(before, after))
        before = after
    put_three(force, m, 0, before)
