"""Embedded guide points in the kernels: interpolated on the rods, kept out of the obstacles."""

from __future__ import annotations

import numpy as np
from numba import njit

from .simd import LANES, load_number
from .simd_math import dot, minus, plus, rotate, row, rows_of, times, transform_rows, trilinear

ONE, ZERO = np.float32(1), np.float32(0)
SLACK = 6


@njit(nogil=True, fastmath=True, error_model="numpy", cache=True)
def embed_points(  # type: ignore[no-untyped-def]
    first, last, x, q, clear, rod, segment, weight, offset, deepest, head, grid, out
) -> None:  # pragma: no cover - compiled
    """Write embedded points `first` to before `last`, world (see `resampling.Embedding`).

    Parameters
    ----------
    x, q, clear
        (B, n, STATE, W) nodes, (B, n - 1, 4, W) frames, (B, n, W) least distances of the nodes.
    rod, segment, weight, offset
        (P,), (P,), (P, 6) of the four nodes around and of the two frames, (P, 3) in the frame.
    deepest
        (P,) least distance of each point, or (0,) without such limits.
    head
        (3, 4) from the head axes to the world.
    grid
        Obstacles as in `kernels.run_substeps`.
    out
        (P, 3).
    """
    motion, n, wide = rows_of(head, 0), x.shape[1], x.shape[2] * LANES
    for i in range(first, last):
        j, lane = segment[i], rod[i] % LANES
        node, one = rod[i] // LANES * n + j, np.int64(6 * i)
        start = node * wide + lane
        before, after = start - (wide if j > 0 else 0), start + wide
        beyond = after + (wide if j + 2 < n else 0)
        place = _on_curve(x, before, start, after, beyond, weight, one)
        frame = (node - rod[i] // LANES) * 4 * LANES + lane  # there is one less than nodes
        other = (-1 if j > 0 else 0) if load_number(weight, one + 4) > ZERO else int(j + 2 < n)
        turn = _frame(q, frame, frame + other * 4 * LANES, weight, one)
        away = (offset[i, 0], offset[i, 1], offset[i, 2])
        place = plus(place, rotate(turn, away))
        if deepest.shape[0] > 0:
            later = load_number(weight, one + 1) <= load_number(weight, one + 2)
            near, number = (after, node + 1) if later else (start, node)
            far = load_number(x, near + SLACK * LANES) + load_number(clear, number * LANES + lane)
            place = _push_out(place, _vector(x, near), far, deepest[i], grid)
        out[i, 0], out[i, 1], out[i, 2] = transform_rows(motion, place)


@row
def _push_out(place, node, far, deepest, grid):  # type: ignore[no-untyped-def] # pragma: no cover
    """Push a point out of the obstacles if it is nearer than `deepest`.

    The grid is not read near a node that is known to be `far` away from the obstacles.
    """
    away, room = minus(place, node), far - deepest
    if room > ZERO and dot(away, away) < room * room:
        return place
    distance, normal = distance_to(grid, place, deepest)
    return plus(place, times(max(deepest - distance, ZERO), normal))


@row
def _vector(x, start):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return three numbers of a lane."""
    return load_number(x, start), load_number(x, start + LANES), load_number(x, start + 2 * LANES)


@row
def _on_curve(x, before, start, after, beyond, weight, one):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return a place on the smooth curve through the nodes (Catmull-Rom)."""
    a = times(load_number(weight, one), _vector(x, before))
    b = times(load_number(weight, one + 1), _vector(x, start))
    c = times(load_number(weight, one + 2), _vector(x, after))
    d = times(load_number(weight, one + 3), _vector(x, beyond))
    return plus(plus(a, b), plus(c, d))


@row
def _frame(q, start, other, weight, one):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return a segment's frame mixed with one beside it."""
    part = load_number(weight, one + 4) + load_number(weight, one + 5)
    a, b = _vector(q, start), _vector(q, other)
    a3, b3 = load_number(q, start + 3 * LANES), load_number(q, other + 3 * LANES)
    mix = part if dot(a, b) + a3 * b3 >= ZERO else -part
    f = plus(times(ONE - part, a), times(mix, b))
    f3 = (ONE - part) * a3 + mix * b3
    size = ONE / np.sqrt(dot(f, f) + f3 * f3)
    return f[0] * size, f[1] * size, f[2] * size, f3 * size


@row
def distance_to(grid, p, clear):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the trilinear distance and its direction; one lookup rejects most far points."""
    values, place = grid
    u, v, w = (
        (p[0] - place[0]) * place[3],
        (p[1] - place[1]) * place[3],
        (p[2] - place[2]) * place[3],
    )
    s0, s1, s2 = values.shape
    if not (
        u >= ZERO
        and v >= ZERO
        and w >= ZERO
        and u <= np.float32(s0 - 1)
        and v <= np.float32(s1 - 1)
        and w <= np.float32(s2 - 1)
    ):
        return clear + place[4], (ZERO, ZERO, ZERO)
    i, j, k = min(int(u), s0 - 2), min(int(v), s1 - 2), min(int(w), s2 - 2)
    # within a cell the distance changes by at most its diagonal
    first = (i * s1 + j) * s2 + k
    nearest = load_number(values, first)
    least = nearest - np.float32(1.8) / place[3]
    if least > clear:
        return least, (ZERO, ZERO, ZERO)
    line, layer = first + s2, first + s1 * s2
    corners = (
        nearest, load_number(values, first + 1),
        load_number(values, line), load_number(values, line + 1),
        load_number(values, layer), load_number(values, layer + 1),
        load_number(values, layer + s2), load_number(values, layer + s2 + 1),
    )  # fmt: skip
    distance, slope = trilinear(corners, (u - np.float32(i), v - np.float32(j), w - np.float32(k)))
    size = ONE / max(np.sqrt(dot(slope, slope)), np.float32(1e-12))
    return distance, times(size, slope)
