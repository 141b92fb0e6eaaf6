"""Laws of grids, hulls and fields."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit import testing
from hairkit.errors import InputError
from hairkit.types import volume
from hairkit.types.volume import (
    TENSOR_INDICES,
    VoxelGrid,
    cell_slopes,
    outer_products,
    symmetric_matrices,
)

vectors = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array)


@st.composite
def grids(draw: st.DrawFn) -> VoxelGrid:
    """Any small grid."""
    shape = draw(st.tuples(*[st.integers(1, 6)] * 3))
    return VoxelGrid(draw(vectors), draw(st.floats(0.001, 0.5)), shape)


@given(grids())
def test_centres_have_whole_indices(grid: VoxelGrid) -> None:
    """The centre of cell (i, j, k) is at index (i, j, k) and in that cell."""
    wanted = np.stack(np.indices(grid.shape), axis=-1)
    centres = grid.centres()
    assert centres.shape == (*grid.shape, 3)
    # float32 centres: 1e-7 of a coordinate up to 4 m, in cells of at least 1 mm
    np.testing.assert_allclose(grid.index_from_head(centres), wanted, atol=1e-3)
    np.testing.assert_array_equal(grid.nearest_cell(centres), wanted)


@given(vectors, vectors, st.floats(0.01, 1))
def test_a_grid_around_a_box_covers_it_tightly(a: np.ndarray, b: np.ndarray, step: float) -> None:
    """The box is inside, and one layer of cells less would not hold it."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    grid = VoxelGrid.around(low, high, step)
    end = grid.origin + np.array(grid.shape) * step
    assert (end >= high - 1e-9).all()
    assert ((end - step < high + 1e-9) | (np.array(grid.shape) == 1)).all()


@given(grids(), vectors, st.floats(-1, 1), st.integers(0, 2**32 - 1))
def test_sampling_is_exact_for_what_is_linear(
    grid: VoxelGrid, slope: np.ndarray, offset: float, seed: int
) -> None:
    """Between cell centres a linear function is met exactly, scalar or of several channels."""
    centres = grid.centres().astype(float)
    values = (centres @ slope + offset).astype(np.float32)
    t = np.random.default_rng(seed).random((20, 3))
    points = centres[0, 0, 0] + t * (centres[-1, -1, -1] - centres[0, 0, 0])
    np.testing.assert_allclose(grid.sample(values, points), points @ slope + offset, atol=1e-5)
    both = grid.sample(np.stack([values, -values], axis=-1), points)
    np.testing.assert_allclose(both[:, 0], -both[:, 1])


@given(grids(), st.integers(0, 2**32 - 1))
def test_sampling_stays_in_the_range(grid: VoxelGrid, seed: int) -> None:
    """No sample, inside or outside the grid, leaves the range of the values."""
    generator = np.random.default_rng(seed)
    values = generator.random(grid.shape, np.float32)
    points = grid.origin + generator.uniform(-2, 8, (50, 3)) * grid.spacing
    samples = grid.sample(values, points)
    assert samples.min() >= values.min() - 1e-6
    assert samples.max() <= values.max() + 1e-6


def test_many_points_are_sampled_as_few_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many points are sampled at a time, each has the same bytes."""
    random = np.random.default_rng(0)
    grid = VoxelGrid(np.zeros(3), 0.5, (4, 5, 6))
    values, points = random.random((*grid.shape, 2), np.float32), random.uniform(0, 3, (50, 3))
    whole = grid.sample(values, points)
    monkeypatch.setattr(volume, "SAMPLED_AT_ONCE", 7)
    assert np.array_equal(grid.sample(values, points), whole)


@given(st.lists(vectors, min_size=1, max_size=5).map(np.array))
def test_six_components_are_the_outer_product(directions: np.ndarray) -> None:
    """Packing d d^T and unpacking it gives d d^T; the sign of d is lost, nothing else."""
    six = outer_products(directions)
    wanted = directions[:, :, None] * directions[:, None, :]
    np.testing.assert_allclose(symmetric_matrices(six), wanted)
    np.testing.assert_array_equal(six, outer_products(-directions))
    assert TENSOR_INDICES[3:] == ((0, 1), (0, 2), (1, 2))


@pytest.mark.parametrize(
    ("spacing", "shape"), [(0.0, (2, 2, 2)), (-1.0, (2, 2, 2)), (1.0, (2, 0, 2)), (1.0, (2, 2))]
)
def test_impossible_grids_are_refused(spacing: float, shape: tuple[int, ...]) -> None:
    """Spacing and three sizes are above 0."""
    with pytest.raises(InputError, match="grid"):
        VoxelGrid(np.zeros(3), spacing, shape)


def test_grids_too_large_for_a_laptop_are_refused() -> None:
    """More than 400^3 cells are an error that names the cure, not a full memory."""
    VoxelGrid(np.zeros(3), 1.0, (400, 400, 400))
    with pytest.raises(InputError, match="use a larger voxel size"):
        VoxelGrid(np.zeros(3), 1.0, (401, 400, 400))
    with pytest.raises(InputError, match="use a larger voxel size"):
        VoxelGrid.around(np.zeros(3), np.ones(3), 1e-9)


def test_a_hull_has_hair_and_its_dense_part_is_loose() -> None:
    """An empty hull says what to check; dense cells outside the loose ones are refused."""
    hull = testing.shell_hull(0.03)
    assert (hull.loose | ~hull.dense).all()
    with pytest.raises(InputError, match=r"the hull is empty.*check masks and cameras"):
        replace(hull, dense=np.zeros_like(hull.dense))
    with pytest.raises(InputError, match="every dense cell must be a loose cell"):
        replace(hull, loose=np.zeros_like(hull.loose))


def test_fields_must_fit_their_grid() -> None:
    """A tensor, confidence or growth of another shape is refused by name."""
    field = testing.combed_field(testing.shell_hull(0.03).grid)
    for name in ("tensor", "confidence", "growth"):
        with pytest.raises(InputError, match=name):
            replace(field, **{name: getattr(field, name)[1:]})
    with pytest.raises(InputError, match="neither tensor nor direction"):
        replace(field, tensor=None)


def test_a_field_of_directions_has_their_tensors() -> None:
    """Whatever their length, and zeros where there is none; given tensors are returned."""
    field = testing.combed_field(testing.shell_hull(0.03).grid)
    assert field.tensors() is field.tensor
    direction = np.random.default_rng(7).normal(size=(*field.grid.shape, 3)).astype(np.float32)
    direction[0] = 0.0
    signed = replace(field, tensor=None, direction=direction)
    tensors = symmetric_matrices(signed.tensors())
    assert not tensors[0].any()
    np.testing.assert_allclose(np.trace(tensors[1:], axis1=-2, axis2=-1), 1, atol=1e-6)
    along = direction[1:] / np.linalg.norm(direction[1:], axis=-1, keepdims=True)
    turned = np.einsum("...ij,...j->...i", tensors[1:], along)
    np.testing.assert_allclose(turned, along, atol=1e-6)


def test_slopes_of_marked_cells_are_those_of_all_cells() -> None:
    """At the grid's border as well, where differences are one-sided."""
    rng = np.random.default_rng(2)
    values = rng.normal(size=(4, 5, 3)).astype(np.float32)
    marked = rng.random(values.shape) < 0.6
    marked[0, 0, 0] = marked[-1, -1, -1] = True
    np.testing.assert_allclose(
        cell_slopes(values, marked), cell_slopes(values)[marked], rtol=1e-6, atol=1e-6
    )
