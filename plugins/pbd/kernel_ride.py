"""The guides' own points in the kernels: carried by the rods, kept out of the obstacles."""

from __future__ import annotations

import numpy as np
from numba import njit

from .kernel_lanes import LANES
from .kernel_math import carry, dot, minus, plus, rotate, row, rows_of, times

ONE, ZERO = np.float32(1), np.float32(0)
SLACK = 6


@njit(nogil=True, fastmath=True, error_model="numpy", cache=True)
def ride_points(  # type: ignore[no-untyped-def]
    first, last, x, q, clear, rod, segment, weight, offset, deepest, head, grid, out
) -> None:  # pragma: no cover - compiled
    """Write the guides' points from `first` to before `last` in the world (see `guides.Riders`).

    Parameters
    ----------
    x, q, clear
        (B, n, STATE, W) nodes, (B, n - 1, 4, W) frames, (B, n, W) least distances of the nodes.
    rod, segment, weight, offset
        (P,), (P,), (P, 6) of the four nodes around and of the two frames, (P, 3) in the frame.
    deepest
        (P,) least distance of each point, or (0,) where they may be anywhere.
    head
        (3, 4) from the head axes to the world.
    grid
        Obstacles as in `kernels.run_substeps`.
    out
        (P, 3).
    """
    motion = rows_of(head, 0)
    for i in range(first, last):
        block, lane = rod[i] // LANES, rod[i] % LANES
        nodes, j = x[block], segment[i]
        place = _on_curve(nodes, j, lane, weight[i])
        frame = _frame(q[block], j, lane, weight[i, 4], weight[i, 5])
        place = plus(place, rotate(frame, (offset[i, 0], offset[i, 1], offset[i, 2])))
        if deepest.shape[0] > 0:
            near = j if weight[i, 1] > weight[i, 2] else j + 1
            away = minus(place, (nodes[near, 0, lane], nodes[near, 1, lane], nodes[near, 2, lane]))
            room = nodes[near, SLACK, lane] + clear[block, near, lane] - deepest[i]
            # nothing is to be looked up where the node has been seen to be far away
            if not (room > ZERO and dot(away, away) < room * room):
                distance, n0, n1, n2 = distance_to(grid, place, deepest[i])
                place = plus(place, times(max(deepest[i] - distance, ZERO), (n0, n1, n2)))
        out[i, 0], out[i, 1], out[i, 2] = carry(motion, place)


@row
def _on_curve(x, j, lane, weight):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return a place on the smooth curve through the nodes (Catmull-Rom)."""
    a, d = max(j - 1, 0), min(j + 2, x.shape[0] - 1)
    wa, wb, wc, wd = weight[0], weight[1], weight[2], weight[3]
    return (
        wa * x[a, 0, lane] + wb * x[j, 0, lane] + wc * x[j + 1, 0, lane] + wd * x[d, 0, lane],
        wa * x[a, 1, lane] + wb * x[j, 1, lane] + wc * x[j + 1, 1, lane] + wd * x[d, 1, lane],
        wa * x[a, 2, lane] + wb * x[j, 2, lane] + wc * x[j + 1, 2, lane] + wd * x[d, 2, lane],
    )


@row
def _frame(q, j, lane, before, after):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the frame of segment j mixed with the ones beside it; one of the shares is 0."""
    k = max(j - 1, 0) if before > ZERO else min(j + 1, q.shape[0] - 1)
    part = before + after
    a0, a1, a2, a3 = q[j, 0, lane], q[j, 1, lane], q[j, 2, lane], q[j, 3, lane]
    b0, b1, b2, b3 = q[k, 0, lane], q[k, 1, lane], q[k, 2, lane], q[k, 3, lane]
    mix = part if a0 * b0 + a1 * b1 + a2 * b2 + a3 * b3 >= ZERO else -part
    here = ONE - part
    f0, f1, f2, f3 = (
        here * a0 + mix * b0,
        here * a1 + mix * b1,
        here * a2 + mix * b2,
        here * a3 + mix * b3,
    )
    size = ONE / np.sqrt(f0 * f0 + f1 * f1 + f2 * f2 + f3 * f3)
    return f0 * size, f1 * size, f2 * size, f3 * size


@row
def distance_to(grid, p, clear):  # type: ignore[no-untyped-def] # pragma: no cover
    """Trilinear distance and its direction; one look tells most places that they are far."""
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
        return clear + place[4], ZERO, ZERO, ZERO
    i, j, k = min(int(u), s0 - 2), min(int(v), s1 - 2), min(int(w), s2 - 2)
    # within a cell the distance changes by at most its diagonal
    least = values[i, j, k] - np.float32(1.8) / place[3]
    if least > clear:
        return least, ZERO, ZERO, ZERO
    a, b, c = u - np.float32(i), v - np.float32(j), w - np.float32(k)
    d, e, f = ONE - a, ONE - b, ONE - c
    v000, v001 = values[i, j, k], values[i, j, k + 1]
    v010, v011 = values[i, j + 1, k], values[i, j + 1, k + 1]
    v100, v101 = values[i + 1, j, k], values[i + 1, j, k + 1]
    v110, v111 = values[i + 1, j + 1, k], values[i + 1, j + 1, k + 1]
    l00, l01, l10, l11 = (
        v000 * f + v001 * c,
        v010 * f + v011 * c,
        v100 * f + v101 * c,
        v110 * f + v111 * c,
    )
    low, high = l00 * e + l01 * b, l10 * e + l11 * b
    g0 = high - low
    g1 = (l01 - l00) * d + (l11 - l10) * a
    g2 = ((v001 - v000) * e + (v011 - v010) * b) * d + ((v101 - v100) * e + (v111 - v110) * b) * a
    size = ONE / max(np.sqrt(g0 * g0 + g1 * g1 + g2 * g2), np.float32(1e-12))
    return low * d + high * a, g0 * size, g1 * size, g2 * size
