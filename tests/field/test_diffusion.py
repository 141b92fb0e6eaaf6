"""Laws of screened diffusion."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.arrays import BoolArray, Float32Array, Int32Array
from hairkit.errors import InputError
from hairkit.field.diffusion import CellGraph, cell_neighbours, solve_screened


def porous(shape: tuple[int, int, int], filled: float, seed: int = 0) -> BoolArray:
    """A block with random holes."""
    return np.random.default_rng(seed).random(shape) < filled


def problem(
    occupied: BoolArray, columns: int = 2, known: float = 0.3, seed: int = 1
) -> tuple[Float32Array, Float32Array]:
    """Random data, with weights at a random part of the cells."""
    rng = np.random.default_rng(seed)
    count = np.count_nonzero(occupied)
    weight = np.where(rng.random(count) < known, rng.uniform(0.1, 2, count), 0)
    return rng.normal(size=(count, columns)).astype(np.float32), weight.astype(np.float32)


def beam(length: int) -> tuple[BoolArray, Float32Array, Float32Array]:
    """A beam along x whose one end is fixed at 0, the other at 1; nothing is known between."""
    occupied = np.ones((length, 2, 2), bool)
    end = np.repeat(np.arange(length), 4)
    weight = np.where((end == 0) | (end == length - 1), 1e3, 0).astype(np.float32)
    return occupied, (end == length - 1)[:, None].astype(np.float32), weight


def apply_operator(
    neighbours: Int32Array, weight: npt.NDArray[Any], smoothness: float, values: npt.NDArray[Any]
) -> npt.NDArray[Any]:
    """Return `(diag(c) + s L) u` for `values` (N, C): the compiled operator's readable twin."""
    padded = np.concatenate([values, np.zeros_like(values[:1])])
    degree = (neighbours >= 0).sum(axis=1)[:, None]
    total = sum(padded[neighbours[:, k]] for k in range(6))
    result: npt.NDArray[Any] = weight[:, None] * values + smoothness * (degree * values - total)
    return result


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
@pytest.mark.parametrize("size", [9, 22])
def test_the_solution_solves_the_linear_system(size: int, tolerance: float) -> None:
    """The readable operator, applied to the result, gives `c d` to the tolerance, column by column.

    The larger block is started from a coarser grid.
    """
    occupied = porous((size, size + 2, size + 1), 0.8)
    data, weight = problem(occupied, columns=3)
    solved = solve_screened(CellGraph.of(occupied), data, weight, 0.7, tolerance=tolerance)
    wanted = weight[:, None].astype(np.float64) * data
    left = apply_operator(cell_neighbours(occupied), weight, 0.7, solved.astype(np.float64))
    residual = np.linalg.norm(left - wanted, axis=0) / np.linalg.norm(wanted, axis=0)
    assert (residual < 1.2 * tolerance).all()


def test_the_solution_is_that_of_a_direct_solver() -> None:
    """On a small block the dense system, built column by column, has the same answer."""
    occupied = porous((5, 4, 6), 0.9)
    data, weight = problem(occupied, known=0.5)
    identity = np.eye(len(data))
    matrix = apply_operator(cell_neighbours(occupied), weight, 0.4, identity)
    np.testing.assert_allclose(matrix, matrix.T)
    alone = (np.abs(matrix).sum(axis=1) == 0)[:, None]  # a cell without neighbours or data
    wanted = np.linalg.lstsq(matrix, weight[:, None].astype(np.float64) * data, rcond=None)[0]
    solved = solve_screened(CellGraph.of(occupied), data, weight, 0.4, tolerance=1e-6)
    np.testing.assert_allclose(np.where(alone, 0, solved), np.where(alone, 0, wanted), atol=1e-3)


@given(st.floats(-100, 100), st.floats(1e-2, 10))
@settings(max_examples=10)
def test_constants_are_reproduced(constant: float, smoothness: float) -> None:
    """Where all data agree, every cell gets that value, whatever the smoothness."""
    occupied = np.ones((6, 7, 8), bool)
    _, weight = problem(occupied, known=0.1)
    data = np.full((len(weight), 1), constant, np.float32)
    solved = solve_screened(CellGraph.of(occupied), data, weight, smoothness, tolerance=1e-5)
    np.testing.assert_allclose(solved, constant, atol=1e-3 * abs(constant) + 1e-6)


def test_heavy_cells_keep_their_values_and_the_rest_stays_in_their_range() -> None:
    """Cells of huge weight are fixed; between them is no new maximum or minimum."""
    occupied = porous((12, 12, 12), 0.9, seed=4)
    data, weight = problem(occupied, known=0.15)
    fixed = weight > 0
    weight[fixed] = 1e5
    solved = solve_screened(CellGraph.of(occupied), data, weight, 0.5, tolerance=1e-7)
    np.testing.assert_allclose(solved[fixed], data[fixed], atol=1e-3)
    low, high = data[fixed].min(axis=0), data[fixed].max(axis=0)
    assert (solved > low - 1e-3).all()
    assert (solved < high + 1e-3).all()


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_between_two_fixed_ends_values_run_straight(tolerance: float) -> None:
    """The harmonic function on a beam is linear."""
    occupied, data, weight = beam(40)
    solved = solve_screened(CellGraph.of(occupied), data, weight, 0.4, tolerance=tolerance)
    wanted = np.repeat(np.linspace(0, 1, 40), 4)
    np.testing.assert_allclose(solved[:, 0], wanted, atol=0.01)


def test_scaling_weights_and_smoothness_together_changes_nothing() -> None:
    """Only their ratio matters."""
    occupied = porous((8, 8, 8), 0.9)
    data, weight = problem(occupied)
    first = solve_screened(CellGraph.of(occupied), data, weight, 0.5, tolerance=1e-5)
    second = solve_screened(CellGraph.of(occupied), data, 8 * weight, 4.0, tolerance=1e-6)
    np.testing.assert_allclose(first, second, atol=1e-3)


def test_turning_the_block_turns_the_solution() -> None:
    """Swapping axes of mask and data swaps those of the result."""
    occupied = porous((7, 9, 11), 0.9)
    data, weight = problem(occupied, columns=1)
    volume = np.zeros((2, *occupied.shape), np.float32)
    volume[0][occupied], volume[1][occupied] = data[:, 0], weight
    turned, turned_volume = occupied.transpose(2, 0, 1), volume.transpose(0, 3, 1, 2)
    straight = solve_screened(CellGraph.of(occupied), data, weight, 0.5, tolerance=1e-5)
    other = solve_screened(
        CellGraph.of(turned),
        turned_volume[0][turned][:, None],
        turned_volume[1][turned],
        0.5,
        tolerance=1e-5,
    )
    result = np.zeros(occupied.shape, np.float32)
    result[occupied] = straight[:, 0]
    np.testing.assert_allclose(result.transpose(2, 0, 1)[turned], other[:, 0], atol=1e-3)


def test_a_good_start_needs_no_iteration_and_a_bad_one_no_luck() -> None:
    """A start at the solution is returned as it is; from elsewhere the same place is reached."""
    occupied = np.ones((8, 8, 8), bool)
    data, weight = problem(occupied)
    solved = solve_screened(CellGraph.of(occupied), data, weight, 0.5, tolerance=1e-5)
    again = solve_screened(CellGraph.of(occupied), data, weight, 0.5, tolerance=1e-2, start=solved)
    np.testing.assert_allclose(again, solved, atol=1e-4)
    far = np.full_like(solved, 50.0)
    found = solve_screened(CellGraph.of(occupied), data, weight, 0.5, tolerance=1e-5, start=far)
    np.testing.assert_allclose(found, solved, atol=1e-3)
    assert (far == 50).all()


@pytest.mark.parametrize("size", [4, 16])
def test_parts_without_data_stay_in_the_range_of_the_others(size: int) -> None:
    """Two blocks that do not touch: where nothing is known values are no new extremes."""
    occupied = np.ones((2 * size + 2, size, size), bool)
    occupied[size : size + 2] = False
    data, weight = problem(occupied, columns=1)
    weight[len(weight) // 2 :] = 0
    solved = solve_screened(CellGraph.of(occupied), data, weight, 0.5, tolerance=1e-4)
    known = data[weight > 0]
    assert np.isfinite(solved).all()
    assert known.min() - 1e-3 <= solved.min()
    assert solved.max() <= known.max() + 1e-3


@given(st.integers(0, 1000), st.floats(0.1, 1))
def test_neighbours_are_mutual_and_one_cell_away(seed: int, filled: float) -> None:
    """The neighbour of my neighbour across the same face is me; none is missed."""
    occupied = porous((4, 5, 3), filled, seed)
    occupied[0, 0, 0] = True
    neighbours = cell_neighbours(occupied)
    cells = np.argwhere(occupied)
    for k in range(6):
        rows = np.flatnonzero(neighbours[:, k] >= 0)
        other = neighbours[rows, k]
        np.testing.assert_array_equal(neighbours[other, k ^ 1], rows)
        step = np.zeros(3, int)
        step[k // 2] = 1 if k % 2 else -1
        np.testing.assert_array_equal(cells[other] - cells[rows], np.tile(step, (len(rows), 1)))
    touching = sum(
        np.count_nonzero(occupied & np.roll(np.pad(occupied, 1), 1, axis)[1:-1, 1:-1, 1:-1])
        for axis in range(3)
    )
    assert (neighbours >= 0).sum() == 2 * touching


def test_shapes_that_disagree_and_data_without_weight_are_refused() -> None:
    """One line says which shapes came, or that nothing is known."""
    occupied = np.ones((2, 2, 2), bool)
    data, weight = np.zeros((8, 1), np.float32), np.ones(8, np.float32)
    with pytest.raises(InputError, match=r"8 cells got data \(7, 1\)"):
        solve_screened(CellGraph.of(occupied), data[:7], weight, 1.0)
    with pytest.raises(InputError, match=r"weights \(9,\)"):
        solve_screened(CellGraph.of(occupied), data, np.ones(9, np.float32), 1.0)
    with pytest.raises(InputError, match="a weight above 0"):
        solve_screened(CellGraph.of(occupied), data, 0 * weight, 1.0)
