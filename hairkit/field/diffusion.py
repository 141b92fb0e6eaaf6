"""Screened diffusion on the cells of a mask: the linear solver of fields and potentials.

Minimises `sum_i c_i |u_i - d_i|^2 + s * sum_(i,j) |u_i - u_j|^2` over the occupied cells, the sum
over pairs of face neighbours inside the mask (no flux through its border). This is the tensor
diffusion of Paris et al. 2008 ("Hair photobooth", section 4) with soft instead of hard constraints;
a very large `c` makes a cell fixed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from hairkit.errors import InputError
from hairkit.parallel import compiled, parallel_for

CHUNKS = 64
"""Sums are taken over this many parts of the cells, whatever the number of threads."""
COARSEST_CELLS = 4000
"""Below this many cells no coarser grid is made."""
COARSE_TOLERANCE = 1e-2
"""Relative residual of the solution on a coarser grid: it is only a first guess."""
NO_WEIGHT = 1e-30
"""Cells of less weight than this hold no data."""
MIN_CELLS = 4096
"""Least number of cells that are worth another thread."""


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
    neighbours = cell_neighbours(occupied)
    weight = np.ascontiguousarray(weight, np.float32)
    inverse = np.empty(count, np.float32)
    _invert_diagonal(neighbours, weight, np.float32(smoothness), inverse)
    return _conjugate_gradients(
        _System(neighbours, weight, np.float32(smoothness), inverse),
        np.ascontiguousarray(data, np.float32),
        np.array(guess, np.float32, order="C"),
        float(np.float32(tolerance)),
        max_iterations,
    )


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
    mean = np.stack(columns, axis=1) / np.maximum(total, NO_WEIGHT)[:, None]
    solved = solve_screened(
        coarse,
        mean.astype(np.float32),
        total.astype(np.float32),
        2 * smoothness,
        tolerance=COARSE_TOLERANCE,
    )
    return solved[row]


def cell_neighbours(occupied: BoolArray) -> Int32Array:
    """Return (N, 6) rows of the neighbours -x, +x, -y, +y, -z, +z of occupied cells, or -1."""
    number = np.full(np.add(occupied.shape, 2), -1, np.int32)
    inner = number[1:-1, 1:-1, 1:-1]
    inner[occupied] = np.arange(np.count_nonzero(occupied), dtype=np.int32)
    columns = []
    for axis in range(3):
        for shift in (1, -1):
            columns.append(np.roll(number, shift, axis)[1:-1, 1:-1, 1:-1][occupied])
    return np.ascontiguousarray(np.stack(columns, axis=1))


class _System(NamedTuple):
    """The linear system `(diag(c) + s L) u = c d`."""

    neighbours: Int32Array
    """(N, 6) rows of the face neighbours, see `cell_neighbours`."""
    weight: Float32Array
    """(N,) `c`."""
    smoothness: np.float32
    """`s`."""
    inverse: Float32Array
    """(N,) inverse of the diagonal, the preconditioner."""


class _Iterate(NamedTuple):
    """State of the conjugate gradients, (N, C) each."""

    solution: Float32Array
    residual: Float32Array
    direction: Float32Array
    image: Float32Array
    """The operator applied to the direction."""


def _conjugate_gradients(
    system: _System,
    data: Float32Array,
    guess: Float32Array,
    tolerance: float,
    max_iterations: int,
) -> Float32Array:
    """Return the solution (N, C) by Jacobi-preconditioned conjugate gradients from a guess.

    Each column is a problem of its own (Shewchuk 1994, algorithm B3); all take their steps
    together. Sums are taken over a fixed number of chunks, so the result does not depend on the
    number of threads.
    """
    count, channels = data.shape
    least = max(1, CHUNKS * MIN_CELLS // count)
    now = _Iterate(guess, *(np.empty_like(guess) for _ in range(3)))
    products, squares = np.zeros((CHUNKS, channels)), np.zeros((CHUNKS, channels))
    parallel_for(_apply, CHUNKS, system, now.solution, now.image, products, min_chunk=least)
    energy, size = np.zeros(channels), np.zeros(channels)
    _begin(system, data, now, energy, size)
    for _ in range(max_iterations):
        parallel_for(_apply, CHUNKS, system, now.direction, now.image, products, min_chunk=least)
        step = _ratio(energy, products.sum(axis=0))
        parallel_for(_advance, CHUNKS, system, now, step, squares, products, min_chunk=least)
        if (squares.sum(axis=0) <= tolerance * tolerance * size).all():
            break
        before, energy = energy, products.sum(axis=0)
        turn = _ratio(energy, before)
        parallel_for(_turn_direction, CHUNKS, system, now, turn, min_chunk=least)
    return now.solution


def _ratio(value: Float64Array, divisor: Float64Array) -> Float32Array:
    """Return (C,) the quotients, 0 where the divisor is not positive."""
    positive = np.where(divisor > 0, divisor, 1.0)
    return np.where(divisor > 0, value / positive, 0.0).astype(np.float32)


@compiled
def _invert_diagonal(
    neighbours: Int32Array, weight: Float32Array, smoothness: np.float32, inverse: Float32Array
) -> None:
    """Write the inverse of the operator's diagonal (N,), 1 where a cell is alone and unknown."""
    for i in range(len(inverse)):
        diagonal = weight[i]
        for k in range(6):
            if neighbours[i, k] >= 0:
                diagonal += smoothness
        inverse[i] = 1 / diagonal if diagonal > 0 else np.float32(1.0)


@compiled
def _chunk_of_cells(chunk: int, count: int) -> tuple[int, int]:
    """Return the first cell of a chunk and the one after its last."""
    size = (count + CHUNKS - 1) // CHUNKS
    return chunk * size, min((chunk + 1) * size, count)


@compiled
def _apply(
    first: int,
    last: int,
    system: _System,
    values: Float32Array,
    image: Float32Array,
    products: Float64Array,
) -> None:
    """Write the operator's image (N, C) of values (N, C), and chunks' sums of values * image."""
    count, channels = values.shape
    for chunk in range(first, last):
        products[chunk] = 0
        begin, end = _chunk_of_cells(chunk, count)
        for i in range(begin, end):
            degree = system.weight[i]
            for k in range(6):
                if system.neighbours[i, k] >= 0:
                    degree += system.smoothness
            for c in range(channels):
                image[i, c] = degree * values[i, c]
            for k in range(6):
                j = system.neighbours[i, k]
                if j >= 0:
                    for c in range(channels):
                        image[i, c] -= system.smoothness * values[j, c]
            for c in range(channels):
                products[chunk, c] += values[i, c] * image[i, c]


@compiled
def _begin(
    system: _System, data: Float32Array, now: _Iterate, energy: Float64Array, size: Float64Array
) -> None:
    """Write first residual and direction; sums of r^2 / diagonal and (right side / diagonal)^2."""
    count, channels = data.shape
    for i in range(count):
        for c in range(channels):
            b = system.weight[i] * data[i, c]
            size[c] += (b * system.inverse[i]) ** 2
            now.residual[i, c] = b - now.image[i, c]
            now.direction[i, c] = system.inverse[i] * now.residual[i, c]
            energy[c] += now.residual[i, c] * now.direction[i, c]


@compiled
def _advance(
    first: int,
    last: int,
    system: _System,
    now: _Iterate,
    step: Float32Array,
    squares: Float64Array,
    products: Float64Array,
) -> None:
    """Step (C,) along the direction; write chunks' sums of (r / diagonal)^2 and r^2 / diagonal."""
    count, channels = now.solution.shape
    for chunk in range(first, last):
        squares[chunk] = 0
        products[chunk] = 0
        begin, end = _chunk_of_cells(chunk, count)
        for i in range(begin, end):
            for c in range(channels):
                now.solution[i, c] += step[c] * now.direction[i, c]
                residual = now.residual[i, c] - step[c] * now.image[i, c]
                now.residual[i, c] = residual
                scaled = residual * system.inverse[i]
                squares[chunk, c] += scaled * scaled
                products[chunk, c] += residual * scaled


@compiled
def _turn_direction(
    first: int, last: int, system: _System, now: _Iterate, turn: Float32Array
) -> None:
    """Make the directions conjugate: the preconditioned residual plus turn (C,) times the last."""
    count, channels = now.direction.shape
    for chunk in range(first, last):
        begin, end = _chunk_of_cells(chunk, count)
        for i in range(begin, end):
            for c in range(channels):
                now.direction[i, c] = (
                    system.inverse[i] * now.residual[i, c] + turn[c] * now.direction[i, c]
                )
