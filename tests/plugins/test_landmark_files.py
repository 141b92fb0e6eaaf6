"""Laws of landmarks that come with the photos."""

from __future__ import annotations

import numpy as np
import pytest
from hairkit_plugins.landmark_files import detect_landmarks

from hairkit.head_model.template import default_head
from hairkit.types.camera import Camera
from hairkit.types.capture import View

SIZE = (810, 1080)
IMAGE = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)


def view_from(azimuth: float, elevation: float = 0.0) -> View:
    """Return a photo of the template head with its landmarks."""
    width, height = SIZE
    camera = Camera.on_turn(
        azimuth, elevation_deg=elevation, distance=0.7, focal=1500.0, width=width, height=height
    )
    head = default_head()
    places = head.vertices[head.landmark_vertices].astype(np.float64)
    landmarks = camera.project(places)
    return View("front", azimuth, IMAGE, focal_px=1500.0, landmarks=landmarks)


@pytest.mark.parametrize("azimuth", [-60.0, -45.0, 0.0, 30.0, 45.0])
@pytest.mark.parametrize("elevation", [-10.0, 0.0, 20.0])
def test_the_direction_is_that_of_the_camera(azimuth: float, elevation: float) -> None:
    """Yaw and pitch are azimuth and elevation of the camera that sees the landmarks."""
    view = view_from(azimuth, elevation)
    face = detect_landmarks(view)
    assert face is not None
    assert face.yaw_deg == pytest.approx(azimuth, abs=0.5)
    assert face.pitch_deg == pytest.approx(elevation, abs=0.5)
    assert face.roll_deg == pytest.approx(0.0, abs=0.5)
    assert np.array_equal(face.landmarks, view.landmarks)
    assert face.presence == 1
    assert not face.noise_px.any()


def test_a_view_without_landmarks_is_left_to_the_next_plugin() -> None:
    """Nothing is said of a photo that has none."""
    assert detect_landmarks(View("front", 0.0, IMAGE)) is None
