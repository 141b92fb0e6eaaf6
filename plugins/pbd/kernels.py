"""The fast backend's kernels: the reference's substep, float32, strands side by side.

Strands stand in blocks of `LANES`; the last axis of every array is the strand in its block, so that
each line below works on `LANES` strands at once. Masses are shares of the strand's mean node mass,
so that stiffness is in 1/s^2 and float32 keeps its digits. All constants are float32: one float64
among them and the loops are no longer vector loops.
"""

# The three-letter names are the reference's: e edge, d direction, q frame, c natural turn.
from __future__ import annotations

import numpy as np
from numba import njit, prange

from hairkit.stored import Float32Array

from .kernel_math import carry, cross, dot, half_way_frame, rotate, swing_frame, twist_angle
from .kernel_solve import (
    banded_solve,
    excess_of,
    factorise_lengths,
    lengths_solve,
    pull_back,
    tridiagonal_solve,
)
from .kernel_touch import relengthen, touch

LANES = 32
LENGTH, OVER, BEND, TWIST, CURVE, NATURAL, FIRST, SECOND, PIVOT = 0, 1, 2, 3, 4, 7, 8, 9, 10
"""Columns of an element's constants: length, 1/length, stiffnesses, natural turn (3), natural
twist, and the banded factor's two lower entries and reciprocal pivot."""
ELEMENT = 11
REST, MASS, DRAG, SHAPE, CLEAR, EASE = 0, 3, 4, 5, 6, 7
"""Columns of a node's constants: rest place (3), mass, rates, clearance, 1/mass (root 0)."""
NODE = 8

ONE, HALF, QUARTER, ZERO = np.float32(1), np.float32(0.5), np.float32(0.25), np.float32(0)
SHARPEST, LARGEST_SPIN = np.float32(0.3), np.float32(0.3)


@njit(parallel=True, fastmath=True, error_model="numpy", cache=True)
def run_substeps(  # type: ignore[no-untyped-def]
    x, v, q, root, node, element, metric, rides, turns, gravity, air, force, grid, settings
) -> None:  # pragma: no cover - compiled
    """Advance all blocks by as many substeps as there are rides, in place.

    Parameters
    ----------
    x, v, q
        (B, n, 3, W), (B, n, 3, W), (B, n - 1, 4, W) state.
    root, node, element, metric
        (B, 4, W), (B, n, NODE, W), (B, n - 1, ELEMENT, W), (B, n (n - 1) / 2, W) constants.
    rides, turns
        (K, 3, 8): turn and shift of the head axes, and the turn's quaternion flattened behind;
        (K, 3, 3) from the world to the head axes after each substep.
    gravity, air, force
        (3,) world; (B, n, 3, W) world, or (1, 1, 3, 1) for all; (B, n, 3, W) per mass, or empty.
    grid
        Obstacles: values (X, Y, Z), and where they are (4,): origin and 1/spacing.
    settings
        (6,) step, damping, friction, depenetration speed, iterations, contacts.
    """
    for number in prange(x.shape[0]):
        block = np.int64(number)
        n = x.shape[1]
        scratch = np.zeros((8 * n, 3, LANES), np.float32)
        lines = np.zeros((8 * n, LANES), np.float32)
        lengths = np.zeros((metric.shape[1], LANES), np.float32)
        wind = air[min(block, air.shape[0] - 1)]
        extra = force[min(block, force.shape[0] - 1)]
        for k in range(rides.shape[0]):
            _substep(
                x[block], v[block], q[block], root[block], node[block], element[block],
                metric[block], rides[k], turns[k], gravity, wind, extra, grid, settings,
                scratch, lines, lengths,
            )  # fmt: skip


@njit(fastmath=True, error_model="numpy", cache=True)
def _substep(  # type: ignore[no-untyped-def]
    x, v, q, root, node, element, metric, ride, turn, gravity, air, extra, grid, settings,
    scratch, lines, lengths,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    n = x.shape[0]
    h, damping, iterations = settings[0], settings[1], int(settings[4])
    edge, direction = scratch[0:n], scratch[n : 2 * n]
    force, free = scratch[2 * n : 3 * n], scratch[3 * n : 4 * n]
    change, pull = scratch[4 * n : 5 * n], scratch[5 * n : 6 * n]
    _predict(x, v, node, ride, turn, gravity, air, extra, force, h, damping)
    _swing(x, q, ride, edge, direction)
    _untwist(q, direction, root, element, lines)
    _elastic(q, edge, direction, root, element, pull, force)
    banded_solve(element, force, free)
    for iteration in range(iterations):
        excess_of(edge, free, direction, element, lines[0:n])
        factorise_lengths(metric, direction, lengths, lines[n : 2 * n])
        lengths_solve(lengths, lines[n : 2 * n], lines[0:n])
        pull_back(lines[0:n], direction, force)
        banded_solve(element, force, change)
        last = iteration + 1 == iterations
        _applied(x, v, edge, free, change, direction, ONE / h, last)
    if settings[5] > ZERO and touch(x, v, node, ride, grid, settings, scratch[6 * n : 7 * n]):
        relengthen(x, v, node, element, scratch, lines, ONE / h)


@njit(fastmath=True, error_model="numpy", cache=True)
def _predict(  # type: ignore[no-untyped-def]
    x, v, node, ride, turn, gravity, air, extra, force, h, damping
) -> None:  # pragma: no cover - compiled
    """Carry the state into the new head axes, go on straight, and add up what acts on nodes."""
    over = ONE / h
    g0 = turn[0, 0] * gravity[0] + turn[0, 1] * gravity[1] + turn[0, 2] * gravity[2]
    g1 = turn[1, 0] * gravity[0] + turn[1, 1] * gravity[1] + turn[1, 2] * gravity[2]
    g2 = turn[2, 0] * gravity[0] + turn[2, 1] * gravity[1] + turn[2, 2] * gravity[2]
    uniform = air.shape[0] == 1
    pushed = extra.shape[0] == x.shape[0]
    for j in range(x.shape[0]):
        xj, vj, nj, fj = x[j], v[j], node[j], force[j]
        aj = air[0 if uniform else j]
        for w in range(LANES):
            p0, p1, p2 = carry(ride, xj[0, w], xj[1, w], xj[2, w])
            u0 = ride[0, 0] * vj[0, w] + ride[0, 1] * vj[1, w] + ride[0, 2] * vj[2, w]
            u1 = ride[1, 0] * vj[0, w] + ride[1, 1] * vj[1, w] + ride[1, 2] * vj[2, w]
            u2 = ride[2, 0] * vj[0, w] + ride[2, 1] * vj[1, w] + ride[2, 2] * vj[2, w]
            if j == 0:
                u0, u1, u2 = (nj[0, w] - p0) * over, (nj[1, w] - p1) * over, (nj[2, w] - p2) * over
            p0, p1, p2 = p0 + h * u0, p1 + h * u1, p2 + h * u2
            if j == 0:
                p0, p1, p2 = nj[0, w], nj[1, w], nj[2, w]
            r0, r1, r2 = carry(ride, p0, p1, p2)
            a = 0 if uniform else w
            w0, w1, w2 = aj[0, a], aj[1, a], aj[2, a]
            b0 = turn[0, 0] * w0 + turn[0, 1] * w1 + turn[0, 2] * w2
            b1 = turn[1, 0] * w0 + turn[1, 1] * w1 + turn[1, 2] * w2
            b2 = turn[2, 0] * w0 + turn[2, 1] * w1 + turn[2, 2] * w2
            m, drag, shape = nj[MASS, w], nj[DRAG, w], nj[SHAPE, w]
            fj[0, w] = m * (
                g0 + drag * (b0 - u0) + damping * ((p0 - r0) * over - u0) + shape * (nj[0, w] - p0)
            )
            fj[1, w] = m * (
                g1 + drag * (b1 - u1) + damping * ((p1 - r1) * over - u1) + shape * (nj[1, w] - p1)
            )
            fj[2, w] = m * (
                g2 + drag * (b2 - u2) + damping * ((p2 - r2) * over - u2) + shape * (nj[2, w] - p2)
            )
            xj[0, w], xj[1, w], xj[2, w] = p0, p1, p2
            vj[0, w], vj[1, w], vj[2, w] = u0, u1, u2
        if pushed:
            ej = extra[j]
            for c in range(3):
                for w in range(LANES):
                    fj[c, w] += ej[c, w]


@njit(fastmath=True, error_model="numpy", cache=True)
def _swing(x, q, ride, edge, direction) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Segments as predicted, and their frames transported on to them."""
    r0, r1, r2, r3 = ride[0, 4], ride[0, 5], ride[0, 6], ride[0, 7]
    for j in range(q.shape[0]):
        a, b, qj, ej, dj = x[j], x[j + 1], q[j], edge[j], direction[j]
        for w in range(LANES):
            e0, e1, e2 = b[0, w] - a[0, w], b[1, w] - a[1, w], b[2, w] - a[2, w]
            over = ONE / np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
            d0, d1, d2 = e0 * over, e1 * over, e2 * over
            s, t, u, o = qj[0, w], qj[1, w], qj[2, w], qj[3, w]
            q0 = r0 * s - r1 * t - r2 * u - r3 * o
            q1 = r0 * t + r1 * s + r2 * o - r3 * u
            q2 = r0 * u - r1 * o + r2 * s + r3 * t
            q3 = r0 * o + r1 * u - r2 * t + r3 * s
            q0, q1, q2, q3 = swing_frame(q0, q1, q2, q3, d0, d1, d2)
            ej[0, w], ej[1, w], ej[2, w] = e0, e1, e2
            dj[0, w], dj[1, w], dj[2, w] = d0, d1, d2
            qj[0, w], qj[1, w], qj[2, w], qj[3, w] = q0, q1, q2, q3


@njit(fastmath=True, error_model="numpy", cache=True)
def _untwist(q, direction, root, element, lines) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Spin frames about their segments until torques balance: one Newton step, tridiagonal."""
    m = q.shape[0]
    diagonal, beside, angle = lines[0:m], lines[m : 2 * m], lines[2 * m : 3 * m]
    diagonal[:] = ZERO
    angle[:] = ZERO
    for j in range(m):
        before = root if j == 0 else q[j - 1]
        qj, dj, el, i = q[j], direction[j], element[j], max(j - 1, 0)
        di = direction[i]
        dg, bs, an, dgi, ani = diagonal[j], beside[j], angle[j], diagonal[i], angle[i]
        first = ONE if j > 0 else ZERO
        for w in range(LANES):
            a = (before[0, w], before[1, w], before[2, w], before[3, w])
            b = (qj[0, w], qj[1, w], qj[2, w], qj[3, w])
            mid, quarter = half_way_frame(a, b)
            c = rotate(mid, el[CURVE, w], el[CURVE + 1, w], el[CURVE + 2, w])
            d = (dj[0, w], dj[1, w], dj[2, w])
            p = rotate(a, ZERO, ZERO, ONE)
            t = (d[0] - p[0], d[1] - p[1], d[2] - p[2])
            bend, twist = el[BEND, w], el[TWIST, w]
            g = cross(c, t)
            aside = cross(quarter, g)
            torque = twist * (twist_angle(a, b) - el[NATURAL, w])
            firm = QUARTER * bend * max(dot(c, t), ZERO)
            to_b = HALF * bend * (dot(d, g) + dot(d, aside))
            to_a = HALF * bend * (dot(p, g) - dot(p, aside))
            dg[w] += twist + firm
            an[w] += to_b - torque
            dgi[w] += first * (twist + firm)
            ani[w] += first * (to_a + torque)
            bs[w] = firm - twist
    tridiagonal_solve(diagonal, beside, angle)
    for j in range(m):
        qj, dj, an = q[j], direction[j], angle[j]
        for w in range(LANES):
            half = HALF * min(max(an[w], -LARGEST_SPIN), LARGEST_SPIN)
            over = ONE / np.sqrt(ONE + half * half)
            r1, r2, r3 = half * dj[0, w], half * dj[1, w], half * dj[2, w]
            s, t, u, o = qj[0, w] * over, qj[1, w] * over, qj[2, w] * over, qj[3, w] * over
            qj[0, w] = s - r1 * t - r2 * u - r3 * o
            qj[1, w] = t + r1 * s + r2 * o - r3 * u
            qj[2, w] = u - r1 * o + r2 * s + r3 * t
            qj[3, w] = o + r1 * u - r2 * t + r3 * s


@njit(fastmath=True, error_model="numpy", cache=True)
def _elastic(q, edge, direction, root, element, pull, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Bending and twist as forces on the nodes."""
    m = q.shape[0]
    pull[:] = ZERO
    for j in range(m):
        before = root if j == 0 else q[j - 1]
        i = max(j - 1, 0)
        qj, dj, ej, ei, el, eli = q[j], direction[j], edge[j], edge[i], element[j], element[i]
        pj, pi = pull[j], pull[i]
        inner = ONE if j > 0 else ZERO
        for w in range(LANES):
            a = (before[0, w], before[1, w], before[2, w], before[3, w])
            b = (qj[0, w], qj[1, w], qj[2, w], qj[3, w])
            mid, quarter = half_way_frame(a, b)
            c = rotate(mid, el[CURVE, w], el[CURVE + 1, w], el[CURVE + 2, w])
            d = (dj[0, w], dj[1, w], dj[2, w])
            p = rotate(a, ZERO, ZERO, ONE)
            o, oi = el[OVER, w], inner * eli[OVER, w]
            t0 = ej[0, w] * o - (ei[0, w] * oi + (ONE - inner) * p[0])
            t1 = ej[1, w] * o - (ei[1, w] * oi + (ONE - inner) * p[1])
            t2 = ej[2, w] * o - (ei[2, w] * oi + (ONE - inner) * p[2])
            bend = el[BEND, w]
            g = cross(c, (t0, t1, t2))
            aside = cross(quarter, g)
            torque = el[TWIST, w] * (twist_angle(a, b) - el[NATURAL, w])
            k = cross(p, d)
            s = torque / max(ONE + dot(p, d), SHARPEST)
            half = HALF * bend
            f = (half * (g[0] + aside[0]), half * (g[1] + aside[1]), half * (g[2] + aside[2]))
            e = (half * (g[0] - aside[0]), half * (g[1] - aside[1]), half * (g[2] - aside[2]))
            to_b = cross(f, d)
            to_a = cross(e, p)
            m0, m1, m2 = bend * (c[0] - t0), bend * (c[1] - t1), bend * (c[2] - t2)
            pj[0, w] += m0 - s * k[0] + to_b[0]
            pj[1, w] += m1 - s * k[1] + to_b[1]
            pj[2, w] += m2 - s * k[2] + to_b[2]
            pi[0, w] += inner * (to_a[0] - m0 - s * k[0])
            pi[1, w] += inner * (to_a[1] - m1 - s * k[1])
            pi[2, w] += inner * (to_a[2] - m2 - s * k[2])
    for j in range(m):
        pj, el, fa, fb = pull[j], element[j], force[j], force[j + 1]
        for c in range(3):
            for w in range(LANES):
                here = pj[c, w] * el[OVER, w]
                fa[c, w] -= here
                fb[c, w] += here


@njit(fastmath=True, error_model="numpy", cache=True)
def _applied(x, v, edge, free, change, direction, over, last) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Take the change on, or turn the directions to where it leads for another round."""
    n = x.shape[0]
    for j in range(1, n):
        xj, vj, fj, cj = x[j], v[j], free[j], change[j]
        if last:
            for c in range(3):
                for w in range(LANES):
                    moved = fj[c, w] - cj[c, w]
                    xj[c, w] += moved
                    vj[c, w] += moved * over
    if not last:
        for j in range(n - 1):
            ej, dj, fa, fb, ca, cb = (
                edge[j], direction[j], free[j], free[j + 1], change[j], change[j + 1],
            )  # fmt: skip
            for w in range(LANES):
                e0 = ej[0, w] + (fb[0, w] - cb[0, w]) - (fa[0, w] - ca[0, w])
                e1 = ej[1, w] + (fb[1, w] - cb[1, w]) - (fa[1, w] - ca[1, w])
                e2 = ej[2, w] + (fb[2, w] - cb[2, w]) - (fa[2, w] - ca[2, w])
                size = ONE / np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
                dj[0, w], dj[1, w], dj[2, w] = e0 * size, e1 * size, e2 * size


def padded(values: Float32Array, lanes: int = LANES) -> Float32Array:
    """Return values (S, ...) as blocks (B, ..., W); the last strand fills the last block."""
    count = len(values)
    blocks = -(-count // lanes)
    rows = np.minimum(np.arange(blocks * lanes), count - 1)
    spread = values[rows].reshape(blocks, lanes, *values.shape[1:])
    return np.ascontiguousarray(np.moveaxis(spread, 1, -1), np.float32)
