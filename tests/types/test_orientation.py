"""Laws of undirected angles in a picture."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import InputError
from hairkit.types.orientation import OrientationMap, angle_between, wrap_angle

angles = st.floats(-100.0, 100.0)


@given(angles)
def test_wrapping_keeps_the_line(angle: float) -> None:
    """The wrapped angle lies in [0, pi) and belongs to the same undirected line."""
    wrapped = wrap_angle([angle])
    assert wrapped.dtype == np.float32
    assert 0 <= wrapped[0] < np.float32(np.pi)
    assert angle_between(wrapped[0], angle) < 1e-5


@pytest.mark.parametrize("angle", [np.pi, -1e-12, np.nextafter(np.pi, 0), -np.pi, 0.0])
def test_wrapping_never_gives_pi(angle: float) -> None:
    """Rounding to float32 cannot bring the open end back in."""
    OrientationMap(wrap_angle([[angle]]), np.ones((1, 1), np.float32))


@given(angles, angles, st.integers(-3, 3))
def test_the_angle_between_lines_has_no_direction(a: float, b: float, turns: int) -> None:
    """It is symmetric, within [0, pi/2], 0 to itself, and half turns do not change it."""
    gap = angle_between(a, b)
    assert 0 <= gap <= np.pi / 2
    assert angle_between(b, a) == pytest.approx(gap, abs=1e-9)
    assert angle_between(a + turns * np.pi, b) == pytest.approx(gap, abs=1e-9)
    assert angle_between(a, a) == 0


@pytest.mark.parametrize(
    ("angle", "confidence"),
    [(np.pi, 1.0), (-0.1, 1.0), (1.0, 1.1), (1.0, -0.1), (np.nan, 1.0), (1.0, np.nan)],
)
def test_values_out_of_range_are_refused(angle: float, confidence: float) -> None:
    """Angles lie in [0, pi), confidences in [0, 1], all finite."""
    with pytest.raises(InputError):
        OrientationMap(np.full((2, 2), angle, np.float32), np.full((2, 2), confidence, np.float32))


def test_angle_and_confidence_have_one_size() -> None:
    """A confidence of another picture is refused."""
    with pytest.raises(InputError, match="confidence"):
        OrientationMap(np.zeros((2, 2), np.float32), np.zeros((2, 3), np.float32))
