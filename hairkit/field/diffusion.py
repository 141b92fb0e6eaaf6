"""Screened diffusion on the cells of a mask: the linear solver of fields and potentials.

Minimises `sum_i c_i |u_i - d_i|^2 + s * sum_(i,j) |u_i - u_j|^2` over the occupied cells, the sum
over pairs of face neighbours inside the mask (no flux through its border). This is the tensor
diffusion of Paris et al. 2008 ("Hair photobooth", section 4) with soft instead of hard constraints;
a very large `c` makes a cell fixed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from hairkit.arrays import BoolArray, Float32Array, Int32Array, Int64Array
from hairkit.errors import InputError

MOST_ITERATIONS = 400
"""Steps of conjugate gradients at most."""
COARSEST_CELLS = 4000
"""Below this many cells no coarser grid is made."""
COARSE_TOLERANCE = 1e-2
"""Relative residual of the solution on a coarser grid: it is only a first guess."""
NO_WEIGHT = 1e-30
"""Cells of less weight than this hold no data."""


@dataclass(frozen=True, eq=False)
class CellGraph:
    """Occupied cells and which of them touch; several systems on the same cells share it."""

    touching: csr_matrix
    """(N, N) float32, 1 where two cells share a face, in C order of the cells."""
    degree: Float32Array
    """(N,) number of the neighbours of each cell."""
    coarser: CellGraph | None
    """Cells twice as large; None where there are fewer than `COARSEST_CELLS`."""
    block: Int64Array
    """(N,) the cell of `coarser` that holds each cell; empty without one."""

    def __len__(self) -> int:
        return len(self.degree)

    @classmethod
    def of(cls, occupied: BoolArray) -> CellGraph:
        """Return the graph of the cells that a mask (X, Y, Z) marks."""
        neighbours = cell_neighbours(occupied)
        count, there = len(neighbours), neighbours >= 0
        degree = np.count_nonzero(there, axis=1)
        columns = neighbours[there]
        starts = np.concatenate([[0], np.cumsum(degree)]).astype(np.int32)
        ones = np.ones(len(columns), np.float32)
        touching = csr_matrix((ones, columns, starts), shape=(count, count))
        if count < COARSEST_CELLS:
            return cls(touching, degree.astype(np.float32), None, np.empty(0, np.int64))
        coarse, block = _merge_cells(occupied)
        return cls(touching, degree.astype(np.float32), cls.of(coarse), block)


def _merge_cells(occupied: BoolArray) -> tuple[BoolArray, Int64Array]:
    """Return the occupied cells of twice the size, and which of them holds each cell (N,)."""
    shape = tuple(-(-n // 2) for n in occupied.shape)
    cell = np.ravel_multi_index(tuple(index // 2 for index in np.nonzero(occupied)), shape)
    coarse = np.zeros(shape, bool)
    coarse.ravel()[cell] = True
    return coarse, (np.cumsum(coarse) - 1)[cell]


def solve_screened(
    cells: CellGraph,
    data: Float32Array,
    weight: Float32Array,
    smoothness: float,
    *,
    tolerance: float = 1e-3,
    start: Float32Array | None = None,
) -> Float32Array:
    """Return the minimiser (N, C), one row for each cell in C order.

    Parameters
    ----------
    cells
        The cells that take part.
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
    count = len(cells)
    if data.shape[:1] != (count,) or weight.shape != (count,):
        raise InputError(
            f"diffusion of {count} cells got data {data.shape} and weights {weight.shape}"
        )
    if not (weight > 0).any():
        raise InputError("diffusion needs at least one cell with a weight above 0")
    guess = start if start is not None else _coarse_guess(cells, data, weight, smoothness)
    system = _System(cells.touching, weight + np.float32(smoothness) * cells.degree, smoothness)
    columns = [
        _conjugate_gradients(system, weight * column, start, tolerance)
        for column, start in zip(data.T, np.array(guess.T, np.float32, order="C"), strict=True)
    ]
    return np.stack(columns, axis=1)


def _coarse_guess(
    cells: CellGraph, data: Float32Array, weight: Float32Array, smoothness: float
) -> Float32Array:
    """Return (N, C) the solution on cells twice as large: nested iteration (Brandt 1977).

    Eight cells merge into one: weights add up, data average by weight, and the factor between
    neighbours doubles (four times the face, twice the distance).
    """
    if cells.coarser is None:
        mean = (weight[:, None] * data).sum(axis=0) / weight.sum()
        return np.broadcast_to(mean, data.shape).astype(np.float32)
    total = np.bincount(cells.block, weight)
    columns = [np.bincount(cells.block, weight * column) for column in data.T]
    mean = np.stack(columns, axis=1) / np.maximum(total, NO_WEIGHT)[:, None]
    solved = solve_screened(
        cells.coarser,
        mean.astype(np.float32),
        total.astype(np.float32),
        2 * smoothness,
        tolerance=COARSE_TOLERANCE,
    )
    return solved[cells.block]


def cell_neighbours(occupied: BoolArray) -> Int32Array:
    """Return (N, 6) rows of the neighbours -x, +x, -y, +y, -z, +z of occupied cells, or -1."""
    padded = np.pad(occupied, 1)
    cell = np.flatnonzero(padded)
    number = np.full(padded.size, -1, np.int32)
    number[cell] = np.arange(len(cell), dtype=np.int32)
    _, ny, nz = padded.shape
    return np.stack([number[cell + step] for step in (-ny * nz, ny * nz, -nz, nz, -1, 1)], axis=1)


class _System(NamedTuple):
    """The matrix (N, N) `diag(c) + s L` of the linear system."""

    touching: csr_matrix
    """(N, N) 1 where two cells share a face."""
    diagonal: Float32Array
    """(N,) weights and `s` times the number of neighbours."""
    smoothness: float

    def times(self, values: Float32Array) -> Float32Array:
        """Return the product with values (N,)."""
        product: Float32Array = self.touching @ values
        product *= np.float32(-self.smoothness)
        product += self.diagonal * values
        return product


def _conjugate_gradients(
    system: _System, right: Float32Array, solution: Float32Array, tolerance: float
) -> Float32Array:
    """Return the solution (N,) by Jacobi-preconditioned conjugate gradients from a guess.

    Algorithm B3 of Shewchuk 1994. `scipy.sparse.linalg.cg` does the same, but ends by the residual
    itself, see `solve_screened`.
    """
    diagonal = system.diagonal
    inverse = np.asarray(1 / np.where(diagonal > 0, diagonal, 1), np.float32)
    residual = right - system.times(solution)
    scaled = inverse * residual
    direction = scaled.copy()
    energy = _product(residual, scaled)
    enough = tolerance**2 * _product(inverse * right, inverse * right)
    for _ in range(MOST_ITERATIONS):
        if _product(scaled, scaled) <= enough:
            break
        image = system.times(direction)
        step = np.float32(energy / _product(direction, image))
        solution += step * direction
        residual -= step * image
        np.multiply(inverse, residual, out=scaled)
        before, energy = energy, _product(residual, scaled)
        direction *= np.float32(energy / before)
        direction += scaled
    return solution


def _product(first: Float32Array, second: Float32Array) -> float:
    """Return the scalar product of (N,), the same whatever the number of threads of BLAS."""
    return float(np.einsum("n,n", first, second, dtype=np.float64))
