"""Contact in the kernels: nodes out of the obstacles with friction, then the lengths again."""

from __future__ import annotations

import numpy as np

from .kernel_math import LANES, carry, row
from .kernel_solve import tridiagonal_solve

LENGTH, CLEAR, EASE = 0, 6, 7
ONE, ZERO, SOFTEST = np.float32(1), np.float32(0), np.float32(1e-3)
FURTHER = np.float32(1.05)
SLACK = 6


@row
def touch(x, node, ride, grid, settings, normals) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Bring nodes out of the obstacles; write normals where they touch, else 0.

    A node is looked up again only when it may have gone as far as it was away the last time.
    """
    n = x.shape[0]
    flat, flat_normals = x.reshape(n, x.shape[1] * LANES), normals.reshape(n, 3 * LANES)
    way = _shift_of(ride)
    flat_normals[:, :] = ZERO
    for j in range(1, n):
        if _worn_row(flat[j], way, settings[0]) == ZERO:
            continue
        xj, nj = x[j], normals[j]
        for w in range(LANES):
            if xj[SLACK, w] > ZERO:
                continue
            clear = node[j, CLEAR, w]
            distance, n0, n1, n2 = _distance(grid, xj[0, w], xj[1, w], xj[2, w], clear)
            xj[SLACK, w] = distance - clear
            if distance < clear:
                nj[0, w], nj[1, w], nj[2, w] = n0, n1, n2
                _out(xj, w, ride, clear - distance, n0, n1, n2, settings)


@row
def _shift_of(ride):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return a motion's rows as scalars, less the identity: what it moves a point by."""
    return (
        (ride[0, 0] - ONE, ride[0, 1], ride[0, 2], ride[0, 3]),
        (ride[1, 0], ride[1, 1] - ONE, ride[1, 2], ride[1, 3]),
        (ride[2, 0], ride[2, 1], ride[2, 2] - ONE, ride[2, 3]),
    )


@row
def _worn_row(x, ride, h):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """X"""
    r, s, t = ride
    near = ZERO
    for w in range(LANES):
        p0, p1, p2 = x[w], x[LANES + w], x[2 * LANES + w]
        w0 = h * x[3 * LANES + w] + r[0] * p0 + r[1] * p1 + r[2] * p2 + r[3]
        w1 = h * x[4 * LANES + w] + s[0] * p0 + s[1] * p1 + s[2] * p2 + s[3]
        w2 = h * x[5 * LANES + w] + t[0] * p0 + t[1] * p1 + t[2] * p2 + t[3]
        left = x[SLACK * LANES + w] - FURTHER * np.sqrt(w0 * w0 + w1 * w1 + w2 * w2)
        x[SLACK * LANES + w] = left
        near += ZERO if left > ZERO else ONE
    return near


@row
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


@row
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


@row
def relengthen(x, node, element, segment, normals, line, over) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Restore the lengths; a touching node moves only along the obstacle."""
    n = x.shape[0]
    nodes, flat = node.reshape(n, node.shape[1] * LANES), x.reshape(n, x.shape[1] * LANES)
    parts, ends = segment.reshape(n, 9 * LANES), normals.reshape(n, 3 * LANES)
    diagonal, beside, pull = line[0], line[1], line[2]
    for j in range(n - 1):
        _ease_row(flat[j], flat[j + 1], ends[j], ends[j + 1], nodes[j], nodes[j + 1], parts[j])
        _weight_row(nodes[j], nodes[j + 1], parts[j], diagonal[j])
        _excess_row(flat[j], flat[j + 1], parts[j], element[j, LENGTH], pull[j])
        if j > 0:
            _beside_row(parts[j - 1], parts[j], beside[j])
    tridiagonal_solve(diagonal, beside, pull, n - 1)
    pull[n - 1] = ZERO
    for j in range(1, n):
        _shift_row(pull[j - 1], parts[j - 1], pull[j], parts[min(j, n - 2)], over, flat[j])


@row
def _ease_row(xa, xb, na, nb, node_a, node_b, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """What a segment's pull does to its start (0 to 2) and its end (3 to 5); its direction."""
    for w in range(LANES):
        d0 = xb[w] - xa[w]
        d1 = xb[LANES + w] - xa[LANES + w]
        d2 = xb[2 * LANES + w] - xa[2 * LANES + w]
        size = ONE / np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        d0, d1, d2 = d0 * size, d1 * size, d2 * size
        a0, a1, a2 = na[w], na[LANES + w], na[2 * LANES + w]
        b0, b1, b2 = nb[w], nb[LANES + w], nb[2 * LANES + w]
        ea, eb = node_a[EASE * LANES + w], node_b[EASE * LANES + w]
        a, b = a0 * d0 + a1 * d1 + a2 * d2, b0 * d0 + b1 * d1 + b2 * d2
        out[w], out[LANES + w], out[2 * LANES + w] = (
            ea * (d0 - a * a0),
            ea * (d1 - a * a1),
            ea * (d2 - a * a2),
        )
        out[3 * LANES + w], out[4 * LANES + w], out[5 * LANES + w] = (
            eb * (d0 - b * b0),
            eb * (d1 - b * b1),
            eb * (d2 - b * b2),
        )
        out[6 * LANES + w], out[7 * LANES + w], out[8 * LANES + w] = d0, d1, d2


@row
def _weight_row(node_a, node_b, part, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """How far a unit pull shortens its own segment."""
    for w in range(LANES):
        d0, d1, d2 = part[6 * LANES + w], part[7 * LANES + w], part[8 * LANES + w]
        out[w] = (
            d0 * (part[w] + part[3 * LANES + w])
            + d1 * (part[LANES + w] + part[4 * LANES + w])
            + d2 * (part[2 * LANES + w] + part[5 * LANES + w])
            + SOFTEST * (node_a[EASE * LANES + w] + node_b[EASE * LANES + w])
        )


@row
def _excess_row(xa, xb, part, length, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """By how much a segment is too long."""
    for w in range(LANES):
        out[w] = (
            part[6 * LANES + w] * (xb[w] - xa[w])
            + part[7 * LANES + w] * (xb[LANES + w] - xa[LANES + w])
            + part[8 * LANES + w] * (xb[2 * LANES + w] - xa[2 * LANES + w])
            - length[w]
        )


@row
def _beside_row(before, here, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """How far a unit pull of the segment before shortens this one."""
    for w in range(LANES):
        out[w] = -(
            before[3 * LANES + w] * here[6 * LANES + w]
            + before[4 * LANES + w] * here[7 * LANES + w]
            + before[5 * LANES + w] * here[8 * LANES + w]
        )


@row
def _shift_row(pull_a, part_a, pull_b, part_b, over, x) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Move a node by the pulls before it and after it."""
    for w in range(LANES):
        p, q = pull_a[w], pull_b[w]
        m0 = q * part_b[w] - p * part_a[3 * LANES + w]
        m1 = q * part_b[LANES + w] - p * part_a[4 * LANES + w]
        m2 = q * part_b[2 * LANES + w] - p * part_a[5 * LANES + w]
        x[w], x[LANES + w], x[2 * LANES + w] = (
            x[w] + m0,
            x[LANES + w] + m1,
            x[2 * LANES + w] + m2,
        )
        x[3 * LANES + w], x[4 * LANES + w], x[5 * LANES + w] = (
            x[3 * LANES + w] + m0 * over,
            x[4 * LANES + w] + m1 * over,
            x[5 * LANES + w] + m2 * over,
        )


@row
def uncover(points, deepest, head, grid) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Bring the guides' points (P, 3), world, out of the obstacles where they lie too deep."""
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] - head[0, 3], points[i, 1] - head[1, 3], points[i, 2] - head[2, 3]
        a = head[0, 0] * x + head[1, 0] * y + head[2, 0] * z
        b = head[0, 1] * x + head[1, 1] * y + head[2, 1] * z
        c = head[0, 2] * x + head[1, 2] * y + head[2, 2] * z
        distance, n0, n1, n2 = _distance(grid, a, b, c, deepest[i])
        depth = deepest[i] - distance
        if depth > ZERO:
            for k in range(3):
                points[i, k] += depth * (head[k, 0] * n0 + head[k, 1] * n1 + head[k, 2] * n2)
