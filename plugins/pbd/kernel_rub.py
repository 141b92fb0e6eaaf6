"""Hair among hair in the kernels: what `crowd.Crowd.rubbed` does, float32.

A value of the grid is four numbers: mass and momentum while nodes are spread to it, then how
crowded it is and the mean velocity.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from .kernel_lanes import LANES, at, part_of, pick, put, put_quad, quad_at, quad_of
from .kernel_math import carry, minus, plus, put_three, row, rows_of, three, times

ZERO, ONE, FOUR, ROOM = np.float32(0), np.float32(1), np.float32(4), np.float32(1.001)
CELL = np.float32(1 / 0.02)
PLACE, SPEED = 0, 3
TOGETHER = 8
"""Blocks that one thread takes at a time."""


@njit(parallel=True, fastmath=True, error_model="numpy", cache=True)
def rub_nodes(x, mass, shift, origin, usual, rates, cells) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Draw velocities to those of the neighbours, and push out of crowded places, in place.

    Parameters
    ----------
    x, mass
        (B, n, STATE, W) and (B, n, W); lanes that stand for no strand are without mass.
    shift
        (3, 4) motion of the head meanwhile, less the identity.
    origin, usual
        (3,) place of the grid's first value; (X, Y, Z) mass that is not crowded.
    rates
        (3,) cohesion, pressure, seconds.
    cells
        (T, X, Y, Z, 4) work: T grids that nodes are spread to at the same time.
    """
    blocks, grids = x.shape[0], cells.shape[0]
    flat = cells.reshape(grids, usual.size, 4)
    for number in prange(grids):
        part = np.int64(number)
        first, last = blocks * part // grids, blocks * (part + 1) // grids
        _spread(x, mass, shift, origin, usual.shape, rates, flat[part], first, last)
    for number in prange(usual.shape[0]):
        _settle(flat, usual[np.int64(number)], np.int64(number))
    for number in prange((blocks + TOGETHER - 1) // TOGETHER):
        first = np.int64(number) * TOGETHER
        last = min(first + TOGETHER, blocks)
        work = np.empty((3, LANES), np.float32)
        for block in range(first, last):
            for j in range(1, x.shape[1]):
                _draw(x[block], j, shift, origin, usual.shape, rates, flat[0], work)


@njit(fastmath=True, error_model="numpy", cache=True)
def _spread(x, mass, shift, origin, shape, rates, cells, first, last) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Sum up the masses and momenta of some blocks, relative to the head."""
    cells[:] = ZERO
    work = np.empty((7, LANES), np.float32)
    rows, over = rows_of(shift, 0), ONE / rates[2]
    for block in range(first, last):
        for j in range(x.shape[1]):
            place, speed, m = (
                three(x[block], j, PLACE), three(x[block], j, SPEED), at(mass[block], j),
            )  # fmt: skip
            relative = plus(speed, times(over, carry(rows, place)))
            _put_cells(place, origin, shape, work)
            put(work, 3, m)
            put(work, 4, m * relative[0])
            put(work, 5, m * relative[1])
            put(work, 6, m * relative[2])
            for w in range(LANES):
                _spread_one(cells, shape, work, w)


@row
def _put_cells(place, origin, shape, work) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write places counted in cells, kept within the grid."""
    for c in range(3):
        put(work, c, _kept((place[c] - origin[c]) * CELL, np.float32(shape[c]) - ROOM))


@row
def _kept(u, top):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return lanes between 0 and the top."""
    u = pick(u, ZERO, ZERO, u)
    return pick(u, top, u, top)


@row
def _cell(shape, work, w):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the number of a lane's cell and the shares within it."""
    u, v, o = work[0, w], work[1, w], work[2, w]
    i, j, k = int(u), int(v), int(o)
    cell = (i * shape[1] + j) * shape[2] + k
    return cell, u - np.float32(i), v - np.float32(j), o - np.float32(k)


@row
def _spread_one(cells, shape, work, w) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add one node to the eight values around it."""
    cell, a, b, c = _cell(shape, work, w)
    value = quad_of(work[3, w], work[4, w], work[5, w], work[6, w])
    far = a * value
    near = value - far
    _spread_edge(cells, cell, shape[2], near, b, c)
    _spread_edge(cells, cell + shape[1] * shape[2], shape[2], far, b, c)


@row
def _spread_edge(cells, cell, stride, value, b, c) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add to the four values of a face."""
    far = b * value
    near = value - far
    high, low = c * far, c * near
    put_quad(cells, cell, quad_at(cells, cell) + (near - low))
    put_quad(cells, cell + 1, quad_at(cells, cell + 1) + low)
    cell += stride
    put_quad(cells, cell, quad_at(cells, cell) + (far - high))
    put_quad(cells, cell + 1, quad_at(cells, cell + 1) + high)


@row
def _settle(cells, usual, number) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Turn masses into how crowded it is, and momenta into velocities, in the first grid."""
    flat = usual.reshape(usual.size)
    first = number * usual.size
    for k in range(usual.size):
        value = quad_at(cells, (0, first + k))
        for part in range(1, cells.shape[0]):
            value = value + quad_at(cells, (part, first + k))
        filled = part_of(value, 0)
        if filled > ZERO:
            put_quad(cells, (0, first + k), value * (ONE / filled))
            crowded = (filled - flat[k]) / flat[k]
            cells[0, first + k, 0] = min(max(crowded, ZERO), FOUR)


@row
def _draw(x, j, shift, origin, shape, rates, cells, work) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Change the velocities of a row of nodes."""
    taken, push = ONE - np.exp(-rates[0] * rates[2]), rates[1] * rates[2]
    place, speed = three(x, j, PLACE), three(x, j, SPEED)
    riding = times(ONE / rates[2], carry(rows_of(shift, 0), place))
    _put_cells(place, origin, shape, work)
    # what is relative to the head goes on by its share, the rest is drawn to the mean
    put_three(x, j, SPEED, minus(times(ONE - taken, speed), times(taken, riding)))
    for w in range(LANES):
        _draw_one(x, j, shape, cells, work, taken, push, w)


@row
def _draw_one(x, j, shape, cells, work, taken, push, w) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add the mean velocity around one node, and the push against the slope of the crowd."""
    cell, a, b, c = _cell(shape, work, w)
    low, low_b, low_c = _face(cells, cell, shape[2], b, c)
    high, high_b, high_c = _face(cells, cell + shape[1] * shape[2], shape[2], b, c)
    slope = high - low
    mean = low + a * slope
    along, beside = low_b + a * (high_b - low_b), low_c + a * (high_c - low_c)
    x[j, SPEED, w] += taken * part_of(mean, 1) - push * part_of(slope, 0)
    x[j, SPEED + 1, w] += taken * part_of(mean, 2) - push * part_of(along, 0)
    x[j, SPEED + 2, w] += taken * part_of(mean, 3) - push * part_of(beside, 0)


@row
def _face(cells, cell, stride, b, c):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the mix of four values and its slopes along both edges."""
    v0, v2 = quad_at(cells, cell), quad_at(cells, cell + stride)
    d0, d2 = quad_at(cells, cell + 1) - v0, quad_at(cells, cell + stride + 1) - v2
    low = v0 + c * d0
    slope = v2 + c * d2 - low
    return low + b * slope, slope, d0 + b * (d2 - d0)
