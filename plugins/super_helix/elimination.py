"""Solving a chain's step from the tip to the root and back, in time linear in its elements."""

from __future__ import annotations

import math

import numpy as np

from hairkit.stored import Float64Array

from .nodes import compiled


@compiled
def eliminate(
    form: Float64Array,
    gradient: Float64Array,
    ends: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
) -> None:
    """Eliminate from the tip to the root, then go back; leaves -dq in `gradient[:, 6:]`."""
    count = len(form)
    tip, pull = np.zeros((6, 6)), np.zeros(6)
    for k in range(count - 1, -1, -1):
        a, b = form[k], gradient[k]
        for i in range(9):
            for j in range(i):
                a[i, j] = a[j, i]
        if k < count - 1:
            _join(a, b, tip, pull, ends[k + 1] - ends[k], spin[k], shift[k])
        _invert(a)
        _take_out(a, b, tip, pull)
    twist, turned = np.zeros(6), np.zeros(6)
    for k in range(count):
        a, b = form[k], gradient[k]
        for i in range(3):
            for j in range(6):
                b[6 + i] += a[6 + i, j] * twist[j]  # holds A_qq^-1 (A_qV V + gradient) = -dq
        d = ends[k + 1] - ends[k]
        turned[:] = twist
        turned[3] += twist[1] * d[2] - twist[2] * d[1]
        turned[4] += twist[2] * d[0] - twist[0] * d[2]
        turned[5] += twist[0] * d[1] - twist[1] * d[0]
        for i in range(3):
            for j in range(3):
                turned[i] -= spin[k, i, j] * b[6 + j]
                turned[3 + i] -= shift[k, i, j] * b[6 + j]
        twist[:] = turned


@compiled
def _join(
    a: Float64Array,
    b: Float64Array,
    tip: Float64Array,
    pull: Float64Array,
    d: Float64Array,
    spin: Float64Array,
    shift: Float64Array,
) -> None:
    """Add what hangs on an element's end: its twist is the element's own, moved, and S dq."""
    to = np.zeros((6, 9))
    for i in range(6):
        to[i, i] = 1.0
    to[3, 1], to[3, 2], to[4, 0] = d[2], -d[1], -d[2]
    to[4, 2], to[5, 0], to[5, 1] = d[0], d[1], -d[0]
    for i in range(3):
        for j in range(3):
            to[i, 6 + j], to[3 + i, 6 + j] = spin[i, j], shift[i, j]
    carried = np.zeros(6)
    for j in range(9):
        for i in range(6):
            total = 0.0
            for k in range(6):
                total += tip[i, k] * to[k, j]
            carried[i] = total
        for i in range(9):
            total = 0.0
            for k in range(6):
                total += to[k, i] * carried[k]
            a[i, j] += total
        for i in range(6):
            b[j] += to[i, j] * pull[i]


@compiled
def _invert(a: Float64Array) -> None:
    """Put the inverse of the symmetric block [6:, 6:] in its place."""
    p, q, r = a[6, 6], a[6, 7], a[6, 8]
    s, t, u = a[7, 7], a[7, 8], a[8, 8]
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
    a[6, 6] = i0 * i0 + i1 * i1 + i2 * i2
    a[7, 7] = i3 * i3 + i4 * i4
    a[8, 8] = i5 * i5
    a[6, 7] = a[7, 6] = i1 * i3 + i2 * i4
    a[6, 8] = a[8, 6] = i2 * i5
    a[7, 8] = a[8, 7] = i4 * i5


@compiled
def _take_out(a: Float64Array, b: Float64Array, tip: Float64Array, pull: Float64Array) -> None:
    """Take dq out: the joint's form in `tip`, A_qq^-1 A_qV in a[6:, :6], A_qq^-1 g in b[6:]."""
    x, y, z = b[6], b[7], b[8]
    for i in range(3):
        b[6 + i] = a[6 + i, 6] * x + a[6 + i, 7] * y + a[6 + i, 8] * z
    for j in range(6):
        x, y, z = a[j, 6], a[j, 7], a[j, 8]
        for i in range(3):
            a[6 + i, j] = a[6 + i, 6] * x + a[6 + i, 7] * y + a[6 + i, 8] * z
    for i in range(6):
        pull[i] = b[i]
        for k in range(3):
            pull[i] -= a[i, 6 + k] * b[6 + k]
        for j in range(6):
            total = a[i, j]
            for k in range(3):
                total -= a[i, 6 + k] * a[6 + k, j]
            tip[i, j] = total
