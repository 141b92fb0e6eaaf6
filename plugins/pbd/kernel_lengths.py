"""Kernels of the direct solves: the banded system, and the tensions that keep lengths."""

from __future__ import annotations

from typing import Any

import numpy as np

from .kernel_elastic import AHEAD
from .kernel_math import (
    ONE,
    ZERO,
    dot,
    inlined,
    larger,
    minus,
    one,
    plus,
    put,
    put_one,
    smaller,
    stage,
    three,
    times,
)
from .reference import FASTEST_CHANGE as CHANGE64
from .reference import FASTEST_TURN as TURN64
from .reference import TINY as TINY64
from .simd import load, root, store

LEAST = np.float32(1e-6)
"""Least pivot of the lengths, as a share of the metric's diagonal."""
CHANGE, TURN, TINY = np.float32(CHANGE64), np.float32(TURN64), np.float32(TINY64)


@stage
def solve_banded(x: Any, rod: Any) -> None:
    """Write `solved`, A^-1 `force` of the free nodes, by the factor L D L^T of two bands."""
    n = len(x)
    put(x[0].solved, (ZERO, ZERO, ZERO))
    before = beyond = three(x[0].solved)
    for j in range(1, n):
        known = plus(times(one(rod[j].first), before), times(one(rod[j].second), beyond))
        before, beyond = minus(three(x[j].force), known), before
        put(x[j].solved, before)
    before = beyond = three(x[0].solved)
    for j in range(n - 1, 0, -1):
        # the entries below row j stand in the two rows after it
        k, further = min(j + 1, n - 1), min(j + 2, n - 1)
        known = plus(times(one(rod[k].first), before), times(one(rod[further].second), beyond))
        here = minus(times(one(rod[j].pivot), three(x[j].solved)), known)
        before, beyond = here, before
        put(x[j].solved, here)


@stage
def keep_linear_lengths(x: Any, rod: Any, metric: Any, matrix: Any, iterations: int) -> None:
    """Write `free` and `solved`, what tensions take from it so that segments keep their lengths.

    Iterations linearise the lengths anew about the directions of the last solution.
    """
    for j in range(len(x)):
        put(x[j].free, three(x[j].solved))
    for turn in range(iterations):
        for j in range(1, len(x)):
            change = minus(three(x[j].free), three(x[j - 1].free))
            reach = dot(plus(three(x[j].edge), change), three(x[j].way))
            put_one(x[j].value, reach - one(rod[j].length))
        solve_lengths(x, metric, matrix)
        for j in range(1, len(x)):
            put(x[j].force, times(one(x[j].value), three(x[j].way)))
        for j in range(1, len(x) - 1):
            put(x[j].force, minus(three(x[j].force), three(x[j + 1].force)))
        solve_banded(x, rod)
        if turn + 1 < iterations:
            redirect(x)


@stage
def redirect(x: Any) -> None:
    """Update the directions from the solution."""
    for j in range(1, len(x)):
        start = minus(three(x[j - 1].free), three(x[j - 1].solved))
        end = minus(three(x[j].free), three(x[j].solved))
        edge = plus(three(x[j].edge), minus(end, start))
        put(x[j].way, times(ONE / root(dot(edge, edge)), edge))


@stage
def solve_lengths(x: Any, metric: Any, matrix: Any) -> None:
    """Solve metric * (d d^T) for `value`, in place, by elimination; `matrix` (n n) is work.

    Rows of its upper triangle are eliminated from those below; what stays is D L^T.
    """
    n, pair = len(x), 0
    for j in range(1, n):
        way = three(x[j].way)
        for i in range(1, j + 1):
            store(matrix, i * n + j, load(metric, pair) * dot(three(x[i].way), way))
            pair += 1
    for j in range(1, n, 2):  # two rows at a time share each load and store of those below
        _take_pivot(x, metric, matrix, j)
        p, a = one(x[j].pivot), one(x[j].value)
        if j + 1 == n:
            break
        share = p * load(matrix, j * n + j + 1)
        put_one(x[j + 1].value, one(x[j + 1].value) - share * a)
        for k in range(j + 1, n):
            left = load(matrix, j * n + n + k) - share * load(matrix, j * n + k)
            store(matrix, j * n + n + k, left)
        _take_pivot(x, metric, matrix, j + 1)
        q, b = one(x[j + 1].pivot), one(x[j + 1].value)
        for i in range(j + 2, n):
            s, t = p * load(matrix, j * n + i), q * load(matrix, j * n + n + i)
            put_one(x[i].value, one(x[i].value) - (s * a + t * b))
            for k in range(i, n):
                u, v = load(matrix, j * n + k), load(matrix, j * n + n + k)
                left = load(matrix, i * n + k) - (s * u + t * v)
                store(matrix, i * n + k, left)
    for j in range(n - 1, 0, -1):
        value = one(x[j].value)
        for i in range(j + 1, n):
            value = value - load(matrix, j * n + i) * one(x[i].value)
        put_one(x[j].value, one(x[j].pivot) * value)


@inlined
def _take_pivot(x: Any, metric: Any, matrix: Any, j: int) -> None:
    """Write 1 / D of row j."""
    least = LEAST * load(metric, (j - 1) * (j + 2) // 2)
    put_one(x[j].pivot, ONE / larger(load(matrix, j * len(x) + j), least))


@stage
def move_nodes(x: Any, h: Any) -> None:
    """Move nodes by the solution, which adds to their velocity and acceleration."""
    over = ONE / h
    for j in range(1, len(x)):
        move = minus(three(x[j].free), three(x[j].solved))
        added = times(over * AHEAD, move)
        put(x[j].place, plus(three(x[j].place), move))
        put(x[j].speed, plus(three(x[j].speed), added))
        gain = plus(three(x[j].gain), times(over, added))
        share = smaller(CHANGE / root(dot(gain, gain) + TINY), ONE)
        put(x[j].gain, times(share, gain))


@stage
def keep_lengths(x: Any, rod: Any, h: Any) -> None:
    """Give segments their exact lengths, from the root to the tip; bound how fast they turn."""
    over = ONE / h
    for j in range(1, len(x)):
        edge = minus(three(x[j].place), three(x[j - 1].place))
        length = one(rod[j].length)
        way = times(length / root(dot(edge, edge) + TINY) - ONE, edge)
        put(x[j].place, plus(three(x[j].place), way))
        before = three(x[j - 1].speed)
        apart = minus(plus(three(x[j].speed), times(over, way)), before)
        share = smaller(TURN * over * length / root(dot(apart, apart) + TINY), ONE)
        put(x[j].speed, plus(before, times(share, apart)))
