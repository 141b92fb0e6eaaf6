"""Laws of first visible surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.cameras.depth_raster import front_values, point_depth
from hairkit.evaluation.depth_map import first_surface, near_some_surface
from hairkit.testing import ball_head
from hairkit.types.camera import Camera

CAMERA = Camera.on_turn(0.0, distance=1.0, focal=1000.0, width=400, height=300)


def wall(z: float) -> np.ndarray:
    """Points a millimetre apart on a square of 10 cm that faces the camera."""
    x, y = np.meshgrid(np.arange(-0.05, 0.05, 0.001), np.arange(-0.05, 0.05, 0.001))
    return np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3).astype(np.float32)


def test_samples_close_up_to_a_surface() -> None:
    """A wall of samples has no hole, and hides what is behind it by how far it is behind."""
    surface = first_surface(CAMERA, wall(0.0), None)
    inner = surface.depth[110:190, 160:240]
    assert np.allclose(inner, 1.0, atol=1e-6)
    behind = surface.behind(wall(-0.02)[::37])
    assert np.allclose(behind, 0.02, atol=1e-6)
    assert np.allclose(surface.behind(wall(0.01)[5050:5051]), -0.01, atol=1e-6)


def test_the_nearest_wins_in_any_order() -> None:
    """Depth is the least of what falls on a pixel, whatever comes first."""
    axis = np.array([[0, 0, 0], [0, 0, 0.03], [0, 0, -0.02]], np.float32)
    for points in (axis, axis[::-1], np.roll(axis, 1, axis=0)):
        depth = point_depth(CAMERA, points)
        assert depth[150, 200] == pytest.approx(0.97)
        assert np.isfinite(depth).sum() == 1


def test_background_hides_nothing_and_outside_is_unknown() -> None:
    """Over background a point is in front; outside the picture it is behind everything."""
    surface = first_surface(CAMERA, wall(0.0), None)
    points = np.array([[0.1, 0.0, -0.5], [5.0, 0.0, 0.0], [0.0, 0.0, 2.0]], np.float32)
    assert surface.behind(points).tolist() == [-np.inf, np.inf, np.inf]


def test_the_head_hides_hair() -> None:
    """Points of a wall through the ball's middle are 10 cm under its surface there."""
    surface = first_surface(CAMERA, np.zeros((0, 3), np.float32), ball_head())
    assert surface.behind(np.zeros((1, 3), np.float32))[0] == pytest.approx(0.1, abs=0.002)


def test_one_view_that_sees_is_enough() -> None:
    """A point hidden from the front but seen from behind is near a surface."""
    other = Camera.on_turn(180.0, distance=1.0, focal=1000.0, width=400, height=300)
    walls = np.concatenate([wall(0.0), wall(-0.05)])
    surfaces = [first_surface(camera, walls, None) for camera in (CAMERA, other)]
    point = np.array([[0.0, 0.0, -0.05], [0.0, 0.0, -0.025]], np.float32)
    assert near_some_surface(point, surfaces, 0.003).tolist() == [True, False]
    assert near_some_surface(point, surfaces[:1], 0.003).tolist() == [False, False]


@pytest.mark.parametrize("radius_mm", [3, 6])
def test_a_disc_covers_its_area(radius_mm: int) -> None:
    """One point drawn as a disc covers pi r^2 pixels within a few per cent."""
    depth = point_depth(CAMERA, np.array([[0.0002, 0.0001, 0]], np.float32), radius_mm / 1000)
    assert np.isfinite(depth).sum() == pytest.approx(np.pi * radius_mm**2, rel=0.12)


def test_the_front_value_is_painted() -> None:
    """Values of the nearest points show; behind the head none do."""
    points = np.concatenate([wall(0.0), wall(0.03)])
    values = np.repeat(np.array([1, 2], np.uint8), len(points) // 2)
    picture = front_values(CAMERA, points, values)
    assert picture[150, 200] == 2
    assert picture[0, 0] == 0
    assert front_values(CAMERA, wall(0.0), values[:10000], ball_head())[150, 200] == 0
