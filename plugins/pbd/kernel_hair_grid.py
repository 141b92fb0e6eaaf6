"""Hair among hair in the kernels: what `crowd.Crowd.rubbed` does, float32.

A value of the grid is four numbers: mass and momentum while nodes are spread to it, then how
crowded it is and the mean velocity.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .simd import LANES, at, part_of, pick, put, put_quad, quad_at, quad_of
from .simd_math import carry, minus, plus, put_three, row, rows_of, three, times

ZERO, ONE, FOUR, ROOM = np.float32(0), np.float32(1), np.float32(4), np.float32(1.001)
CELL = np.float32(1 / 0.02)
PLACE, SPEED = 0, 3


@njit(nogil=True, fastmath=True, error_model="numpy", cache=True)
def spread_nodes(  # type: ignore[no-untyped-def]
    first, last, x, mass, shift, origin, shape, seconds, cells
) -> None:  # pragma: no cover - compiled
    """Sum up masses and momenta relative to the head, in grids from `first` to before `last`.

    Parameters
    ----------
    x, mass
        (B, n, STATE, W) and (B, n, W); lanes that stand for no strand are without mass.
    shift
        (3, 4) motion of the head meanwhile, less the identity.
    origin, shape
        Place (3,) of the grid's first value, and how many there are along each axis.
    seconds
        How long the motion takes.
    cells
        (T, C, 4) grids to write; each takes its part of the blocks.
    """
    blocks, grids = x.shape[0], cells.shape[0]
    for grid in range(first, last):
        start, end = blocks * grid // grids, blocks * (grid + 1) // grids
        _spread(x[start:end], mass[start:end], shift, origin, shape, seconds, cells[grid])


@njit(nogil=True, fastmath=True, error_model="numpy", cache=True)
def settle_cells(first, last, cells, usual) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Turn masses into how crowded it is and momenta into velocities, in the first grid.

    `usual` (C,) is the mass that is not crowded; `first` to before `last` are values of the grid.
    """
    for k in range(first, last):
        value = quad_at(cells, (0, k))
        for part in range(1, cells.shape[0]):
            value = value + quad_at(cells, (part, k))
        filled = part_of(value, 0)
        if filled > ZERO:
            put_quad(cells, (0, k), value * (ONE / filled))
            cells[0, k, 0] = min(max((filled - usual[k]) / usual[k], ZERO), FOUR)


@njit(nogil=True, fastmath=True, error_model="numpy", cache=True)
def draw_nodes(first, last, x, shift, origin, shape, rates, cells) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Draw velocities to those around, and push out of crowded places, in place.

    `rates` (3,) are cohesion, pressure, seconds; `cells` (C, 4) the settled grid; `first` to before
    `last` are blocks; the rest is as in `spread_nodes`.
    """
    work = np.empty((3, LANES), np.float32)
    for block in range(first, last):
        for j in range(1, x.shape[1]):
            _draw(x[block], j, shift, origin, shape, rates, cells, work)


@njit(fastmath=True, error_model="numpy", cache=True)
def _spread(x, mass, shift, origin, shape, seconds, cells) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Sum up the masses and momenta of some blocks."""
    cells[:] = ZERO
    work = np.empty((7, LANES), np.float32)
    rows, over = rows_of(shift, 0), ONE / seconds
    for block in range(x.shape[0]):
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
