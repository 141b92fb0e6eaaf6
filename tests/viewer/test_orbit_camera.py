"""Laws of the view: what the mouse does can be undone, all of the hair is seen from anywhere."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.viewer.orbit_camera import OrbitView

angles = st.floats(-170, 170)
slopes = st.floats(-80, 80)


@given(angles, slopes, st.floats(0.4, 3.0))
def test_a_framed_cloud_is_seen_whole_from_anywhere(
    azimuth: float, elevation: float, aspect: float
) -> None:
    """Every point lies inside the picture, whatever the direction and the picture's shape."""
    cloud = np.random.default_rng(3).uniform((-0.1, -0.5, -0.2), (0.2, 0.1, 0.1), (60, 3))
    view = OrbitView.around(cloud, aspect).orbited(azimuth, elevation)
    camera = view.camera(round(600 * aspect), 600)
    pixels = camera.project(cloud)
    assert (pixels >= 0).all()
    assert (pixels <= [camera.width, camera.height]).all()


@given(st.integers(60, 900), st.integers(60, 900), st.floats(0, 0.6))
def test_what_was_framed_stays_in_view_in_any_window(width: int, height: int, panel: float) -> None:
    """However narrow it becomes, and beside a panel that covers its right."""
    cloud = np.random.default_rng(3).uniform((-0.1, -0.5, -0.2), (0.2, 0.1, 0.1), (60, 3))
    free = max(round((1 - panel) * width), 40)
    pixels = OrbitView.around(cloud, 16 / 9).camera(width, height, free).project(cloud)
    assert (pixels >= 0).all()
    assert (pixels <= [free, height]).all()


@given(st.floats(-60, 60), st.floats(-40, 40))
def test_turning_back_gives_the_same_view(right: float, up: float) -> None:
    """Orbits add up, and end at the same camera."""
    view = OrbitView(azimuth=30.0, elevation=10.0)
    back = view.orbited(right, up).orbited(-right, -up)
    assert back.azimuth == pytest.approx(view.azimuth, abs=1e-9)
    assert back.elevation == pytest.approx(view.elevation, abs=1e-9)


def test_the_camera_never_turns_over_the_top() -> None:
    """However far the mouse is dragged, up stays up."""
    view = OrbitView().orbited(0, 500)
    assert view.elevation < 90
    assert view.camera(10, 10).rotation[1, 1] < 0


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_panning_slides_the_picture_with_the_mouse(right: float, down: float) -> None:
    """What was at the centre is, afterwards, where the mouse went."""
    view = OrbitView(azimuth=40.0, elevation=-15.0, distance=0.8)
    before = np.array(view.target)
    seen = view.panned(right, down).camera(400, 300).project(before)
    np.testing.assert_allclose(seen, [200 + 300 * right, 150 + 300 * down], atol=1e-6)


def test_zooming_in_and_out_again_changes_nothing() -> None:
    """Zooming is a factor, and it stays within sensible distances."""
    view = OrbitView(distance=0.8)
    assert view.zoomed(1.7).zoomed(1 / 1.7).distance == pytest.approx(0.8)
    assert view.zoomed(1e9).distance > 0
    assert np.isfinite(view.zoomed(1e-9).distance)
