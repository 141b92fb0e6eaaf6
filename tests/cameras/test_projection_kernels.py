"""Laws of the compiled projection."""

from __future__ import annotations

import numpy as np
import pytest
from ball_camera import camera_at
from hypothesis import given
from hypothesis import strategies as st

from hairkit.cameras.projection_kernels import pack_camera, perspective_divisor, project
from hairkit.types.camera import CameraModel

MODELS: tuple[CameraModel, ...] = ("perspective", "orthographic")
coordinates = st.floats(-0.4, 0.4)


@pytest.mark.parametrize("model", MODELS)
@given(st.floats(-180, 180), st.floats(-80, 80), st.tuples(coordinates, coordinates, coordinates))
def test_a_packed_camera_projects_as_its_camera(
    model: CameraModel, azimuth: float, elevation: float, point: tuple[float, float, float]
) -> None:
    """The compiled projection gives `Camera.project` and the z of `to_camera`."""
    camera = camera_at(azimuth, elevation, model)
    u, v, depth = project(pack_camera(camera), *point)
    np.testing.assert_allclose([u, v], camera.project(point), rtol=1e-9, atol=1e-9)
    assert depth == pytest.approx(camera.to_camera(point)[2])


def test_points_behind_a_perspective_camera_have_no_depth_and_no_pixel() -> None:
    """Their depth is at most 0 and they fall far outside of every picture."""
    camera = camera_at(30, 10, "perspective")
    u, v, depth = project(pack_camera(camera), *(camera.position - 0.2 * camera.forward))
    assert depth == pytest.approx(-0.2)
    assert max(u, v) < -1e6


@pytest.mark.parametrize("model", MODELS)
def test_a_packed_camera_keeps_every_number(model: CameraModel) -> None:
    """Its axes are the rotation's rows; position, principal point, height and model are kept."""
    camera = camera_at(45.0, 5, model, 101)
    packed = pack_camera(camera)
    np.testing.assert_array_equal([packed.right, packed.down, packed.forward], camera.rotation)
    np.testing.assert_array_equal(packed.translation, camera.translation)
    np.testing.assert_array_equal(packed.position, camera.position)
    assert (packed.centre_u, packed.centre_v) == tuple(camera.centre)
    assert packed.height == 101
    assert packed.orthographic == (model == "orthographic")


@pytest.mark.parametrize("model", MODELS)
def test_lengths_across_the_view_shrink_with_the_divisor(model: CameraModel) -> None:
    """A centimetre to the right covers focal * 0.01 / divisor pixels."""
    camera = pack_camera(camera_at(30, 10, model))
    u, v, depth = project(camera, 0.02, 0.01, 0.03)
    right = np.array([0.02, 0.01, 0.03]) + 0.01 * np.array(camera.right)
    gap = np.subtract(project(camera, *right)[:2], (u, v))
    wanted = camera.focal * 0.01 / perspective_divisor(camera, depth)
    np.testing.assert_allclose(gap, [wanted, 0], atol=1e-9)
