"""Laws of cameras."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import InputError
from hairkit.types.camera import Camera, CameraModel

angles = st.floats(-179.0, 179.0)
models = st.sampled_from(["perspective", "orthographic"])


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    """Any camera that sees the head."""
    model: CameraModel = draw(models)
    return Camera.on_turn(
        draw(angles),
        elevation_deg=draw(st.floats(-60.0, 60.0)),
        roll_deg=draw(st.floats(-30.0, 30.0)),
        distance=draw(st.floats(0.5, 3.0)),
        target=draw(st.tuples(*[st.floats(-0.1, 0.1)] * 3)),
        focal=draw(st.floats(200.0, 4000.0)),
        width=600,
        height=800,
        model=model,
    )


points = st.lists(st.tuples(*[st.floats(-0.2, 0.2)] * 3), min_size=1, max_size=5).map(np.array)


@given(cameras(), points)
def test_unproject_inverts_project(camera: Camera, xyz: np.ndarray) -> None:
    """A point comes back from its pixel and its depth."""
    back = camera.unproject(camera.project(xyz), camera.depth(xyz))
    np.testing.assert_allclose(back, xyz, atol=1e-9)


@given(cameras(), points)
def test_rays_pass_through_what_the_pixel_shows(camera: Camera, xyz: np.ndarray) -> None:
    """The ray of a point's pixel meets the point, in front of the ray's origin."""
    start, way = camera.rays(camera.project(xyz))
    along = np.sum((xyz - start) * way, axis=-1, keepdims=True)
    assert (along > 0).all()
    np.testing.assert_allclose(start + along * way, xyz, atol=1e-9)
    np.testing.assert_allclose(camera.view_direction(xyz), way, atol=1e-7)


@given(angles, st.floats(-60.0, 60.0), models)
def test_a_camera_on_the_turn_stands_where_it_says(
    azimuth: float, elevation: float, model: CameraModel
) -> None:
    """Azimuth and elevation come back, the target lies in the middle at the distance."""
    camera = Camera.on_turn(
        azimuth, elevation_deg=elevation, distance=0.7, focal=9, width=6, height=8, model=model
    )
    assert camera.azimuth_deg == pytest.approx(azimuth, abs=1e-6)
    assert camera.elevation_deg == pytest.approx(elevation, abs=1e-6)
    assert np.linalg.norm(camera.position) == pytest.approx(0.7)
    np.testing.assert_allclose(camera.project(np.zeros(3)), [3, 4], atol=1e-9)
    assert camera.depth(np.zeros(3)) == pytest.approx(0.7)


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
@pytest.mark.parametrize(
    ("azimuth", "left_x"), [(0.0, 1), (180.0, -1), (90.0, 0), (-90.0, 0)], ids=str
)
def test_the_axes_are_those_of_the_conventions(
    model: CameraModel, azimuth: float, left_x: int
) -> None:
    """From the front the subject's left (+X) is on the image's right; up (+Y) is up (-y)."""
    camera = Camera.on_turn(azimuth, distance=1, focal=100, width=60, height=80, model=model)
    x, y = camera.project([0.1, 0.0, 0.0]) - camera.centre
    assert np.sign(np.round(x, 6)) == left_x
    assert y == pytest.approx(0, abs=1e-9)
    assert camera.project([0.0, 0.1, 0.0])[1] < camera.centre[1]


def test_a_camera_at_90_degrees_stands_on_the_subjects_left() -> None:
    """Azimuth is positive towards +X."""
    camera = Camera.on_turn(90.0, distance=2.0, focal=100, width=60, height=80)
    np.testing.assert_allclose(camera.position, [2, 0, 0], atol=1e-9)


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
def test_a_metre_has_its_pixels_at_the_origin(model: CameraModel) -> None:
    """The projection of a metre across is as long."""
    camera = Camera.on_turn(30.0, distance=2.0, focal=100, width=60, height=80, model=model)
    ends = camera.project([np.zeros(3), camera.rotation[0]])
    assert camera.pixels_per_metre == pytest.approx(np.linalg.norm(ends[1] - ends[0]))


def test_points_behind_a_perspective_camera_are_nowhere() -> None:
    """Their pixels are NaN, and the points in front are not touched by that."""
    camera = Camera.on_turn(0.0, distance=1.0, focal=100, width=60, height=80)
    pixels = camera.project([[0.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
    assert np.isnan(pixels[0]).all()
    np.testing.assert_allclose(pixels[1], camera.centre)


@given(cameras(), points)
def test_resizing_scales_the_pixels(camera: Camera, xyz: np.ndarray) -> None:
    """In a picture of half the size every point is at half the pixel."""
    half = camera.resized(300, 400)
    np.testing.assert_allclose(half.project(xyz), camera.project(xyz) / 2, atol=1e-9)


@given(cameras())
def test_json_keeps_the_camera(camera: Camera) -> None:
    """What is written in the form of truth.json is read back as the same camera."""
    back = Camera.from_json(json.loads(json.dumps(camera.to_json("front"))))
    np.testing.assert_array_equal(back.camera_from_head, camera.camera_from_head)
    np.testing.assert_array_equal(back.centre, camera.centre)
    assert (back.focal, back.width, back.height, back.model) == (
        camera.focal,
        camera.width,
        camera.height,
        camera.model,
    )


def changed(**fields: object) -> dict[str, object]:
    """Return a camera's JSON with some entries replaced; None takes one out."""
    camera = Camera.on_turn(0.0, distance=1.0, focal=100, width=60, height=80)
    entry = {**camera.to_json("x"), **fields}
    return {key: value for key, value in entry.items() if value is not None}


@pytest.mark.parametrize(
    "entry",
    [
        changed(R=None),
        changed(R=[[1, 0, 0], [0, 1, 0], [0, 0, -1]]),
        changed(R=[[2, 0, 0], [0, 1, 0], [0, 0, 1]]),
        changed(t=[0, 0, float("nan")]),
        changed(fx=0),
        changed(fx="wide"),
        changed(width=0),
        changed(model="fisheye"),
        changed(model="orthographic"),
    ],
)
def test_what_is_no_camera_is_refused(entry: dict[str, object]) -> None:
    """Missing keys, mirrored or scaled rotations, NaN and zero sizes are the user's errors."""
    with pytest.raises(InputError):
        Camera.from_json(entry)


@given(st.floats(1.0, 40.0))
def test_positive_roll_turns_the_picture_clockwise(roll: float) -> None:
    """What was straight above the middle moves to the right by the angle of the roll."""
    camera = Camera.on_turn(0.0, roll_deg=roll, distance=1, focal=100, width=60, height=80)
    x, y = camera.project([0.0, 0.1, 0.0]) - camera.centre
    assert np.degrees(np.arctan2(x, -y)) == pytest.approx(roll)
