"""Embedded guide points in the kernels: interpolated on the rods, kept out of the obstacles."""

from __future__ import annotations

import numpy as np

from hairkit.parallel import compiled_with

from .simd import LANES, load_number
from .simd_math import dot, minus, plus, rotate, row, rows_of, times, transform_rows, trilinear

ONE, ZERO = np.float32(1), np.float32(0)
SLACK = 6
CHASE, TINY = np.float32(0.3), np.float32(1e-20)


@compiled_with(fastmath=True)
def embed_points(  # type: ignore[no-untyped-def]
    first, last, x, q, clear, starts, segment, weight, offset, length, deepest, head, grid, out
) -> None:  # pragma: no cover - compiled
    """Write the embedded points of rods `first` to before `last`, world.

    Each follows the rod's curve at its own distance from the point before, out of the obstacles
    (see `drawn_points.draw_points`).

    Parameters
    ----------
    x, q, clear
        (B, n, STATE, W) nodes, (B, n - 1, 4, W) frames, (B, n, W) least distances of the nodes.
    starts, segment, weight, offset, length
        (S + 1,), (P,), (P, 6) of the four nodes around and of the two frames, (P, 3) in the frame,
        (P,) distance to the point before.
    deepest
        (P,) least distance of each point, or (0,) without such limits.
    head
        (3, 4) from the head axes to the world.
    grid
        Obstacles as in `kernels.run_substeps`.
    out
        (P, 3).
    """
    motion, n = rows_of(head, 0), x.shape[1]
    for rod in range(first, last):
        place = before = (ZERO, ZERO, ZERO)
        for i in range(starts[rod], starts[rod + 1]):
            curve = _carried(x, q, rod, segment[i], weight, offset, i)
            start, size = place, length[i]
            if i == starts[rod]:
                place = curve
            else:
                way = plus(minus(curve, before), times(CHASE, minus(before, start)))
                place = _along(start, way, size)
            before = curve
            if deepest.shape[0] > 0 and size > ZERO:
                near = segment[i] + (1 if weight[i, 1] <= weight[i, 2] else 0)
                if _may_touch(x, clear, rod // LANES * n + near, rod % LANES, place, deepest[i]):
                    for _ in range(2):
                        distance, normal = distance_to(grid, place, deepest[i])
                        depth = deepest[i] - distance
                        if depth > ZERO:
                            way = minus(plus(place, times(depth, normal)), start)
                            place = _along(start, way, size)
            out[i, 0], out[i, 1], out[i, 2] = transform_rows(motion, place)


@row
def _along(start, way, size):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return a place at a distance from `start` along `way`."""
    return plus(start, times(size / np.sqrt(dot(way, way) + TINY), way))


@row
def _may_touch(x, clear, node, lane, place, deepest):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return False where a point is near a node that is known to be far from the obstacles."""
    start = node * x.shape[2] * LANES + lane
    far = load_number(x, start + SLACK * LANES) + load_number(clear, node * LANES + lane)
    away, room = minus(place, _vector(x, start)), far - deepest
    return room <= ZERO or dot(away, away) >= room * room


@row
def _carried(x, q, rod, j, weight, offset, i):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return where a rod carries a point to."""
    n, wide, lane = x.shape[1], x.shape[2] * LANES, rod % LANES
    node, one = rod // LANES * n + j, np.int64(6 * i)
    start = node * wide + lane
    before, after = start - (wide if j > 0 else 0), start + wide
    beyond = after + (wide if j + 2 < n else 0)
    place = _on_curve(x, before, start, after, beyond, weight, one)
    frame = (node - rod // LANES) * 4 * LANES + lane  # there is one less than nodes
    other = (-1 if j > 0 else 0) if load_number(weight, one + 4) > ZERO else int(j + 2 < n)
    turn = _frame(q, frame, frame + other * 4 * LANES, weight, one)
    return plus(place, rotate(turn, (offset[i, 0], offset[i, 1], offset[i, 2])))


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
