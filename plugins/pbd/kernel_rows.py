"""The rows of a substep: what is done to one node or element of all strands of a block.

Arguments are flat: row r of lane w stands at r * LANES + w, a distance that the compiler knows, so
that it need not ask whether rows overlap.
"""

from __future__ import annotations

import numpy as np

from .kernel_math import LANES, cross, dot, half_way_frame, rotate, row, swing_frame, twist_angle

EDGE, DIRECTION, REACH = 0, 3, 6
"""Rows of a segment: its vector, its direction, its vector over its length."""
TORQUE, TO_BEFORE, TO_AFTER, FIRM = 0, 1, 2, 3
"""Rows of an element's twist."""
OVER, BEND, TWIST, CURVE, NATURAL = 1, 2, 3, 4, 7
MASS, DRAG, SHAPE = 3, 4, 5
ONE, HALF, QUARTER, ZERO = np.float32(1), np.float32(0.5), np.float32(0.25), np.float32(0)
SHARPEST, LARGEST_SPIN = np.float32(0.3), np.float32(0.3)


@row
def constants_of(ride, turn, gravity, settings):  # type: ignore[no-untyped-def] # pragma: no cover
    """Return the substep's scalars, so that loops keep them in registers."""
    g = (
        turn[0, 0] * gravity[0] + turn[0, 1] * gravity[1] + turn[0, 2] * gravity[2],
        turn[1, 0] * gravity[0] + turn[1, 1] * gravity[1] + turn[1, 2] * gravity[2],
        turn[2, 0] * gravity[0] + turn[2, 1] * gravity[1] + turn[2, 2] * gravity[2],
    )
    return (
        (ride[0, 0], ride[0, 1], ride[0, 2], ride[0, 3]),
        (ride[1, 0], ride[1, 1], ride[1, 2], ride[1, 3]),
        (ride[2, 0], ride[2, 1], ride[2, 2], ride[2, 3]),
        (ride[0, 4], ride[0, 5], ride[0, 6], ride[0, 7]),
        (turn[0, 0], turn[0, 1], turn[0, 2], g[0]),
        (turn[1, 0], turn[1, 1], turn[1, 2], g[1]),
        (turn[2, 0], turn[2, 1], turn[2, 2], g[2]),
        (settings[0], settings[1], ONE / settings[0], ZERO),
    )


@row
def predict_row(x, node, air, constants, force, is_root) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Carry a node into the new head axes, go on straight, and add up what acts on it."""
    r0, r1, r2, _, t0, t1, t2, step = constants
    h, damping, over = step[0], step[1], step[2]
    for w in range(LANES):
        x0, x1, x2, v0, v1, v2 = (
            x[w],
            x[LANES + w],
            x[2 * LANES + w],
            x[3 * LANES + w],
            x[4 * LANES + w],
            x[5 * LANES + w],
        )
        u0 = r0[0] * v0 + r0[1] * v1 + r0[2] * v2
        u1 = r1[0] * v0 + r1[1] * v1 + r1[2] * v2
        u2 = r2[0] * v0 + r2[1] * v1 + r2[2] * v2
        p0 = r0[0] * x0 + r0[1] * x1 + r0[2] * x2 + r0[3]
        p1 = r1[0] * x0 + r1[1] * x1 + r1[2] * x2 + r1[3]
        p2 = r2[0] * x0 + r2[1] * x1 + r2[2] * x2 + r2[3]
        u0 = (node[w] - p0) * over if is_root else u0
        u1 = (node[LANES + w] - p1) * over if is_root else u1
        u2 = (node[2 * LANES + w] - p2) * over if is_root else u2
        p0, p1, p2 = p0 + h * u0, p1 + h * u1, p2 + h * u2
        b0, b1, b2 = air[w], air[LANES + w], air[2 * LANES + w]
        a0 = t0[0] * b0 + t0[1] * b1 + t0[2] * b2 - u0
        a1 = t1[0] * b0 + t1[1] * b1 + t1[2] * b2 - u1
        a2 = t2[0] * b0 + t2[1] * b1 + t2[2] * b2 - u2
        # velocity of a point that rides on the head, against that of the node
        c0 = (p0 - (r0[0] * p0 + r0[1] * p1 + r0[2] * p2 + r0[3])) * over - u0
        c1 = (p1 - (r1[0] * p0 + r1[1] * p1 + r1[2] * p2 + r1[3])) * over - u1
        c2 = (p2 - (r2[0] * p0 + r2[1] * p1 + r2[2] * p2 + r2[3])) * over - u2
        m, drag, shape = node[MASS * LANES + w], node[DRAG * LANES + w], node[SHAPE * LANES + w]
        force[w] = m * (t0[3] + drag * a0 + damping * c0 + shape * (node[w] - p0))
        force[LANES + w] = m * (t1[3] + drag * a1 + damping * c1 + shape * (node[LANES + w] - p1))
        force[2 * LANES + w] = m * (
            t2[3] + drag * a2 + damping * c2 + shape * (node[2 * LANES + w] - p2)
        )
        (
            x[w],
            x[LANES + w],
            x[2 * LANES + w],
            x[3 * LANES + w],
            x[4 * LANES + w],
            x[5 * LANES + w],
        ) = p0, p1, p2, u0, u1, u2


@row
def swing_row(xa, xb, q, el, constants, segment) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """A segment as predicted, and its frame transported on to it."""
    r0, r1, r2, r3 = constants[3]
    for w in range(LANES):
        e0, e1, e2 = (
            xb[w] - xa[w],
            xb[LANES + w] - xa[LANES + w],
            xb[2 * LANES + w] - xa[2 * LANES + w],
        )
        over = ONE / np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        d0, d1, d2 = e0 * over, e1 * over, e2 * over
        s, t, u, o = q[w], q[LANES + w], q[2 * LANES + w], q[3 * LANES + w]
        q0 = r0 * s - r1 * t - r2 * u - r3 * o
        q1 = r0 * t + r1 * s + r2 * o - r3 * u
        q2 = r0 * u - r1 * o + r2 * s + r3 * t
        q3 = r0 * o + r1 * u - r2 * t + r3 * s
        q0, q1, q2, q3 = swing_frame(q0, q1, q2, q3, d0, d1, d2)
        span = el[OVER * LANES + w]
        segment[w], segment[LANES + w], segment[2 * LANES + w] = e0, e1, e2
        segment[3 * LANES + w], segment[4 * LANES + w], segment[5 * LANES + w] = d0, d1, d2
        segment[6 * LANES + w], segment[7 * LANES + w], segment[8 * LANES + w] = (
            e0 * span,
            e1 * span,
            e2 * span,
        )
        q[w], q[LANES + w], q[2 * LANES + w], q[3 * LANES + w] = q0, q1, q2, q3


@row
def twist_row(before, after, segment, el, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Torque of an element's twist, and what its bending turns the frames at its ends with."""
    for w in range(LANES):
        a = (before[w], before[LANES + w], before[2 * LANES + w], before[3 * LANES + w])
        b = (after[w], after[LANES + w], after[2 * LANES + w], after[3 * LANES + w])
        mid, quarter = half_way_frame(a, b)
        c = rotate(
            mid, el[CURVE * LANES + w], el[(CURVE + 1) * LANES + w], el[(CURVE + 2) * LANES + w]
        )
        d = (segment[3 * LANES + w], segment[4 * LANES + w], segment[5 * LANES + w])
        p = rotate(a, ZERO, ZERO, ONE)
        t = (d[0] - p[0], d[1] - p[1], d[2] - p[2])
        bend = el[BEND * LANES + w]
        g = cross(c, t)
        aside = cross(quarter, g)
        curved = dot(c, t)
        out[TORQUE * LANES + w] = el[TWIST * LANES + w] * (
            twist_angle(a, b) - el[NATURAL * LANES + w]
        )
        out[(TO_BEFORE) * LANES + w] = HALF * bend * (dot(p, g) - dot(p, aside))
        out[(TO_AFTER) * LANES + w] = HALF * bend * (dot(d, g) + dot(d, aside))
        out[FIRM * LANES + w] = QUARTER * bend * (curved if curved > ZERO else ZERO)


@row
def spin_row(q, segment, angle) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Spin a frame about its segment."""
    for w in range(LANES):
        turn = angle[w]
        turn = turn if turn < LARGEST_SPIN else LARGEST_SPIN
        half = HALF * (turn if turn > -LARGEST_SPIN else -LARGEST_SPIN)
        over = ONE / np.sqrt(ONE + half * half)
        r1, r2, r3 = (
            half * segment[3 * LANES + w],
            half * segment[4 * LANES + w],
            half * segment[5 * LANES + w],
        )
        s, t, u, o = (
            q[w] * over,
            q[LANES + w] * over,
            q[2 * LANES + w] * over,
            q[3 * LANES + w] * over,
        )
        q[w] = s - r1 * t - r2 * u - r3 * o
        q[LANES + w] = t + r1 * s + r2 * o - r3 * u
        q[2 * LANES + w] = u - r1 * o + r2 * s + r3 * t
        q[3 * LANES + w] = o + r1 * u - r2 * t + r3 * s


@row
def elastic_row(before, after, reach, segment, el, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Pull of an element on the direction after it (rows 0 to 2) and before it (3 to 5)."""
    for w in range(LANES):
        a = (before[w], before[LANES + w], before[2 * LANES + w], before[3 * LANES + w])
        b = (after[w], after[LANES + w], after[2 * LANES + w], after[3 * LANES + w])
        mid, quarter = half_way_frame(a, b)
        c = rotate(
            mid, el[CURVE * LANES + w], el[(CURVE + 1) * LANES + w], el[(CURVE + 2) * LANES + w]
        )
        d = (segment[3 * LANES + w], segment[4 * LANES + w], segment[5 * LANES + w])
        p = rotate(a, ZERO, ZERO, ONE)
        t0 = segment[6 * LANES + w] - reach[w]
        t1 = segment[7 * LANES + w] - reach[LANES + w]
        t2 = segment[8 * LANES + w] - reach[2 * LANES + w]
        bend = el[BEND * LANES + w]
        g = cross(c, (t0, t1, t2))
        aside = cross(quarter, g)
        torque = el[TWIST * LANES + w] * (twist_angle(a, b) - el[NATURAL * LANES + w])
        k = cross(p, d)
        cosine = ONE + dot(p, d)
        s = torque / (cosine if cosine > SHARPEST else SHARPEST)
        half = HALF * bend
        f = (half * (g[0] + aside[0]), half * (g[1] + aside[1]), half * (g[2] + aside[2]))
        e = (half * (g[0] - aside[0]), half * (g[1] - aside[1]), half * (g[2] - aside[2]))
        to_b = cross(f, d)
        to_a = cross(e, p)
        m0, m1, m2 = bend * (c[0] - t0), bend * (c[1] - t1), bend * (c[2] - t2)
        out[w] = m0 - s * k[0] + to_b[0]
        out[LANES + w] = m1 - s * k[1] + to_b[1]
        out[2 * LANES + w] = m2 - s * k[2] + to_b[2]
        out[3 * LANES + w] = to_a[0] - m0 - s * k[0]
        out[4 * LANES + w] = to_a[1] - m1 - s * k[1]
        out[5 * LANES + w] = to_a[2] - m2 - s * k[2]
