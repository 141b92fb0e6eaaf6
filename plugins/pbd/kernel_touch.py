"""Contact in the kernels: nodes out of the obstacles with friction, then the lengths again."""

from __future__ import annotations

import numpy as np
from numba import njit

from .kernel_math import carry
from .kernel_solve import tridiagonal_solve

LANES = 32
LENGTH, CLEAR, EASE = 0, 6, 7
ONE, ZERO, HALF, SOFTEST = np.float32(1), np.float32(0), np.float32(0.5), np.float32(1e-3)
FAR = np.float32(1.0)


@njit(fastmath=True, error_model="numpy", cache=True)
def touch(x, v, node, ride, grid, settings, normals) -> bool:  # type: ignore[no-untyped-def] # pragma: no cover
    """Bring nodes out of the obstacles; write normals where they touch, tell whether any does."""
    h, friction, fastest = settings[0], settings[2], settings[3]
    over = ONE / h
    normals[:] = ZERO
    any_touches = False
    for j in range(1, x.shape[0]):
        xj, vj = x[j], v[j]
        for w in range(LANES):
            clear = node[j, CLEAR, w]
            p0, p1, p2 = xj[0, w], xj[1, w], xj[2, w]
            distance, n0, n1, n2 = _distance(grid, p0, p1, p2, clear)
            depth = clear - distance
            if not depth > ZERO:
                continue
            any_touches = True
            normals[j, 0, w], normals[j, 1, w], normals[j, 2, w] = n0, n1, n2
            r0, r1, r2 = carry(ride, p0, p1, p2)
            u0 = vj[0, w] - (p0 - r0) * over
            u1 = vj[1, w] - (p1 - r1) * over
            u2 = vj[2, w] - (p2 - r2) * over
            across = u0 * n0 + u1 * n1 + u2 * n2
            inward = max(-across, ZERO)
            out = min(depth, (inward + fastest) * h)
            a0, a1, a2 = u0 - across * n0, u1 - across * n1, u2 - across * n2
            speed = np.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
            slowed = min(friction * inward, speed) / max(speed, np.float32(1e-12))
            vj[0, w] += inward * n0 - slowed * a0
            vj[1, w] += inward * n1 - slowed * a1
            vj[2, w] += inward * n2 - slowed * a2
            xj[0, w] = p0 + out * n0 - h * slowed * a0
            xj[1, w] = p1 + out * n1 - h * slowed * a1
            xj[2, w] = p2 + out * n2 - h * slowed * a2
    return any_touches


@njit(fastmath=True, error_model="numpy", cache=True)
def _distance(grid, p0, p1, p2, clear):  # type: ignore[no-untyped-def] # pragma: no cover
    """Trilinear distance and its direction; one look tells most nodes that they are far."""
    values, place = grid
    u, v, w = (p0 - place[0]) * place[3], (p1 - place[1]) * place[3], (p2 - place[2]) * place[3]
    s0, s1, s2 = values.shape
    if not (
        u >= ZERO
        and v >= ZERO
        and w >= ZERO
        and u <= np.float32(s0 - 1)
        and v <= np.float32(s1 - 1)
        and w <= np.float32(s2 - 1)
    ):
        return FAR, ZERO, ZERO, ZERO
    i, j, k = min(int(u), s0 - 2), min(int(v), s1 - 2), min(int(w), s2 - 2)
    # within a cell the distance changes by at most its diagonal
    if values[i, j, k] > clear + np.float32(1.8) / place[3]:
        return FAR, ZERO, ZERO, ZERO
    a, b, c = u - np.float32(i), v - np.float32(j), w - np.float32(k)
    d, e, f = ONE - a, ONE - b, ONE - c
    v000, v001 = values[i, j, k], values[i, j, k + 1]
    v010, v011 = values[i, j + 1, k], values[i, j + 1, k + 1]
    v100, v101 = values[i + 1, j, k], values[i + 1, j, k + 1]
    v110, v111 = values[i + 1, j + 1, k], values[i + 1, j + 1, k + 1]
    l00, l01, l10, l11 = v000 * f + v001 * c, v010 * f + v011 * c, v100 * f + v101 * c, v110 * f + v111 * c
    low, high = l00 * e + l01 * b, l10 * e + l11 * b
    g0 = high - low
    g1 = (l01 - l00) * d + (l11 - l10) * a
    g2 = ((v001 - v000) * e + (v011 - v010) * b) * d + ((v101 - v100) * e + (v111 - v110) * b) * a
    size = ONE / max(np.sqrt(g0 * g0 + g1 * g1 + g2 * g2), np.float32(1e-12))
    return low * d + high * a, g0 * size, g1 * size, g2 * size


@njit(fastmath=True, error_model="numpy", cache=True)
def relengthen(x, v, node, element, scratch, lines, over) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Restore the lengths; a touching node moves only along the obstacle."""
    n = x.shape[0]
    start, end, normals = scratch[0:n], scratch[n : 2 * n], scratch[6 * n : 7 * n]
    way = scratch[2 * n : 3 * n]
    diagonal, beside, pull = lines[0 : n - 1], lines[n : 2 * n - 1], lines[2 * n : 3 * n - 1]
    for j in range(n - 1):
        xa, xb, na, nb = x[j], x[j + 1], normals[j], normals[j + 1]
        ea, eb, el = node[j, EASE], node[j + 1, EASE], element[j]
        sj, tj, dj, dg, pj = start[j], end[j], way[j], diagonal[j], pull[j]
        for w in range(LANES):
            d0, d1, d2 = xb[0, w] - xa[0, w], xb[1, w] - xa[1, w], xb[2, w] - xa[2, w]
            reach = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
            size = ONE / reach
            d0, d1, d2 = d0 * size, d1 * size, d2 * size
            a = na[0, w] * d0 + na[1, w] * d1 + na[2, w] * d2
            b = nb[0, w] * d0 + nb[1, w] * d1 + nb[2, w] * d2
            sj[0, w] = ea[w] * (d0 - a * na[0, w])
            sj[1, w] = ea[w] * (d1 - a * na[1, w])
            sj[2, w] = ea[w] * (d2 - a * na[2, w])
            tj[0, w] = eb[w] * (d0 - b * nb[0, w])
            tj[1, w] = eb[w] * (d1 - b * nb[1, w])
            tj[2, w] = eb[w] * (d2 - b * nb[2, w])
            dj[0, w], dj[1, w], dj[2, w] = d0, d1, d2
            dg[w] = (
                d0 * (sj[0, w] + tj[0, w])
                + d1 * (sj[1, w] + tj[1, w])
                + d2 * (sj[2, w] + tj[2, w])
                + SOFTEST * (ea[w] + eb[w])
            )
            pj[w] = reach - el[LENGTH, w]
    for j in range(1, n - 1):
        tj, dj, bs = end[j - 1], way[j], beside[j]
        for w in range(LANES):
            bs[w] = -(tj[0, w] * dj[0, w] + tj[1, w] * dj[1, w] + tj[2, w] * dj[2, w])
    tridiagonal_solve(diagonal, beside, pull)
    for j in range(n - 1):
        xa, xb, va, vb = x[j], x[j + 1], v[j], v[j + 1]
        sj, tj, pj = start[j], end[j], pull[j]
        for c in range(3):
            for w in range(LANES):
                a, b = pj[w] * sj[c, w], pj[w] * tj[c, w]
                xa[c, w] += a
                va[c, w] += a * over
                xb[c, w] -= b
                vb[c, w] -= b * over
