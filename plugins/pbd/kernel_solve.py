"""Direct solvers of the kernels: banded, tridiagonal, and the dense one of the lengths."""

from __future__ import annotations

import numpy as np

from .kernel_math import LANES, row

LENGTH, FIRST, SECOND, PIVOT = 0, 8, 9, 10
ONE, ZERO = np.float32(1), np.float32(0)


@row
def banded_solve(element, force, result) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write A^-1 force of the free nodes (rows 1 to n), by the factor L D L^T of two bands."""
    n = force.shape[0]
    elements = element.reshape(n - 1, element.shape[1] * LANES)
    forces, results = force.reshape(n, 3 * LANES), result.reshape(n, 3 * LANES)
    results[0, :] = ZERO
    for j in range(1, n):
        before = results[max(j - 2, 0)]
        _forward_row(forces[j], elements[j - 1], results[j - 1], before, results[j])
    for j in range(n - 1, 0, -1):
        one, two = ONE if j + 1 < n else ZERO, ONE if j + 2 < n else ZERO
        _backward_row(
            elements[j - 1], elements[min(j, n - 2)], elements[min(j + 1, n - 2)],
            results[min(j + 1, n - 1)], results[min(j + 2, n - 1)], one, two, results[j],
        )  # fmt: skip


@row
def _forward_row(force, el, a, b, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """One row of L, three coordinates at once; a and b are the rows before."""
    for w in range(LANES):
        p, q = el[FIRST * LANES + w], el[SECOND * LANES + w]
        out[w] = force[w] - p * a[w] - q * b[w]
        out[LANES + w] = force[LANES + w] - p * a[LANES + w] - q * b[LANES + w]
        out[2 * LANES + w] = force[2 * LANES + w] - p * a[2 * LANES + w] - q * b[2 * LANES + w]


@row
def _backward_row(el, after, beyond, a, b, one, two, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """One row of D^-1 and L^T; a and b are the rows after, one and two 0 where there is none."""
    for w in range(LANES):
        d, p = el[PIVOT * LANES + w], one * after[FIRST * LANES + w]
        q = two * beyond[SECOND * LANES + w]
        out[w] = out[w] * d - p * a[w] - q * b[w]
        out[LANES + w] = out[LANES + w] * d - p * a[LANES + w] - q * b[LANES + w]
        out[2 * LANES + w] = out[2 * LANES + w] * d - p * a[2 * LANES + w] - q * b[2 * LANES + w]


@row
def excess_of(segment, change, element, excess) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write by how much segments are too long along their directions."""
    n = segment.shape[0]
    parts, changes = segment.reshape(n, 9 * LANES), change.reshape(n, 3 * LANES)
    for j in range(n - 1):
        _excess_row(parts[j], changes[j], changes[j + 1], element[j, LENGTH], excess[j])


@row
def _excess_row(s, a, b, length, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """One segment of `excess_of`."""
    for w in range(LANES):
        out[w] = (
            (s[w] + b[w] - a[w]) * s[3 * LANES + w]
            + (s[LANES + w] + b[LANES + w] - a[LANES + w]) * s[4 * LANES + w]
            + (s[2 * LANES + w] + b[2 * LANES + w] - a[2 * LANES + w]) * s[5 * LANES + w]
            - length[w]
        )


@row
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


@row
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


@row
def pull_back(tension, segment, force) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write the force on the nodes of tensions along the segments; the tip's last is 0."""
    n = force.shape[0]
    parts, forces = segment.reshape(n, 9 * LANES), force.reshape(n, 3 * LANES)
    tension[n - 1, :] = ZERO
    for j in range(1, n):
        last = min(j, n - 2)
        _pull_row(tension[j - 1], parts[j - 1], tension[j], parts[last], forces[j])


@row
def _pull_row(t, a, u, b, out) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Force on the node between two segments."""
    for w in range(LANES):
        out[w] = t[w] * a[3 * LANES + w] - u[w] * b[3 * LANES + w]
        out[LANES + w] = t[w] * a[4 * LANES + w] - u[w] * b[4 * LANES + w]
        out[2 * LANES + w] = t[w] * a[5 * LANES + w] - u[w] * b[5 * LANES + w]


@row
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
