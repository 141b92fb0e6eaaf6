"""Laws of the compiled look-ups in volumes."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit import VoxelGrid
from hairkit.field.sampling_kernels import gradient_at, make_unit, principal_direction, sample_at
from hairkit.types.volume import outer_products

GRID = VoxelGrid(np.array([-0.1, 0.2, 0.0]), 0.01, (7, 9, 8))


def test_sample_equals_its_numpy_twin(rng: np.random.Generator) -> None:
    """Trilinear samples are those of `VoxelGrid.sample`, inside the grid and beyond its border."""
    values = rng.normal(size=(*GRID.shape, 3)).astype(np.float32)
    points = GRID.origin + rng.uniform(-0.02, 0.11, (200, 3))
    found = np.empty((200, 3))
    for row, point in zip(found, points, strict=True):
        sample_at(GRID.origin, GRID.spacing, values, point, row)
    np.testing.assert_allclose(found, GRID.sample(values, points), atol=1e-2)
    inside = np.all((points > GRID.origin) & (points < GRID.origin + 0.06), axis=1)
    np.testing.assert_allclose(found[inside], GRID.sample(values, points)[inside], atol=1e-5)


def test_gradient_of_a_linear_function_is_its_direction() -> None:
    """The gradient of a . x is a / |a| wherever the grid does not end."""
    direction = np.array([2.0, -1.0, 0.5])
    values = (GRID.centres() @ direction.astype(np.float32))[..., None].astype(np.float32)
    found = np.empty(3)
    gradient_at(GRID.origin, GRID.spacing, values, GRID.origin + 0.035, found)
    np.testing.assert_allclose(found, direction / np.linalg.norm(direction), atol=1e-4)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_principal_direction_is_the_eigenvector_on_the_side_of_the_start(
    rng: np.random.Generator, sign: float
) -> None:
    """Power iteration finds the largest eigenvector, pointing the way the strand came."""
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    tensor = outer_products(axis) + 0.01 * outer_products(np.array([1.0, 0.0, 0.0]))
    start = sign * axis + 0.2 * rng.normal(size=3)
    found = np.empty(3)
    assert principal_direction(tensor, start / np.linalg.norm(start), found)
    assert found @ start > 0
    assert abs(found @ axis) > 0.999


def test_nothing_has_no_direction() -> None:
    """A vanishing tensor or vector is reported, not divided by."""
    found = np.zeros(3)
    assert not principal_direction(np.zeros(6), np.array([0.0, 1.0, 0.0]), found)
    assert not make_unit(found)
