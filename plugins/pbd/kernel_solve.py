"""Direct solvers of the kernels: banded, tridiagonal, and the dense one of the lengths."""

from __future__ import annotations

import numpy as np
from numba import njit

from .kernel_math import LANES

LENGTH, FIRST, SECOND, PIVOT = 0, 8, 9, 10
ONE, ZERO = np.float32(1), np.float32(0)


@njit(fastmath=True, error_model="numpy", cache=True)
def banded_solve(element, force, result) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write A^-1 force of the free nodes (rows 1 to n), by the factor L D L^T of two bands."""
    n = force.shape[0]
    for c in range(3):
        result[0, c][:] = ZERO
    for j in range(1, n):
        el, a, b = element[j - 1], result[max(j - 1, 0)], result[max(j - 2, 0)]
        fj, rj = force[j], result[j]
        for c in range(3):
            for w in range(LANES):
                rj[c, w] = fj[c, w] - el[FIRST, w] * a[c, w] - el[SECOND, w] * b[c, w]
    for j in range(n - 1, 0, -1):
        el, rj = element[j - 1], result[j]
        last, next_last = j + 1 < n, j + 2 < n
        ea, eb = element[min(j, n - 2)], element[min(j + 1, n - 2)]
        ra, rb = result[min(j + 1, n - 1)], result[min(j + 2, n - 1)]
        one, two = ONE if last else ZERO, ONE if next_last else ZERO
        for c in range(3):
            for w in range(LANES):
                rj[c, w] = (
                    rj[c, w] * el[PIVOT, w]
                    - one * ea[FIRST, w] * ra[c, w]
                    - two * eb[SECOND, w] * rb[c, w]
                )


@njit(fastmath=True, error_model="numpy", cache=True)
def excess_of(segment, change, element, excess) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write by how much segments are too long along their directions."""
    for j in range(element.shape[0]):
        s, a, b, el, out = segment[j], change[j], change[j + 1], element[j], excess[j]
        for w in range(LANES):
            out[w] = (
                (s[0, w] + b[0, w] - a[0, w]) * s[3, w]
                + (s[1, w] + b[1, w] - a[1, w]) * s[4, w]
                + (s[2, w] + b[2, w] - a[2, w]) * s[5, w]
                - el[LENGTH, w]
            )


@njit(fastmath=True, error_model="numpy", cache=True)
def factorise_lengths(metric, segment, factor, pivot, scaled) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the factor L D L^T of metric * (d d^T), lower rows packed; `pivot` is 1/D."""
    m = segment.shape[0] - 1
    for i in range(m):
        base, di = i * (i + 1) // 2, segment[i]
        for j in range(i + 1):
            row, mj, dj = factor[base + j], metric[base + j], segment[j]
            for w in range(LANES):
                row[w] = mj[w] * (di[3, w] * dj[3, w] + di[4, w] * dj[4, w] + di[5, w] * dj[5, w])
        # scaled[j] (work) = L_ij D_j, found from left to right
        for j in range(i):
            other, here = j * (j + 1) // 2, factor[base + j]
            k = 0
            while k + 3 < j:
                s0, s1, s2, s3 = scaled[k], scaled[k + 1], scaled[k + 2], scaled[k + 3]
                f0, f1 = factor[other + k], factor[other + k + 1]
                f2, f3 = factor[other + k + 2], factor[other + k + 3]
                for w in range(LANES):
                    here[w] -= s0[w] * f0[w] + s1[w] * f1[w] + s2[w] * f2[w] + s3[w] * f3[w]
                k += 4
            while k < j:
                s0, f0 = scaled[k], factor[other + k]
                for w in range(LANES):
                    here[w] -= s0[w] * f0[w]
                k += 1
            out = scaled[j]
            for w in range(LANES):
                out[w] = here[w]
        last = factor[base + i]
        for j in range(i):
            here, s0, p = factor[base + j], scaled[j], pivot[j]
            for w in range(LANES):
                here[w] = s0[w] * p[w]
                last[w] -= s0[w] * here[w]
        out, floor = pivot[i], metric[base + i]
        for w in range(LANES):
            least = np.float32(1e-6) * floor[w]
            out[w] = ONE / (last[w] if last[w] > least else least)


@njit(fastmath=True, error_model="numpy", cache=True)
def lengths_solve(factor, pivot, value, m) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Solve with the factor of `factorise_lengths`, in place; columns go in pairs."""
    for i in range(1, m):
        base, here = i * (i + 1) // 2, value[i]
        j = 0
        while j + 1 < i:
            a, b, x, y = factor[base + j], factor[base + j + 1], value[j], value[j + 1]
            for w in range(LANES):
                here[w] -= a[w] * x[w] + b[w] * y[w]
            j += 2
        if j < i:
            a, x = factor[base + j], value[j]
            for w in range(LANES):
                here[w] -= a[w] * x[w]
    for i in range(m - 1, -1, -1):
        here, p = value[i], pivot[i]
        for w in range(LANES):
            here[w] *= p[w]
        k = i + 1
        while k + 1 < m:
            a, b = factor[k * (k + 1) // 2 + i], factor[(k + 1) * (k + 2) // 2 + i]
            x, y = value[k], value[k + 1]
            for w in range(LANES):
                here[w] -= a[w] * x[w] + b[w] * y[w]
            k += 2
        if k < m:
            a, x = factor[k * (k + 1) // 2 + i], value[k]
            for w in range(LANES):
                here[w] -= a[w] * x[w]


@njit(fastmath=True, error_model="numpy", cache=True)
def pull_back(tension, segment, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the force on the nodes of tensions along the segments."""
    n = force.shape[0]
    for j in range(1, n):
        fj, dj, tj = force[j], segment[j - 1], tension[j - 1]
        for c in range(3):
            for w in range(LANES):
                fj[c, w] = tj[w] * dj[3 + c, w]
        if j < n - 1:
            dk, tk = segment[j], tension[j]
            for c in range(3):
                for w in range(LANES):
                    fj[c, w] -= tk[w] * dk[3 + c, w]


@njit(fastmath=True, error_model="numpy", cache=True)
def tridiagonal_solve(diagonal, beside, value, m) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Solve a symmetric tridiagonal system in place; `beside[j]` stands between j - 1 and j."""
    for j in range(1, m):
        a, b, s, x, y = diagonal[j - 1], diagonal[j], beside[j], value[j - 1], value[j]
        for w in range(LANES):
            factor = s[w] / a[w]
            b[w] -= factor * s[w]
            y[w] -= factor * x[w]
    a, y = diagonal[m - 1], value[m - 1]
    for w in range(LANES):
        y[w] /= a[w]
    for j in range(m - 2, -1, -1):
        a, s, x, y = diagonal[j], beside[j + 1], value[j + 1], value[j]
        for w in range(LANES):
            y[w] = (y[w] - s[w] * x[w]) / a[w]
