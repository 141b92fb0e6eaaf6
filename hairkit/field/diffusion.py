"""Screened diffusion on the cells of a mask: the one linear solver that fields and potentials
share.

Minimises `sum_i c_i |u_i - d_i|^2 + s * sum_(i,j) |u_i - u_j|^2` over the occupied cells, the sum
over pairs of face neighbours inside the mask (no flux through its border). This is the tensor
diffusion of Paris et al. 2008 ("Hair photobooth", section 4) with soft instead of hard constraints;
a very large `c` makes a cell fixed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit, prange

from hairkit.arrays import BoolArray, Float32Array, Int32Array
from hairkit.errors import InputError

CHUNKS = 64
"""Sums are taken over this many parts of the cells, whatever the number of threads."""
COARSEST_CELLS = 4000
"""Below this many cells no coarser grid is made."""


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
        Stop when the residual of every column fell below this share of the right-hand side, both
        over the diagonal: fixed cells, whose weight is huge, would else hide unsolved others.
    start
        (N, C) first guess; the solution on cells twice as large when None.

    Raises `InputError` when shapes disagree or no weight is positive (then there is no unique
    answer).
    """
    count = int(np.count_nonzero(occupied))
    if data.shape[:1] != (count,) or weight.shape != (count,):
        raise InputError(
            f"diffusion of {count} cells got data {data.shape} and weights {weight.shape}"
        )
    if not (weight > 0).any():
        raise InputError("diffusion needs at least one cell with a weight above 0")
    guess = start if start is not None else _coarse_guess(occupied, data, weight, smoothness)
    solution: Float32Array = _conjugate_gradients(
        cell_neighbours(occupied),
        np.ascontiguousarray(data, np.float32),
        np.ascontiguousarray(weight, np.float32),
        np.float32(smoothness),
        np.float32(tolerance),
        max_iterations,
        np.array(guess, np.float32, order="C"),
    )
    return solution


def _coarse_guess(
    occupied: BoolArray, data: Float32Array, weight: Float32Array, smoothness: float
) -> Float32Array:
    """Return (N, C) the solution on cells twice as large: nested iteration (Brandt 1977).

    Eight cells merge into one: weights add up, data average by weight, and the factor between
    neighbours doubles (four times the face, twice the distance).
    """
    shape = tuple(-(-n // 2) for n in occupied.shape)
    if len(data) < COARSEST_CELLS:
        mean = (weight[:, None] * data).sum(axis=0) / weight.sum()
        return np.broadcast_to(mean, data.shape).astype(np.float32)
    cell = np.ravel_multi_index(tuple(index // 2 for index in np.nonzero(occupied)), shape)
    merged, row = np.unique(cell, return_inverse=True)
    coarse = np.zeros(shape, bool)
    coarse.ravel()[merged] = True
    total = np.bincount(row, weight, len(merged))
    columns = [np.bincount(row, weight * column, len(merged)) for column in data.T]
    mean = np.stack(columns, axis=1) / np.maximum(total, 1e-30)[:, None]
    solved = solve_screened(
        coarse, mean.astype(np.float32), total.astype(np.float32), 2 * smoothness, tolerance=1e-2
    )
    return solved[row]


def cell_neighbours(occupied: BoolArray) -> Int32Array:
    """Return (N, 6) the row of each occupied cell's face neighbours (-x, +x, -y, +y, -z, +z), -1
    for none."""
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
    """Return `(diag(c) + s L) u` for `values` (N, C): the compiled operator's readable twin."""
    padded = np.concatenate([values, np.zeros_like(values[:1])])
    degree = (neighbours >= 0).sum(axis=1)[:, None]
    total = sum(padded[neighbours[:, k]] for k in range(6))
    result: npt.NDArray[Any] = weight[:, None] * values + smoothness * (degree * values - total)
    return result


@njit(cache=True, parallel=True)
def _operate(neighbours, weight, smoothness, values, result, partial):  # type: ignore[no-untyped-def]
    """Write `A values` into result and the chunks' sums of values * result into partial (CHUNKS,
    C)."""
    count, channels = values.shape
    size = (count + CHUNKS - 1) // CHUNKS
    for chunk in prange(CHUNKS):
        partial[chunk] = 0
        for i in range(chunk * size, min((chunk + 1) * size, count)):
            degree = weight[i]
            for k in range(6):
                if neighbours[i, k] >= 0:
                    degree += smoothness
            for c in range(channels):
                result[i, c] = degree * values[i, c]
            for k in range(6):
                j = neighbours[i, k]
                if j >= 0:
                    for c in range(channels):
                        result[i, c] -= smoothness * values[j, c]
            for c in range(channels):
                partial[chunk, c] += values[i, c] * result[i, c]


@njit(cache=True, parallel=True)
def _advance(x, r, p, ap, inverse, alpha, squares, products):  # type: ignore[no-untyped-def]
    """Step x, r along p; sum chunks' (r / diagonal)^2 into squares, r^2 / diagonal into
    products."""
    count, channels = x.shape
    size = (count + CHUNKS - 1) // CHUNKS
    for chunk in prange(CHUNKS):
        squares[chunk] = 0
        products[chunk] = 0
        for i in range(chunk * size, min((chunk + 1) * size, count)):
            for c in range(channels):
                x[i, c] += alpha[c] * p[i, c]
                residual = r[i, c] - alpha[c] * ap[i, c]
                r[i, c] = residual
                step = residual * inverse[i]
                squares[chunk, c] += step * step
                products[chunk, c] += residual * step


@njit(cache=True, parallel=True)
def _turn(p, r, inverse, beta):  # type: ignore[no-untyped-def]
    count, channels = p.shape
    for i in prange(count):
        for c in range(channels):
            p[i, c] = inverse[i] * r[i, c] + beta[c] * p[i, c]


@njit(cache=True)
def _conjugate_gradients(neighbours, data, weight, smoothness, tolerance, max_iterations, x):  # type: ignore[no-untyped-def]
    """Jacobi-preconditioned conjugate gradients, one scalar recursion a column, columns in step.

    Sums are taken over a fixed number of chunks, so the result does not depend on the number of
    threads.
    """
    count, channels = data.shape
    inverse = np.empty(count, np.float32)
    for i in range(count):
        diagonal = weight[i]
        for k in range(6):
            if neighbours[i, k] >= 0:
                diagonal += smoothness
        inverse[i] = 1 / diagonal if diagonal > 0 else np.float32(1.0)
    ap = np.empty_like(x)
    first = np.zeros((CHUNKS, channels))
    second = np.zeros((CHUNKS, channels))
    _operate(neighbours, weight, smoothness, x, ap, first)
    r = np.empty_like(x)
    p = np.empty_like(x)
    rz = np.zeros(channels)
    size = np.zeros(channels)
    for i in range(count):
        for c in range(channels):
            b = weight[i] * data[i, c]
            size[c] += (b * inverse[i]) ** 2
            r[i, c] = b - ap[i, c]
            p[i, c] = inverse[i] * r[i, c]
            rz[c] += r[i, c] * p[i, c]
    alpha = np.zeros(channels, np.float32)
    beta = np.zeros(channels, np.float32)
    for _ in range(max_iterations):
        _operate(neighbours, weight, smoothness, p, ap, first)
        curvature = first.sum(axis=0)
        for c in range(channels):
            alpha[c] = rz[c] / curvature[c] if curvature[c] > 0 else 0.0
        _advance(x, r, p, ap, inverse, alpha, first, second)
        squares, products = first.sum(axis=0), second.sum(axis=0)
        done = True
        for c in range(channels):
            if squares[c] > tolerance * tolerance * size[c]:
                done = False
            beta[c] = products[c] / rz[c] if rz[c] > 0 else 0.0
            rz[c] = products[c]
        if done:
            break
        _turn(p, r, inverse, beta)
    return x
