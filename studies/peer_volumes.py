"""Peers of functions on volumes: diffusion, distances through cells, tensors, samples, filters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from typing import Any

import numpy as np
import numpy.typing as npt
from peer_cases import Case, largest, share_differing
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from hairkit.field.cell_shells import dilate_cells
from hairkit.field.diffusion import CellGraph, solve_screened
from hairkit.field.growth_prior import chamfer_distance
from hairkit.field.smooth_volume import smooth_volume
from hairkit.field.symmetric_eigen import smallest_eigenvectors
from hairkit.head_model.signed_distance import signed_distance
from hairkit.head_model.template import default_head
from hairkit.types.volume import VoxelGrid, symmetric_matrices

Array = npt.NDArray[Any]
_Solve = Callable[[Array, float], Array]
"""Solves a system for a right side (N,) to a relative residual."""
CELL = 0.003
"""Metres of a cell: that of a hull."""
THICKNESS = 0.04
"""Metres of the hair that lies around the head."""
COLUMNS = 6
"""Problems that are solved together: the numbers of a tensor."""
TOLERANCE = 1e-3
"""Of the residual of a solution."""
SIGMA = 2.0
"""Cells of the standard deviation of a filter."""


@lru_cache
def hair_cells(size: float) -> tuple[VoxelGrid, Array]:
    """Return a grid around the default head and the cells (X, Y, Z) of hair on it, a bob's."""
    grid = VoxelGrid.around([-0.14, -0.2, -0.15], [0.14, 0.16, 0.14], CELL / size ** (1 / 3))
    away = signed_distance(default_head(), grid)
    centres = grid.centres()
    behind = (centres[..., 2] < 0.02) | (centres[..., 1] > 0.05)
    return grid, (away > 0) & (away < THICKNESS) & behind


def diffusion(size: float) -> Iterator[Case]:
    """Tensors that a fifth of the cells know, diffused to all: the system of `solve_screened`."""
    _, occupied = hair_cells(size)
    rng, count = np.random.default_rng(0), int(occupied.sum())
    data = rng.normal(size=(count, COLUMNS)).astype(np.float32)
    known = rng.random(count) < 0.2
    weight = np.where(known, rng.uniform(0.1, 2, count), 0).astype(np.float32)

    def ours() -> Array:
        return solve_screened(CellGraph.of(occupied), data, weight, 1.0, tolerance=TOLERANCE)

    def by_columns(prepare: Callable[[Any], _Solve], rtol: float) -> Array:
        solve = prepare(_matrix(occupied, weight))
        return np.stack([solve(column, rtol) for column in (weight[:, None] * data).T], axis=1)

    matrix, right = _matrix(occupied, weight).astype(np.float64), weight[:, None] * data
    diagonal = matrix.diagonal()[:, None]

    def residual(solution: Array) -> float:
        """Return the largest relative residual of a column, in the norm of `solve_screened`."""
        left = np.linalg.norm((matrix @ solution - right) / diagonal, axis=0)
        return float((left / np.linalg.norm(right / diagonal, axis=0)).max())

    def reaching(prepare: Callable[[Any], _Solve]) -> Callable[[], Array]:
        """Return the solver with the largest tolerance of a row of them that is enough."""
        rtol, wanted = 16 * TOLERANCE, residual(ours())
        while residual(by_columns(prepare, rtol)) > wanted:
            rtol *= 0.8
        return lambda: by_columns(prepare, rtol)

    peers = {"`scipy.sparse.linalg.cg`, Jacobi": _scipy_cg, "pyamg, smoothed aggregation": _pyamg}
    yield Case(
        "`solve_screened`",
        f"{count:,} cells, {COLUMNS} columns",
        ours,
        {name: _once(partial(reaching, prepare)) for name, prepare in peers.items()},
        lambda _, theirs: residual(theirs),
        f"residual (ours {residual(ours()):.2g})",
        TOLERANCE,
    )


def _matrix(occupied: Array, weight: Array) -> Any:
    """Return the float32 matrix (N, N) of the system, of smoothness 1."""
    cells = CellGraph.of(occupied)
    return (sparse.diags(weight + cells.degree) - cells.touching).tocsr()


def _once(make: Callable[[], Callable[[], Array]]) -> Callable[[], Array]:
    """Return a function that makes another one when it is first called, and calls that."""
    made: list[Callable[[], Array]] = []

    def run() -> Array:
        if not made:
            made.append(make())
        return made[0]()

    return run


def _scipy_cg(matrix: Any) -> _Solve:
    from scipy.sparse.linalg import cg

    inverse = sparse.diags(1 / np.maximum(matrix.diagonal(), 1e-6))
    return lambda right, rtol: cg(matrix, right, rtol=rtol, atol=0.0, M=inverse)[0]


def _pyamg(matrix: Any) -> _Solve:
    import pyamg

    solver = pyamg.smoothed_aggregation_solver(matrix.astype(np.float64), max_coarse=500)
    return lambda right, rtol: solver.solve(right.astype(np.float64), tol=rtol, accel="cg")


def ways_through_cells(size: float) -> Iterator[Case]:
    """Lengths of the shortest ways from the scalp through the cells of hair."""
    grid, occupied = hair_cells(size)
    start = dilate_cells(signed_distance(default_head(), grid) <= 0, 1) & occupied

    def dijkstra() -> Array:
        index = np.full(np.add(occupied.shape, 2), -1)
        index[1:-1, 1:-1, 1:-1][occupied] = np.arange(occupied.sum())
        rows, columns, costs = [], [], []
        for step in np.argwhere(np.ones((3, 3, 3))) - 1:
            if step.any():
                to = np.roll(index, tuple(-step), (0, 1, 2))
                both = (index >= 0) & (to >= 0)
                rows.append(index[both])
                columns.append(to[both])
                costs.append(np.full(both.sum(), np.linalg.norm(step) * grid.spacing))
        pairs = np.concatenate(rows), np.concatenate(columns)
        graph = sparse.csr_matrix((np.concatenate(costs), pairs), shape=2 * (occupied.sum(),))
        first = np.flatnonzero(start[occupied])
        result = np.full(occupied.shape, np.inf)
        result[occupied] = csgraph.dijkstra(graph, indices=first, min_only=True)
        return result

    def cheapest_ways() -> Array:
        from skimage.graph import MCP_Geometric

        cost = np.where(occupied, 1.0, -1.0)
        ways = MCP_Geometric(cost, sampling=3 * (grid.spacing,), fully_connected=True)
        return np.asarray(ways.find_costs(np.argwhere(start))[0])

    yield Case(
        "`chamfer_distance`",
        f"{occupied.sum():,} cells",
        lambda: chamfer_distance(occupied, start, grid.spacing),
        {
            "`scipy.sparse.csgraph.dijkstra`": dijkstra,
            "scikit-image `MCP_Geometric`": cheapest_ways,
        },
        lambda ours, theirs: 1e3 * largest(ours, theirs),
        "mm",
        0.01,
    )


def eigenvectors(size: float) -> Iterator[Case]:
    """Directions of the smallest eigenvalue of tensors."""
    tensors = np.random.default_rng(0).normal(size=(int(200_000 * size), 6))
    full = symmetric_matrices(tensors)

    def apart(ours: Array, theirs: Array) -> float:
        return float(np.degrees(np.arcsin(np.linalg.norm(np.cross(ours, theirs), axis=1)).max()))

    yield Case(
        "`smallest_eigenvectors`",
        f"{len(tensors):,} tensors",
        lambda: smallest_eigenvectors(tensors)[0],
        {"`numpy.linalg.eigh`": lambda: np.linalg.eigh(full)[1][:, :, 0]},
        apart,
        "degrees",
        1e-3,
    )


def samples(size: float) -> Iterator[Case]:
    """Tensors of a grid at points between its cells."""
    grid, _ = hair_cells(size)
    rng, high = np.random.default_rng(0), grid.spacing * np.array(grid.shape)
    values = rng.normal(size=(*grid.shape, COLUMNS)).astype(np.float32)
    points = grid.origin + rng.uniform(0, high, (int(200_000 * size), 3))

    def scipy_samples() -> Array:
        at = grid.index_from_head(points).T
        columns = np.moveaxis(values, -1, 0)
        found = [ndimage.map_coordinates(c, at, order=1, mode="nearest") for c in columns]
        return np.stack(found, axis=1)

    yield Case(
        "`VoxelGrid.sample`",
        f"{len(points):,} points of {COLUMNS} numbers",
        lambda: grid.sample(values, points),
        {"`scipy.ndimage.map_coordinates`": scipy_samples},
        largest,
        "",
        1e-4,
    )


def filters(size: float) -> Iterator[Case]:
    """A volume under a Gaussian, and cells grown over their faces."""
    _, occupied = hair_cells(size)
    values, cells = occupied.astype(np.float32), f"{occupied.size:,} cells"
    yield Case(
        "`smooth_volume`",
        cells,
        lambda: smooth_volume(values, SIGMA),
        {"`scipy.ndimage.gaussian_filter`": lambda: ndimage.gaussian_filter(values, SIGMA)},
        largest,
        "",
        1e-5,
    )
    yield Case(
        "`dilate_cells`",
        cells,
        lambda: dilate_cells(occupied, 2),
        {
            "`scipy.ndimage.binary_dilation`": lambda: ndimage.binary_dilation(
                occupied, iterations=2
            )
        },
        share_differing,
        "% of the cells",
        0.0,
    )


CASES: list[Callable[[float], Iterator[Case]]] = [
    diffusion,
    ways_through_cells,
    eigenvectors,
    samples,
    filters,
]
"""Functions of the size of the input, 1 for the usual one."""
