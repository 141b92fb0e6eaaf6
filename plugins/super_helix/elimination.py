"""Solve a chain's linear system from the tip to the root and back, in time linear in its size."""

from __future__ import annotations

import math

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled, compiled_with

TWIST = 6
"""Coordinates of a twist (turn, move); those of the element's own change dq follow them."""


@compiled_with(allocates=True, inside=True)
def eliminate(
    form: Float64Array,
    gradient: Float64Array,
    ends: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
) -> None:
    """Eliminate from tip to root, then substitute back; leaves -dq in `gradient[:, 6:]`."""
    count = len(form)
    tip, pull, d = np.zeros((6, 6)), np.zeros(6), np.empty(3)
    scratch = np.empty((9, 3))
    for k in range(count - 1, -1, -1):
        a, b = form[k], gradient[k]
        if k < count - 1:
            for i in range(3):
                d[i] = ends[k + 1, i] - ends[k, i]
            _join(a, b, tip, pull, d, spin[k], shift[k], scratch)
        for i in range(9):
            for j in range(i):
                a[i, j] = a[j, i]
        _invert(a[TWIST:, TWIST:])
        _condense(a, b, tip, pull)
    twist, turned = np.zeros(6), np.zeros(6)
    for k in range(count):
        a, b = form[k], gradient[k]
        for i in range(3):
            for j in range(6):
                b[6 + i] += a[6 + i, j] * twist[j]  # holds A_qq^-1 (A_qV V + gradient) = -dq
        for i in range(3):
            d[i] = ends[k + 1, i] - ends[k, i]
        for i in range(6):
            turned[i] = twist[i]
        for i in range(3):
            j, m = (i + 1) % 3, (i + 2) % 3
            turned[3 + i] += twist[j] * d[m] - twist[m] * d[j]
        for i in range(3):
            for j in range(3):
                turned[i] -= spin[k, i, j] * b[6 + j]
                turned[3 + i] -= shift[k, i, j] * b[6 + j]
        for i in range(6):
            twist[i] = turned[i]


@compiled
def _join(
    a: Float64Array,
    b: Float64Array,
    tip: Float64Array,
    pull: Float64Array,
    d: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
    scratch: Float64Array,
) -> None:
    """Add the form of the chain behind an element's end to the upper triangle of its own.

    The end's twist is X (turn, move) + S dq, X = [[1, 0], [-[d]x, 1]] and S = [spin; shift]; the
    form of the end is [[A, B], [B', C]]. `scratch` is (9, 3).
    """
    moved, carried = scratch[:3], scratch[3:]
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3  # row i of [d]x M is d_p M_q - d_q M_p
        for j in range(3):
            moved[i, j] = tip[i, 3 + j] + d[p] * tip[3 + q, 3 + j] - d[q] * tip[3 + p, 3 + j]
            a[i, 3 + j] += moved[i, j]
        b[i] += pull[i] + d[p] * pull[3 + q] - d[q] * pull[3 + p]
        b[3 + i] += pull[3 + i]
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3
        for j in range(i, 3):
            r, s = (j + 1) % 3, (j + 2) % 3  # column j of M [d]x is M_r d_s - M_s d_r
            back = moved[i, r] * d[s] - moved[i, s] * d[r]
            a[i, j] += tip[i, j] - back + d[p] * tip[j, 3 + q] - d[q] * tip[j, 3 + p]
            a[3 + i, 3 + j] += tip[3 + i, 3 + j]
    for i in range(6):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total += tip[i, k] * spin[k, j] + tip[i, 3 + k] * shift[k, j]
            carried[i, j] = total
    for j in range(3):
        for i in range(3):
            p, q = (i + 1) % 3, (i + 2) % 3
            a[i, 6 + j] += carried[i, j] + d[p] * carried[3 + q, j] - d[q] * carried[3 + p, j]
            a[3 + i, 6 + j] += carried[3 + i, j]
        for i in range(j + 1):
            total = 0.0
            for k in range(3):
                total += spin[k, i] * carried[k, j] + shift[k, i] * carried[3 + k, j]
            a[6 + i, 6 + j] += total
        for k in range(3):
            b[6 + j] += spin[k, j] * pull[k] + shift[k, j] * pull[3 + k]


@compiled_with(inside=True)
def _invert(a: Float64Array) -> None:
    """Replace a symmetric matrix (3, 3) by its inverse."""
    p, q, r = a[0, 0], a[0, 1], a[0, 2]
    s, t, u = a[1, 1], a[1, 2], a[2, 2]
    # Cholesky, since the forms of twist and bending differ by many orders of magnitude
    l0 = math.sqrt(p)
    l1, l2 = q / l0, r / l0
    l3 = math.sqrt(s - l1 * l1)
    l4 = (t - l1 * l2) / l3
    l5 = math.sqrt(u - l2 * l2 - l4 * l4)
    i0, i3, i5 = 1 / l0, 1 / l3, 1 / l5
    i1 = -l1 * i0 * i3
    i4 = -l4 * i3 * i5
    i2 = -(l2 * i0 + l4 * i1) * i5
    a[0, 0] = i0 * i0 + i1 * i1 + i2 * i2
    a[1, 1] = i3 * i3 + i4 * i4
    a[2, 2] = i5 * i5
    a[0, 1] = a[1, 0] = i1 * i3 + i2 * i4
    a[0, 2] = a[2, 0] = i2 * i5
    a[1, 2] = a[2, 1] = i4 * i5


@compiled_with(inside=True)
def _condense(a: Float64Array, b: Float64Array, tip: Float64Array, pull: Float64Array) -> None:
    """Eliminate dq: Schur complement in `tip`, A_qq^-1 A_qV in a[6:, :6], A_qq^-1 g in b[6:]."""
    inverse, across, below, own = a[TWIST:, TWIST:], a[:TWIST, TWIST:], a[TWIST:, :TWIST], b[TWIST:]
    x, y, z = own[0], own[1], own[2]
    for i in range(3):
        own[i] = inverse[i, 0] * x + inverse[i, 1] * y + inverse[i, 2] * z
    for j in range(TWIST):
        x, y, z = across[j, 0], across[j, 1], across[j, 2]
        for i in range(3):
            below[i, j] = inverse[i, 0] * x + inverse[i, 1] * y + inverse[i, 2] * z
    for i in range(TWIST):
        pull[i] = b[i]
        for k in range(3):
            pull[i] -= across[i, k] * own[k]
        for j in range(i, TWIST):
            total = a[i, j]
            for k in range(3):
                total -= across[i, k] * below[k, j]
            tip[i, j] = tip[j, i] = total
