"""Laws of the similarity that brings a prediction into the truth's frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hairkit.errors import InputError
from hairkit.evaluation.align import Alignment, align, alignment_points, camera_errors
from hairkit.testing import VIEW_NAMES, turn_scene
from hairkit.types.camera import Camera
from hairkit.types.strands import Strands

POINTS = np.random.default_rng(0).uniform(-0.1, 0.1, (200, 3)).astype(np.float32)
NOTHING = Alignment(1.0, np.eye(3), np.zeros(3))


def orthographic() -> tuple[Camera, ...]:
    return tuple(
        Camera.on_turn(45.0 * i, focal=300.0, width=96, height=128, model="orthographic")
        for i in range(8)
    )


@given(
    turn=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
    shift=st.tuples(*[st.floats(-0.2, 0.2)] * 3),
    scale=st.floats(0.5, 2.0),
)
@settings(max_examples=15)
def test_any_change_of_frame_is_undone(
    turn: tuple[float, ...], shift: tuple[float, ...], scale: float
) -> None:
    """A scene moved, turned and scaled as a whole comes back, with cameras that have no error."""
    change = Alignment(scale, Rotation.from_rotvec(turn).as_matrix(), np.array(shift))
    for true in (turn_scene().cameras, orthographic()):
        predicted = [change.moved_camera(camera) for camera in true]
        points = change.apply(POINTS)
        found = align(predicted, true, points)
        assert found.scale * scale == pytest.approx(1.0, abs=1e-5)
        assert np.allclose(found.apply(points), POINTS, atol=1e-5)
        for error in camera_errors(VIEW_NAMES, predicted, true, found, points):
            assert abs(error.azimuth_deg) < 1e-3
            assert error.rotation_deg < 1e-3
            assert error.position_m < 1e-5
            assert error.reprojection_px < 0.05


def test_a_moved_camera_sees_moved_points_where_it_saw_them() -> None:
    """`moved_camera` and `apply` belong together, in both camera models."""
    change = Alignment(
        1.7, Rotation.from_rotvec([0.3, 1.0, -0.2]).as_matrix(), np.array([1.0, 2, 3])
    )
    for camera in (turn_scene().cameras[3], orthographic()[3]):
        before, after = (
            camera.project(POINTS),
            change.moved_camera(camera).project(change.apply(POINTS)),
        )
        assert np.allclose(before, after, atol=1e-3)


def test_one_turned_camera_is_named_with_its_error() -> None:
    """A camera that is two degrees too far along the turn stands out with about two degrees."""
    true = turn_scene().cameras
    wrong = Camera.on_turn(92.0, distance=0.6, focal=200.0, width=96, height=128)
    predicted = [*true[:2], wrong, *true[3:]]
    found = align(predicted, true, POINTS)
    errors = camera_errors(VIEW_NAMES, predicted, true, found, POINTS)
    assert errors[2].azimuth_deg == pytest.approx(2.0, abs=0.4)
    assert max(abs(error.azimuth_deg) for i, error in enumerate(errors) if i != 2) < 0.4
    assert found.residual_px > 0


def test_how_far_off_an_orthographic_camera_stands_does_not_matter() -> None:
    """Its centre may lie anywhere on its axis: only the axes are compared, at the hair."""
    true = turn_scene().cameras
    for away in (1.0, 100.0):
        flat = [
            Camera.on_turn(
                45.0 * i + 1, distance=away, focal=333.0, width=96, height=128, model="orthographic"
            )
            for i in range(8)
        ]
        errors = camera_errors(VIEW_NAMES, flat, true, NOTHING, POINTS)
        assert max(error.position_m for error in errors) < 0.01


def test_the_size_of_working_pictures_does_not_matter() -> None:
    """Cameras of pictures at half size align as those of whole ones."""
    true = turn_scene().cameras
    half = [camera.resized(camera.width // 2, camera.height // 2) for camera in true]
    found = align(half, true, POINTS)
    assert found.scale == pytest.approx(1.0)
    assert found.residual_px < 1e-6


def test_views_must_pair_up() -> None:
    """Seven cameras against eight is one line."""
    true = turn_scene().cameras
    with pytest.raises(InputError, match="7 cameras, the truth 8"):
        align(true[:7], true, POINTS)


def test_strands_keep_everything_but_place_and_size() -> None:
    """Points are moved, widths scaled, offsets kept."""
    hair = Strands(POINTS[:4], np.array([0, 2, 4]), widths=np.full(4, 1e-4, np.float32))
    doubled = replace(NOTHING, scale=2.0).moved_strands(hair)
    assert np.allclose(doubled.points, 2 * hair.points)
    assert doubled.widths is not None
    assert np.allclose(doubled.widths, 2e-4)
    assert np.array_equal(doubled.offsets, hair.offsets)


def test_the_sample_of_points_is_bounded_and_fixed() -> None:
    """Two thousand points at most of strands, the same every time, head points after them."""
    hair = Strands.from_list([np.arange(30_000).reshape(-1, 3) / 1e4])
    first = alignment_points(hair, POINTS)
    assert len(first) == 2000 + len(POINTS)
    assert np.array_equal(first, alignment_points(hair, POINTS))
