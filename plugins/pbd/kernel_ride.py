"""Kernels around the substeps: the guides' points in the world, and hair among hair."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from .kernel_math import LANES, carry, rotate, row

ONE, TWO, HALF, ZERO = np.float32(1), np.float32(2), np.float32(0.5), np.float32(0)
THREE, FOUR, CELL = np.float32(3), np.float32(4), np.float32(1 / 0.02)


@njit(parallel=True, fastmath=True, error_model="numpy", cache=True)
def ride_points(  # type: ignore[no-untyped-def]
    x, q, identity, rod, segment, share, offset, head, count
):  # pragma: no cover - compiled
    """Return (P, 3) the guides' points in the world (see `guides.Riders`)."""
    n = x.shape[1]
    if identity:
        out = np.empty((count * n, 3), np.float32)
        for number in prange(count):
            s = np.int64(number)
            block, lane = s // LANES, s % LANES
            for j in range(n):
                p = carry(head, x[block, j, 0, lane], x[block, j, 1, lane], x[block, j, 2, lane])
                out[s * n + j, 0], out[s * n + j, 1], out[s * n + j, 2] = p
        return out
    out = np.empty((len(rod), 3), np.float32)
    for number in prange(len(rod)):
        i = np.int64(number)
        block, lane = rod[i] // LANES, rod[i] % LANES
        j, t = segment[i], share[i]
        one, two = t * t * (THREE - TWO * t), t * (ONE - t)
        p0 = _along(x, block, 0, j, lane, n, t, one, two)
        p1 = _along(x, block, 1, j, lane, n, t, one, two)
        p2 = _along(x, block, 2, j, lane, n, t, one, two)
        k = min(max(j + (-1 if t < HALF else 1), 0), n - 2)
        part = abs(t - HALF)
        w = ZERO
        for c in range(4):
            w += q[block, j, c, lane] * q[block, k, c, lane]
        mix = part if w >= ZERO else -part
        f0 = (ONE - part) * q[block, j, 0, lane] + mix * q[block, k, 0, lane]
        f1 = (ONE - part) * q[block, j, 1, lane] + mix * q[block, k, 1, lane]
        f2 = (ONE - part) * q[block, j, 2, lane] + mix * q[block, k, 2, lane]
        f3 = (ONE - part) * q[block, j, 3, lane] + mix * q[block, k, 3, lane]
        size = ONE / np.sqrt(f0 * f0 + f1 * f1 + f2 * f2 + f3 * f3)
        frame = (f0 * size, f1 * size, f2 * size, f3 * size)
        turned = rotate(frame, offset[i, 0], offset[i, 1], offset[i, 2])
        p = carry(head, p0 + turned[0], p1 + turned[1], p2 + turned[2])
        out[i, 0], out[i, 1], out[i, 2] = p
    return out


@row
def _along(x, block, c, j, lane, n, t, one, two):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return one coordinate on the smooth curve through the nodes (Catmull-Rom)."""
    a, b = x[block, j, c, lane], x[block, j + 1, c, lane]
    sa = b - a if j == 0 else (b - x[block, j - 1, c, lane]) * HALF
    sb = b - a if j == n - 2 else (x[block, min(j + 2, n - 1), c, lane] - a) * HALF
    return a + (b - a) * one + two * ((ONE - t) * sa - t * sb)


@row
def _corner(p, origin, shape):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the cell and the shares within it of a place along one axis."""
    at = min(max((p - origin) * CELL, ZERO), np.float32(shape) - np.float32(1.001))
    low = int(at)
    return low, at - np.float32(low)


@njit(parallel=True, fastmath=True, error_model="numpy", cache=True)
def rub_nodes(  # type: ignore[no-untyped-def]
    x, mass, count, ride, origin, shape, usual, rates
) -> None:  # pragma: no cover - compiled
    """Draw velocities to those of the neighbours, and push out of crowded places, in place."""
    cohesion, pressure, seconds = rates[0], rates[1], rates[2]
    taken, over = ONE - np.exp(-cohesion * seconds), ONE / seconds
    n, s0, s1, s2 = x.shape[1], shape[0], shape[1], shape[2]
    cells = np.zeros((s0, s1, s2, 4), np.float32)
    for first in range(count):
        s = np.int64(first)
        block, lane = s // LANES, s % LANES
        for j in range(n):
            p0, p1, p2 = x[block, j, 0, lane], x[block, j, 1, lane], x[block, j, 2, lane]
            r0, r1, r2 = carry(ride, p0, p1, p2)
            m = mass[block, j, lane]
            u0 = m * (x[block, j, 3, lane] - (p0 - r0) * over)
            u1 = m * (x[block, j, 4, lane] - (p1 - r1) * over)
            u2 = m * (x[block, j, 5, lane] - (p2 - r2) * over)
            a, fa = _corner(p0, origin[0], s0)
            b, fb = _corner(p1, origin[1], s1)
            c, fc = _corner(p2, origin[2], s2)
            for i in range(8):
                k, y, o = i >> 2 & 1, i >> 1 & 1, i & 1
                weight = (fa if k else ONE - fa) * (fb if y else ONE - fb) * (fc if o else ONE - fc)
                cell = cells[a + k, b + y, c + o]
                cell[0] += weight * m
                cell[1] += weight * u0
                cell[2] += weight * u1
                cell[3] += weight * u2
    crowded, push = np.zeros((s0, s1, s2), np.float32), pressure * seconds
    for a in range(s0):
        for b in range(s1):
            for c in range(s2):
                cell, use = cells[a, b, c], usual[a, b, c]
                if cell[0] == ZERO:
                    continue
                crowded[a, b, c] = min(max((cell[0] - use) / use, ZERO), FOUR)
                scale = ONE / max(cell[0], np.float32(1e-30))
                cell[1] *= scale
                cell[2] *= scale
                cell[3] *= scale
    for number in prange(count):
        s = np.int64(number)
        block, lane = s // LANES, s % LANES
        for j in range(1, n):
            p0, p1, p2 = x[block, j, 0, lane], x[block, j, 1, lane], x[block, j, 2, lane]
            r0, r1, r2 = carry(ride, p0, p1, p2)
            h0, h1, h2 = (p0 - r0) * over, (p1 - r1) * over, (p2 - r2) * over
            u0, u1 = x[block, j, 3, lane] - h0, x[block, j, 4, lane] - h1
            u2 = x[block, j, 5, lane] - h2
            a, fa = _corner(p0, origin[0], s0)
            b, fb = _corner(p1, origin[1], s1)
            c, fc = _corner(p2, origin[2], s2)
            m0, m1, m2, g0, g1, g2 = ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
            for i in range(8):
                k, y, o = i >> 2 & 1, i >> 1 & 1, i & 1
                weight = (fa if k else ONE - fa) * (fb if y else ONE - fb) * (fc if o else ONE - fc)
                i0, i1, i2 = a + k, b + y, c + o
                cell = cells[i0, i1, i2]
                m0 += weight * cell[1]
                m1 += weight * cell[2]
                m2 += weight * cell[3]
                value = crowded[i0, i1, i2]
                wa, wb = fa if k else ONE - fa, fb if y else ONE - fb
                wc = fc if o else ONE - fc
                g0 += value * wb * wc * (ONE if k else -ONE)
                g1 += value * wa * wc * (ONE if y else -ONE)
                g2 += value * wa * wb * (ONE if o else -ONE)
            x[block, j, 3, lane] = h0 + u0 + taken * (m0 - u0) - push * g0
            x[block, j, 4, lane] = h1 + u1 + taken * (m1 - u1) - push * g1
            x[block, j, 5, lane] = h2 + u2 + taken * (m2 - u2) - push * g2
