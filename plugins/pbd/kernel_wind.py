"""Gusts in the kernels: the float32 twin of `hairkit.simulation.wind.air_velocity`."""

from __future__ import annotations

import math

import numpy as np

from hairkit.parallel import compiled_with

from .simd import pick, whole
from .simd_math import ZERO, dot, load_three, minus, plus, row, store_three, times

PLACE = 0
ONE, HALF, QUARTER = np.float32(1), np.float32(0.5), np.float32(0.25)
APART = 4
"""Gusts are evaluated at every so many nodes and interpolated between."""
# cos(2 pi t) for |t| <= 1/4 in powers of t^2 (Taylor's series): off by less than 1e-7
_C = [np.float32((-1) ** k * (2 * np.pi) ** (2 * k) / math.factorial(2 * k)) for k in range(7)]
_C1, _C2, _C3, _C4, _C5, _C6 = _C[1:]


@compiled_with(fastmath=True)
def sample_gusts(first, last, x, waves, amplitudes, wind, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the velocity of the air at the nodes of some blocks, world.

    Parameters
    ----------
    x
        (B, n, STATE, W) nodes, head axes.
    waves
        (M, 4) of the gusts in the head axes, turns a metre, and their phases, turns.
    amplitudes, wind
        (M, 3) and (3,) metres per second, world.
    out
        (B, n, 3, W).
    """
    for block in range(first, last):
        _sample_block(x[block], waves, amplitudes, wind, out[block])


@row
def _sample_block(x, waves, amplitudes, wind, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Evaluate gusts at some nodes of a block and interpolate the others."""
    last = x.shape[0] - 1
    j = 0
    before = _gust(load_three(x, 0, PLACE), waves, amplitudes, wind)
    store_three(out, 0, 0, before)
    while j < last:
        next = min(j + APART, last)
        after = _gust(load_three(x, next, PLACE), waves, amplitudes, wind)
        change = times(ONE / np.float32(next - j), minus(after, before))
        for k in range(j + 1, next + 1):
            store_three(out, k, 0, plus(before, times(np.float32(k - j), change)))
        j, before = next, after


@row
def _gust(place, waves, amplitudes, wind):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the wind and the sum of the waves."""
    zero = ZERO * place[0]
    found = (zero + wind[0], zero + wind[1], zero + wind[2])
    for k in range(waves.shape[0]):
        turns = dot((waves[k, 0], waves[k, 1], waves[k, 2]), place) + waves[k, 3]
        size = _cosine(turns)
        found = plus(found, times(size, (amplitudes[k, 0], amplitudes[k, 1], amplitudes[k, 2])))
    return found


@row
def _cosine(turns):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the cosine of angles counted in turns."""
    turns = turns - whole(turns)
    turns = pick(turns, ZERO, ZERO - turns, turns)
    turns = pick(turns, HALF, turns, ONE - turns)
    sign = pick(turns, QUARTER, ONE, ZERO - ONE)
    turns = pick(turns, QUARTER, turns, HALF - turns)
    s = turns * turns
    return sign * (ONE + s * (_C1 + s * (_C2 + s * (_C3 + s * (_C4 + s * (_C5 + s * _C6))))))
