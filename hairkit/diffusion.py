"""Screened diffusion on the cells of a mask: the one linear solver that fields and potentials share.

Minimises `sum_i c_i |u_i - d_i|^2 + s * sum_(i,j) |u_i - u_j|^2` over the occupied cells, the sum over pairs of
face neighbours inside the mask (no flux through its border). This is the tensor diffusion of Paris et al. 2008
("Hair photobooth", section 4) with soft instead of hard constraints; a very large `c` makes a cell fixed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from hairkit.errors import InputError
from hairkit.stored import BoolArray, Float32Array, Int32Array


def solve_screened(
    occupied: BoolArray,
    data: Float32Array,
    weight: Float32Array,
    smoothness: float,
    *,
    tolerance: float = 1e-3,
    max_iterations: int = 400,
    start: Float32Array | None = None,
) -> Float32Array:
    """Return the minimiser (N, C), one row for each occupied cell in C order.

    Parameters
    ----------
    occupied
        (X, Y, Z) cells that take part.
    data, weight
        (N, C) wanted values and (N,) their weights `c`, 0 where nothing is known; one row a cell.
    smoothness
        The factor `s` above 0 of the neighbour differences.
    tolerance
        Stop when the residual of every column fell below this share of the right-hand side.
    start
        (N, C) first guess; zeros when None.

    Raises `InputError` when shapes disagree or no weight is positive (then there is no unique answer).
    """
    count = int(np.count_nonzero(occupied))
    if data.shape[:1] != (count,) or weight.shape != (count,):
        raise InputError(
            f"diffusion of {count} cells got data {data.shape} and weights {weight.shape}"
        )
    if not (weight > 0).any():
        raise InputError("diffusion needs at least one cell with a weight above 0")
    neighbours = cell_neighbours(occupied)
    guess = np.zeros(data.shape, np.float32) if start is None else start.astype(np.float32)
    return _conjugate_gradients(
        neighbours,
        np.ascontiguousarray(data, np.float32),
        np.ascontiguousarray(weight, np.float32),
        np.float32(smoothness),
        np.float32(tolerance),
        max_iterations,
        np.ascontiguousarray(guess),
    )


def cell_neighbours(occupied: BoolArray) -> Int32Array:
    """Return (N, 6) the row of each occupied cell's face neighbours (-x, +x, -y, +y, -z, +z), -1 for none."""
    number = np.full(np.add(occupied.shape, 2), -1, np.int32)
    inner = number[1:-1, 1:-1, 1:-1]
    inner[occupied] = np.arange(np.count_nonzero(occupied), dtype=np.int32)
    columns = []
    for axis in range(3):
        for shift in (1, -1):
            columns.append(np.roll(number, shift, axis)[1:-1, 1:-1, 1:-1][occupied])
    return np.ascontiguousarray(np.stack(columns, axis=1))


def apply_operator(
    neighbours: Int32Array, weight: npt.NDArray[Any], smoothness: float, values: npt.NDArray[Any]
) -> npt.NDArray[Any]:
    """Return `(diag(c) + s L) u` for `values` (N, C): the readable twin of the compiled operator."""
    padded = np.concatenate([values, np.zeros_like(values[:1])])
    degree = (neighbours >= 0).sum(axis=1)[:, None]
    total = sum(padded[neighbours[:, k]] for k in range(6))
    return weight[:, None] * values + smoothness * (degree * values - total)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _operate(neighbours, weight, smoothness, values, result):  # type: ignore[no-untyped-def]
    count, channels = values.shape
    for i in range(count):
        for c in range(channels):
            result[i, c] = weight[i] * values[i, c]
        for k in range(6):
            j = neighbours[i, k]
            if j >= 0:
                for c in range(channels):
                    result[i, c] += smoothness * (values[i, c] - values[j, c])


@njit(cache=True)  # type: ignore[untyped-decorator]
def _conjugate_gradients(neighbours, data, weight, smoothness, tolerance, max_iterations, x):  # type: ignore[no-untyped-def]
    """Jacobi-preconditioned conjugate gradients, one scalar recursion a column, columns in step."""
    count, channels = data.shape
    inverse = np.empty(count, np.float32)
    for i in range(count):
        degree = 0
        for k in range(6):
            if neighbours[i, k] >= 0:
                degree += 1
        diagonal = weight[i] + smoothness * degree
        inverse[i] = 1 / diagonal if diagonal > 0 else 1.0
    ap = np.empty_like(x)
    _operate(neighbours, weight, smoothness, x, ap)
    r = np.empty_like(x)
    p = np.empty_like(x)
    rz = np.zeros(channels)
    size = np.zeros(channels)
    for i in range(count):
        for c in range(channels):
            b = weight[i] * data[i, c]
            size[c] += b * b
            r[i, c] = b - ap[i, c]
            p[i, c] = inverse[i] * r[i, c]
            rz[c] += r[i, c] * p[i, c]
    alpha = np.zeros(channels, np.float32)
    beta = np.zeros(channels, np.float32)
    for _ in range(max_iterations):
        _operate(neighbours, weight, smoothness, p, ap)
        curvature = np.zeros(channels)
        for i in range(count):
            for c in range(channels):
                curvature[c] += p[i, c] * ap[i, c]
        for c in range(channels):
            alpha[c] = rz[c] / curvature[c] if curvature[c] > 0 else 0.0
        rr = np.zeros(channels)
        new = np.zeros(channels)
        for i in range(count):
            for c in range(channels):
                x[i, c] += alpha[c] * p[i, c]
                residual = r[i, c] - alpha[c] * ap[i, c]
                r[i, c] = residual
                rr[c] += residual * residual
                new[c] += residual * residual * inverse[i]
        done = True
        for c in range(channels):
            if rr[c] > tolerance * tolerance * size[c]:
                done = False
            beta[c] = new[c] / rz[c] if rz[c] > 0 else 0.0
            rz[c] = new[c]
        if done:
            break
        for i in range(count):
            for c in range(channels):
                p[i, c] = inverse[i] * r[i, c] + beta[c] * p[i, c]
    return x
