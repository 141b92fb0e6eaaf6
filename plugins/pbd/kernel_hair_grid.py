"""Hair-hair interaction in the kernels: the float32 twin of `hair_grid.HairGrid.mix_velocities`.

A cell holds four numbers: mass and momentum during the splat, then crowding and mean velocity.
"""

from __future__ import annotations

import numpy as np

from hairkit.parallel import compiled_with

from .simd import LANES, load, load_quad, part_of, pick, quad_of, store, store_quad
from .simd_math import load_three, minus, plus, row, rows_of, store_three, times, transform_rows

ZERO, ONE, FOUR, ROOM = np.float32(0), np.float32(1), np.float32(4), np.float32(1.001)
CELL = np.float32(1 / 0.02)
PLACE, SPEED = 0, 3


@compiled_with(fastmath=True)
def spread_nodes(  # type: ignore[no-untyped-def]
    first, last, x, mass, shift, origin, shape, seconds, cells
) -> None:  # pragma: no cover - compiled
    """Splat masses and momenta relative to the head, into grids `first` to before `last`.

    Parameters
    ----------
    x, mass
        (B, n, STATE, W) and (B, n, W); padding lanes have mass 0.
    shift
        (3, 4) head motion of the step minus the identity.
    origin, shape
        Position (3,) of the first cell, and the number of cells along each axis.
    seconds
        Duration of the motion.
    cells
        (T, C, 4) grids to write; each gets its share of the blocks.
    """
    blocks, grids = x.shape[0], cells.shape[0]
    for grid in range(first, last):
        start, end = blocks * grid // grids, blocks * (grid + 1) // grids
        _spread(x[start:end], mass[start:end], shift, origin, shape, seconds, cells[grid])


@compiled_with(fastmath=True)
def settle_cells(first, last, cells, uncrowded_mass) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Convert masses to crowding and momenta to velocities, in the first grid.

    `uncrowded_mass` (C,) is the mass up to which a cell is not crowded; `first` to before `last`
    are cells.
    """
    for k in range(first, last):
        value = load_quad(cells, (0, k))
        for part in range(1, cells.shape[0]):
            value = value + load_quad(cells, (part, k))
        filled = part_of(value, 0)
        if filled > ZERO:
            store_quad(cells, (0, k), value * (ONE / filled))
            cells[0, k, 0] = min(max((filled - uncrowded_mass[k]) / uncrowded_mass[k], ZERO), FOUR)


@compiled_with(fastmath=True)
def draw_nodes(first, last, x, shift, origin, shape, rates, cells) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Relax velocities towards the mean around, and push nodes out of crowded cells, in place.

    `rates` (3,) are cohesion, pressure, seconds; `cells` (C, 4) the averaged grid; `first` to
    before `last` are blocks; the rest is as in `spread_nodes`.
    """
    work = np.empty((3, LANES), np.float32)
    for block in range(first, last):
        for j in range(1, x.shape[1]):
            _draw(x[block], j, shift, origin, shape, rates, cells, work)


@compiled_with(fastmath=True)
def _spread(x, mass, shift, origin, shape, seconds, cells) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Splat the masses and momenta of some blocks."""
    cells[:] = ZERO
    work = np.empty((7, LANES), np.float32)
    rows, over = rows_of(shift, 0), ONE / seconds
    for block in range(x.shape[0]):
        for j in range(x.shape[1]):
            place, speed, m = (
                load_three(x[block], j, PLACE), load_three(x[block], j, SPEED),
                load(mass[block], j),
            )  # fmt: skip
            relative = plus(speed, times(over, transform_rows(rows, place)))
            _put_cells(place, origin, shape, work)
            store(work, 3, m)
            store(work, 4, m * relative[0])
            store(work, 5, m * relative[1])
            store(work, 6, m * relative[2])
            for w in range(LANES):
                _spread_one(cells, shape, work, w)


@row
def _put_cells(place, origin, shape, work) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write positions in units of cells, clamped to the grid."""
    for c in range(3):
        store(work, c, _clamp_lanes((place[c] - origin[c]) * CELL, np.float32(shape[c]) - ROOM))


@row
def _clamp_lanes(u, top):  # type: ignore[no-untyped-def] # pragma: no cover
    """Clamp lanes to 0 and the top."""
    u = pick(u, ZERO, ZERO, u)
    return pick(u, top, u, top)


@row
def _cell(shape, work, w):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the index of a lane's cell and the fractions within it."""
    u, v, o = work[0, w], work[1, w], work[2, w]
    i, j, k = int(u), int(v), int(o)
    cell = (i * shape[1] + j) * shape[2] + k
    return cell, u - np.float32(i), v - np.float32(j), o - np.float32(k)


@row
def _spread_one(cells, shape, work, w) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Splat one node into the eight cells around it."""
    cell, a, b, c = _cell(shape, work, w)
    value = quad_of(work[3, w], work[4, w], work[5, w], work[6, w])
    far = a * value
    near = value - far
    _spread_edge(cells, cell, shape[2], near, b, c)
    _spread_edge(cells, cell + shape[1] * shape[2], shape[2], far, b, c)


@row
def _spread_edge(cells, cell, stride, value, b, c) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Splat into the four cells of a face."""
    far = b * value
    near = value - far
    high, low = c * far, c * near
    store_quad(cells, cell, load_quad(cells, cell) + (near - low))
    store_quad(cells, cell + 1, load_quad(cells, cell + 1) + low)
    cell += stride
    store_quad(cells, cell, load_quad(cells, cell) + (far - high))
    store_quad(cells, cell + 1, load_quad(cells, cell + 1) + high)


@row
def _draw(x, j, shift, origin, shape, rates, cells, work) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Change the velocities of a row of nodes."""
    taken, push = ONE - np.exp(-rates[0] * rates[2]), rates[1] * rates[2]
    place, speed = load_three(x, j, PLACE), load_three(x, j, SPEED)
    head_velocity = times(ONE / rates[2], transform_rows(rows_of(shift, 0), place))
    _put_cells(place, origin, shape, work)
    # velocity relative to the head: keep one share, take the other from the mean
    store_three(x, j, SPEED, minus(times(ONE - taken, speed), times(taken, head_velocity)))
    for w in range(LANES):
        _draw_one(x, j, shape, cells, work, taken, push, w)


@row
def _draw_one(x, j, shape, cells, work, taken, push, w) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Add the mean velocity around one node, and the push against the gradient of crowding."""
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
    """Return the bilinear value of four cells and its slopes along both edges."""
    v0, v2 = load_quad(cells, cell), load_quad(cells, cell + stride)
    d0, d2 = load_quad(cells, cell + 1) - v0, load_quad(cells, cell + stride + 1) - v2
    low = v0 + c * d0
    slope = v2 + c * d2 - low
    return low + b * slope, slope, d0 + b * (d2 - d0)
