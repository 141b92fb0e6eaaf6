"""Contact in the kernels: nodes out of the obstacles with friction, then the lengths again."""

from __future__ import annotations

import numpy as np
from numba import njit

from .kernel_math import LANES, carry
from .kernel_solve import tridiagonal_solve

LENGTH, CLEAR, EASE = 0, 6, 7
ONE, ZERO, HALF, SOFTEST = np.float32(1), np.float32(0), np.float32(0.5), np.float32(1e-3)
FAR, FURTHER = np.float32(1.0), np.float32(1.05)
SLACK = 6


@njit(fastmath=True, error_model="numpy", cache=True)
def touch(x, node, ride, grid, settings, normals) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Bring nodes out of the obstacles; write normals where they touch, else 0.

    A node is looked up again only when it may have gone as far as it was away the last time.
    """
    h = settings[0]
    for j in range(1, x.shape[0]):
        xj, nj = x[j], normals[j]
        _worn_row(xj, ride[0], ride[1], ride[2], h)
        nj[:] = ZERO
        for w in range(LANES):
            if xj[SLACK, w] > ZERO:
                continue
            clear = node[j, CLEAR, w]
            distance, n0, n1, n2 = _distance(grid, xj[0, w], xj[1, w], xj[2, w], clear)
            xj[SLACK, w] = distance - clear
            if distance < clear:
                nj[0, w], nj[1, w], nj[2, w] = n0, n1, n2
                _out(xj, w, ride, clear - distance, n0, n1, n2, settings)


@njit(fastmath=True, error_model="numpy", cache=True)
def _worn_row(x, r0, r1, r2, h) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Take the way that nodes have gone over the head off their slack."""
    a, b, c, s = r0[0], r0[1], r0[2], r0[3]
    d, e, f, t = r1[0], r1[1], r1[2], r1[3]
    g, i, k, u = r2[0], r2[1], r2[2], r2[3]
    for w in range(LANES):
        p0, p1, p2 = x[0, w], x[1, w], x[2, w]
        w0 = h * x[3, w] - (p0 - (a * p0 + b * p1 + c * p2 + s))
        w1 = h * x[4, w] - (p1 - (d * p0 + e * p1 + f * p2 + t))
        w2 = h * x[5, w] - (p2 - (g * p0 + i * p1 + k * p2 + u))
        x[SLACK, w] -= FURTHER * np.sqrt(w0 * w0 + w1 * w1 + w2 * w2)


@njit(fastmath=True, error_model="numpy", cache=True)
def _out(xj, w, ride, depth, n0, n1, n2, settings) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Move one node out, with friction."""
    h, friction, fastest = settings[0], settings[2], settings[3]
    over = ONE / h
    p0, p1, p2 = xj[0, w], xj[1, w], xj[2, w]
    r0, r1, r2 = carry(ride, p0, p1, p2)
    u0 = xj[3, w] - (p0 - r0) * over
    u1 = xj[4, w] - (p1 - r1) * over
    u2 = xj[5, w] - (p2 - r2) * over
    across = u0 * n0 + u1 * n1 + u2 * n2
    inward = max(-across, ZERO)
    out = min(depth, (inward + fastest) * h)
    a0, a1, a2 = u0 - across * n0, u1 - across * n1, u2 - across * n2
    speed = np.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
    slowed = min(friction * inward, speed) / max(speed, np.float32(1e-12))
    xj[3, w] += inward * n0 - slowed * a0
    xj[4, w] += inward * n1 - slowed * a1
    xj[5, w] += inward * n2 - slowed * a2
    xj[0, w] = p0 + out * n0 - h * slowed * a0
    xj[1, w] = p1 + out * n1 - h * slowed * a1
    xj[2, w] = p2 + out * n2 - h * slowed * a2


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


@njit(fastmath=True, error_model="numpy", cache=True)
def relengthen(x, node, element, vector, line, over) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Restore the lengths; a touching node moves only along the obstacle."""
    n = x.shape[0]
    start, end, way, normals = vector[0], vector[1], vector[2], vector[3]
    diagonal, beside, pull = line[0], line[1], line[2]
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
    tridiagonal_solve(diagonal, beside, pull, n - 1)
    for j in range(n - 1):
        xa, xb, sj, tj, pj = x[j], x[j + 1], start[j], end[j], pull[j]
        for c in range(3):
            for w in range(LANES):
                xa[c, w] += pj[w] * sj[c, w]
                xa[3 + c, w] += pj[w] * sj[c, w] * over
            for w in range(LANES):
                xb[c, w] -= pj[w] * tj[c, w]
                xb[3 + c, w] -= pj[w] * tj[c, w] * over
