"""Laws of structure from motion: known cameras are found again, in the head's frame and size."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hairkit_plugins import sfm
from hairkit_plugins.sfm import Options, estimate_scene, place_on_head, refuse_astray
from hairkit_plugins.sfm.sparse_model import Model

from hairkit import Camera, Capture, Head, Mask, Scene, View
from hairkit.cameras.similarity import Similarity, move_head
from hairkit.errors import InputError, MissingExtraError
from hairkit.head_model.template import default_head
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

PHOTOS, SIZE = 24, (300, 360)
FEW = Options(features=2000, neighbours=3)
needs_colmap = pytest.mark.skipif(
    importlib.util.find_spec("pycolmap") is None, reason="pycolmap is not installed"
)


def _camera(azimuth: float) -> Camera:
    return Camera.on_turn(
        azimuth, distance=0.8, target=(0, 0, 0), focal=900.0, width=SIZE[0], height=SIZE[1]
    )


def _turn(count: int = PHOTOS, *, textured: bool = True) -> tuple[Capture, tuple[Mask, ...]]:
    """Return photos of a cylinder with random spots, or of nothing, as if it were a person."""
    head = default_head()
    assert head.landmark_vertices is not None
    spots = np.random.default_rng(3).uniform(0, 255, (64, 160)).astype(np.float32)
    texture = cv2.resize(np.tile(spots, (1, 3)), (3 * 960, 384), interpolation=cv2.INTER_CUBIC)
    views, masks = [], []
    for index in range(count):
        azimuth = 360.0 * index / count
        camera = _camera(azimuth)
        image, inside = _cylinder(camera, texture)
        marks = camera.project(head.vertices[head.landmark_vertices].astype(np.float64))
        face = min(azimuth, 360 - azimuth) < 50
        photo = np.where(inside, image if textured else 128, 0).astype(np.uint8)
        views.append(
            View(
                f"{index:02}",
                azimuth,
                np.repeat(photo[..., None], 3, axis=2),
                focal_px=900.0,
                landmarks=marks if face else None,
            )
        )
        labels = np.where(inside, PERSON, BACKGROUND).astype(np.uint8)
        labels[: SIZE[1] // 4] = np.where(inside, HAIR, BACKGROUND)[: SIZE[1] // 4]
        masks.append(Mask(labels, True))
    return Capture(tuple(views)), tuple(masks)


def _cylinder(camera: Camera, texture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture of a cylinder of 80 mm radius and 240 mm height, and where it is."""
    radius, half = 0.08, 0.12
    column, row = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    origin, ray = camera.rays(np.stack([column, row], axis=-1).reshape(-1, 2))
    a = (ray[:, [0, 2]] ** 2).sum(axis=1)
    b = (origin[:, [0, 2]] * ray[:, [0, 2]]).sum(axis=1)
    c = (origin[:, [0, 2]] ** 2).sum(axis=1) - radius**2
    root = b**2 - a * c
    depth = (-b - np.sqrt(np.maximum(root, 0))) / a
    place = origin + depth[:, None] * ray
    inside = (root > 0) & (np.abs(place[:, 1]) < half)
    u = (np.arctan2(place[:, 0], place[:, 2]) / (2 * np.pi) % 1 + 1) * 960
    v = (place[:, 1] / (2 * half) + 0.5) * 383
    shape = SIZE[::-1]
    picture = cv2.remap(
        texture,
        u.reshape(shape).astype(np.float32),
        v.reshape(shape).astype(np.float32),
        cv2.INTER_LINEAR,
    )
    return picture.clip(0, 255), inside.reshape(shape)


@needs_colmap
def test_a_turn_is_found_again() -> None:
    """Cameras come back in the head's frame, to 8 mm and 0.6 degrees, points on the surface."""
    capture, masks = _turn()
    scene = estimate_scene(capture, masks, default_head(), None, FEW)
    for view, camera in zip(capture.views, scene.cameras, strict=True):
        true = _camera(view.azimuth_deg)
        assert np.linalg.norm(camera.position - true.position) < 0.008
        assert np.degrees(np.arccos(np.clip(camera.forward @ true.forward, -1, 1))) < 0.6
    assert scene.points is not None
    assert len(scene.points) > 300
    radius = np.hypot(scene.points[:, 0], scene.points[:, 2])
    assert np.median(np.abs(radius - 0.08)) < 0.001
    assert scene.residual_px is not None
    assert scene.residual_px < 1.5


@needs_colmap
def test_plain_photos_join_nothing() -> None:
    """Photos without texture are refused in one line that says what to take instead."""
    capture, masks = _turn(16, textured=False)
    with pytest.raises(InputError, match="16 of 16 photos do not join") as told:
        estimate_scene(capture, masks, default_head(), None, FEW)
    assert "\n" not in str(told.value)
    assert "scene=silhouette" in str(told.value)


def test_eight_photos_are_too_few() -> None:
    """Eight photos are refused before anything is started."""
    capture, masks = _turn(8)
    with pytest.raises(InputError, match="8 photos are too few"):
        estimate_scene(capture, masks, default_head(), None, Options())


def test_without_the_library_one_line_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    """It says what to install."""
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    capture, masks = _turn(16)
    with pytest.raises(MissingExtraError, match=r"pip install 'hairkit\[sfm\]'"):
        estimate_scene(capture, masks, default_head(), None, Options())


def test_landmarks_give_frame_and_size() -> None:
    """Cameras in a world of another place, direction and size are brought back to the head."""
    capture, _ = _turn(16)
    cameras = [_camera(view.azimuth_deg) for view in capture.views]
    turn = cv2.Rodrigues(np.array([0.3, -0.8, 0.5]))[0]
    moved = Similarity(7.0, turn, np.array([1.0, -2.0, 3.0]))
    head = default_head()
    place = place_on_head(capture, [moved.moved_camera(camera) for camera in cameras], head)
    np.testing.assert_allclose(place.scale, 1 / 7, rtol=1e-5)
    points = np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_allclose(place.apply(moved.apply(points)), points, atol=1e-5)


def test_cameras_that_are_astray_are_refused() -> None:
    """One that came out four times as near, or looks past the head, is named with what to do."""
    capture, masks = _turn(16)
    names = [view.name for view in capture.views]
    cameras = [_camera(view.azimuth_deg) for view in capture.views]
    head = default_head()
    refuse_astray(names, cameras, head, masks)
    for matrix in (Similarity(0.25, np.eye(3), np.zeros(3)),
                   Similarity(1.0, np.eye(3), np.array([0, 0.3, 0]))):  # fmt: skip
        wrong = [*cameras[:5], matrix.moved_camera(cameras[5]), *cameras[6:]]
        with pytest.raises(InputError, match=rf"1 of 16 cameras .*\({names[5]}\).*silhouette"):
            refuse_astray(names, wrong, head, masks)


def test_without_a_face_there_is_no_size() -> None:
    """Turns without landmarks are refused with what to do."""
    capture, _ = _turn(16)
    bare = Capture(tuple(replace(view, landmarks=None) for view in capture.views))
    cameras = [_camera(view.azimuth_deg) for view in bare.views]
    with pytest.raises(InputError, match="hairkit models install"):
        place_on_head(bare, cameras, default_head())


def test_only_points_on_skin_stay() -> None:
    """A point that most photos show on hair is left out; so is one beside the photo."""
    hair = Mask(np.full((4, 4), HAIR, np.uint8), True)
    skin = Mask(np.where(np.eye(4)[::-1] > 0, HAIR, PERSON).astype(np.uint8), True)
    sights = [(0, 0, 0.4, 0.4), (0, 1, 0.4, 0.4), (0, 2, 0.4, 0.4), (1, 0, 0.4, 0.4),
              (1, 1, 0.4, 0.4), (1, 2, 0.4, 0.4), (2, 0, 1.4, 0.4)]  # fmt: skip
    model = Model((None,) * 3, np.zeros((3, 3)), np.array(sights), 0.0)
    assert sfm._on_skin(model, (skin, skin, hair)).tolist() == [True, True, False]
    assert sfm._on_skin(model, (hair, hair, skin)).tolist() == [False, False, False]


def test_photos_come_back_in_their_order() -> None:
    """What was solved in the order of the turn is told in that of the photos."""
    cameras = tuple(_camera(azimuth) for azimuth in (10, 20, 30))
    model = Model(cameras, np.zeros((1, 3)), np.array([[0, 2, 0.1, 0.2]]), 0.0)
    back = model.reordered(np.array([2, 0, 1]))
    assert back.cameras == (cameras[1], cameras[2], cameras[0])
    assert back.sights[0, 1] == 1


def test_points_move_with_the_head() -> None:
    """Moving the head in the scene leaves the points where the cameras see them."""
    head: Head = default_head()
    points = np.array([[0.0, 0.0, 0.1], [0.05, 0.02, 0.03]], np.float32)
    camera = _camera(20)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = 1.1 * cv2.Rodrigues(np.array([0.1, 0.2, 0]))[0], (0.1, 0, 0.2)
    after = move_head(Scene(("a",), (camera,), head, None, points), matrix)
    assert after.points is not None
    np.testing.assert_allclose(
        after.cameras[0].project(after.points), camera.project(points), atol=1e-2
    )
