"""Laws of helix arcs."""

from __future__ import annotations

import numpy as np
import pytest
from helix_slopes import mean_rotation_slope, turn_slopes
from scipy.integrate import solve_ivp

from hairkit.helices.helix import (
    along_arc,
    mean_rotation,
    rotation,
    turn_coefficients,
)


@pytest.mark.parametrize("turn", [1e-9, 1e-3, 0.7, 0.999999, 1.000001, 3.0, 9.0])
def test_an_arc_is_the_solution_of_its_equation(turn: float, rng: np.random.Generator) -> None:
    """Closed form, and series near zero curvature, agree with t' = w x t, p' = t to 1e-10."""
    tangent = np.linalg.qr(rng.normal(size=(3, 3)))[0][0]
    darboux = rng.normal(size=3)
    darboux *= turn / np.linalg.norm(darboux)

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([state[3:], np.cross(darboux, state[3:])])

    done = solve_ivp(slope, (0, 1), np.r_[0, 0, 0, tangent], "DOP853", rtol=3e-14, atol=1e-15)
    point, end = along_arc(np.zeros(3), tangent, darboux, 1.0)
    np.testing.assert_allclose(np.r_[point, end], done.y[:, -1], rtol=0, atol=1e-10)


def test_series_and_closed_forms_meet() -> None:
    """Coefficients and their slopes have no step where the series hands over."""
    below, above = np.nextafter(1.0, 0), np.nextafter(1.0, 2)
    for function in (turn_coefficients, turn_slopes):
        np.testing.assert_allclose(function(below), function(above), rtol=5e-15)


def test_no_turn_at_all_is_straight() -> None:
    """At zero curvature everything is finite and exact."""
    np.testing.assert_array_equal(rotation(np.zeros(3)), np.eye(3))
    np.testing.assert_array_equal(mean_rotation(np.zeros(3)), np.eye(3))
    assert np.isfinite(mean_rotation_slope(np.zeros(3), [1.0, 0, 0])).all()


@pytest.mark.parametrize("size", [0.0, 1e-4, 0.5, 2.0, 7.0])
def test_slope_of_the_mean_rotation(size: float, rng: np.random.Generator) -> None:
    """The derivative equals central differences."""
    vector, direction = rng.normal(size=3), rng.normal(size=3)
    vector *= size / np.linalg.norm(vector)
    step = 1e-5
    columns = [
        (mean_rotation(vector + step * e) - mean_rotation(vector - step * e)) @ direction
        for e in np.eye(3)
    ]
    expected = np.stack(columns, axis=-1) / (2 * step)
    np.testing.assert_allclose(mean_rotation_slope(vector, direction), expected, atol=1e-9)


def test_the_mean_rotation_is_the_jacobian_of_the_rotation(rng: np.random.Generator) -> None:
    """rotation(v + dv) = (1 + [mean_rotation(v) dv]x) rotation(v) to first order."""
    vector, step = rng.normal(size=3), 1e-6 * rng.normal(size=3)
    change = (rotation(vector + step) - rotation(vector - step)) @ rotation(vector).T / 2
    spin = np.array([change[2, 1], change[0, 2], change[1, 0]])
    np.testing.assert_allclose(spin, mean_rotation(vector) @ step, rtol=0, atol=1e-14)


def test_a_helix_has_its_radius_and_pitch() -> None:
    """Position about the axis matches the textbook helix, right-handed for positive torsion."""
    radius, pitch = 0.007, 0.03
    angle = np.linspace(0, 9, 40)
    curve = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), pitch * angle / (2 * np.pi)]
    )
    rise = pitch / (2 * np.pi)
    speed = np.hypot(radius, rise)
    points, tangents = along_arc(
        curve[0], np.array([0, radius, rise]) / speed, np.array([0, 0, 1 / speed]), angle * speed
    )
    np.testing.assert_allclose(points, curve, rtol=0, atol=1e-15)
    flow = np.column_stack([-curve[:, 1], curve[:, 0], np.full(len(curve), rise)]) / speed
    np.testing.assert_allclose(tangents, flow, rtol=0, atol=1e-12)
