"""Laws of thin-plate splines: side conditions, affine maps, least bending, smoothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.arrays import Float64Array
from hairkit.errors import DataError, InputError
from hairkit.head_model.thin_plate_spline import ThinPlateSpline


def _phi(distance: Float64Array, dimension: int) -> Float64Array:
    if dimension == 3:
        return -distance
    return np.where(distance > 0, distance**2 * np.log(np.maximum(distance, 1e-300)), 0.0)


def _solve(
    places: Float64Array, values: Float64Array, smoothing: float
) -> tuple[Float64Array, Float64Array]:
    """Weights a and affine part of the dense system of Bookstein's equation (7), unscaled."""
    count, dimension = places.shape
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    kernel = _phi(apart, dimension) + smoothing * np.eye(count)
    affine = np.column_stack([np.ones(count), places])
    zero = np.zeros((dimension + 1, dimension + 1))
    system = np.block([[kernel, affine], [affine.T, zero]])
    solved = np.linalg.solve(
        system, np.vstack([values, np.zeros((dimension + 1, values.shape[1]))])
    )
    return solved[:count], solved[count:]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([2, 3]), st.sampled_from([0.0, 1e-3, 0.1]))
def test_it_is_the_closed_form(seed: int, dimension: int, smoothing: float) -> None:
    """Values are those of the dense system, whose weights meet the side conditions."""
    generator = np.random.default_rng(seed)
    places = generator.uniform(-1, 1, (20, dimension))
    values = generator.normal(0, 1, (20, 3))
    weights, affine = _solve(places, values, smoothing)
    np.testing.assert_allclose(weights.sum(axis=0), 0, atol=1e-8 * np.abs(weights).sum())
    np.testing.assert_allclose(places.T @ weights, 0, atol=1e-8 * np.abs(weights).sum())
    points = generator.uniform(-1, 1, (30, dimension))
    apart = np.linalg.norm(points[:, None] - places[None], axis=-1)
    wanted = _phi(apart, dimension) @ weights + np.column_stack([np.ones(30), points]) @ affine
    found = ThinPlateSpline(places, values, smoothing)(points)
    np.testing.assert_allclose(found, wanted, atol=1e-6 * (1 + np.abs(wanted).max()))


@pytest.mark.parametrize("dimension", [2, 3])
def test_it_goes_through_its_values_and_keeps_affine_maps(dimension: int) -> None:
    """Without smoothing each value is met; of an affine map everything is, at any smoothing."""
    generator = np.random.default_rng(2)
    places = generator.uniform(-1, 1, (15, dimension))
    values = generator.normal(0, 1, (15, 2))
    np.testing.assert_allclose(ThinPlateSpline(places, values)(places), values, atol=1e-9)
    matrix = generator.normal(0, 1, (dimension, 2))
    points = generator.uniform(-2, 2, (9, dimension))
    for smoothing in (0.0, 0.5, 100.0):
        spline = ThinPlateSpline(places, places @ matrix + 0.3, smoothing)
        np.testing.assert_allclose(spline(points), points @ matrix + 0.3, atol=1e-7)


def test_large_smoothing_is_least_squares() -> None:
    """As lambda grows the spline becomes the affine map of least squares."""
    generator = np.random.default_rng(3)
    places = generator.uniform(-1, 1, (40, 3))
    values = generator.normal(0, 1, (40, 1))
    columns = np.column_stack([np.ones(40), places])
    wanted = columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    np.testing.assert_allclose(ThinPlateSpline(places, values, 1e7)(places), wanted, atol=1e-5)


def test_turning_places_and_values_turns_the_map() -> None:
    """The kernel depends on distance alone: a rotation before and after is no difference."""
    generator = np.random.default_rng(4)
    places, values = generator.uniform(-1, 1, (2, 12, 3))
    turn = np.linalg.qr(generator.normal(0, 1, (3, 3)))[0]
    points = generator.uniform(-1, 1, (7, 3))
    plain = ThinPlateSpline(places, values, 0.01)(points)
    turned = ThinPlateSpline(places @ turn.T, values @ turn.T, 0.01)(points @ turn.T)
    np.testing.assert_allclose(turned, plain @ turn.T, atol=1e-9)


def test_places_that_fix_no_map_are_refused() -> None:
    """Points in a plane, four dimensions, a place twice and negative smoothing are one line."""
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    with pytest.raises(InputError, match="one plane"):
        ThinPlateSpline(square, square)
    with pytest.raises(InputError, match="4 dimensions"):
        ThinPlateSpline(np.zeros((5, 4)), np.zeros((5, 1)))
    corners = np.vstack([square[:3], [[0, 0, 1]], [[0, 0, 1]]])
    with pytest.raises(InputError, match="same place twice"):
        ThinPlateSpline(corners, corners)
    with pytest.raises(InputError, match="smoothing"):
        ThinPlateSpline(corners, corners, -1.0)
    with pytest.raises(DataError):
        ThinPlateSpline(corners, corners[:2])
