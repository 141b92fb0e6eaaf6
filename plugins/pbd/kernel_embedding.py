"""The guides' own points in the kernels: carried by the rods, then drawn out of the obstacles."""

from __future__ import annotations

import numpy as np

from hairkit.parallel import compiled_with
from hairkit.simulation.obstacle_kernels import draw_points

from .simd import LANES, load_number
from .simd_math import dot, plus, rotate, row, rows_of, times, transform_rows

ONE, ZERO = np.float32(1), np.float32(0)


@compiled_with(fastmath=True)
def embed_points(  # type: ignore[no-untyped-def]
    first, last, x, q, segment, weight, offset, drawn, fields, torso_from_head, head, out
) -> None:  # pragma: no cover - compiled
    """Write the embedded points of rods `first` to before `last`, world.

    Parameters
    ----------
    x, q
        (B, n, STATE, W) nodes, (B, n - 1, 4, W) frames.
    segment, weight, offset
        (P,), (P, 6) of the four nodes around and of the two frames, (P, 3) in the frame.
    drawn, fields, torso_from_head
        As `hairkit.simulation.obstacle_kernels.draw_points` takes them.
    head
        (3, 4) from the head axes to the world.
    out
        (P, 3).
    """
    motion = rows_of(head, 0)
    for rod in range(first, last):
        for i in range(drawn.starts[rod], drawn.starts[rod + 1]):
            out[i, 0], out[i, 1], out[i, 2] = _carried(x, q, rod, segment[i], weight, offset, i)
        draw_points(rod, rod + 1, drawn, fields, torso_from_head, out)
        for i in range(drawn.starts[rod], drawn.starts[rod + 1]):
            place = (out[i, 0], out[i, 1], out[i, 2])
            out[i, 0], out[i, 1], out[i, 2] = transform_rows(motion, place)


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
