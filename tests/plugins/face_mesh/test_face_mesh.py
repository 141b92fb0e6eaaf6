"""Laws of faces in photos, on the sample's photos; they need the networks."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hairkit_plugins import face_mesh
from hairkit_plugins.face_mesh import MODELS, Options, find_face
from hairkit_plugins.face_mesh.landmark_table import MIRROR

import hairkit
from hairkit.nets.model_folder import missing_models
from hairkit.nets.net_process import shared_nets
from hairkit.types.capture import View
from hairkit.types.face import Face

INNER = slice(17, 68)
needs_networks = pytest.mark.skipif(
    bool(missing_models(MODELS)), reason="networks are not installed: hairkit models install"
)


@pytest.fixture(scope="module")
def views() -> dict[str, View]:
    """The sample's views by name."""
    return {view.name: view for view in hairkit.sample_capture().views}


def find(image: np.ndarray, **settings: object) -> Face:
    """Return the face of a picture."""
    return find_face(np.ascontiguousarray(image), Options(**settings), shared_nets())  # type: ignore[arg-type]


def noise(*faces: Face) -> float:
    """Return the mean noise of the inner landmarks of faces, pixels."""
    return float(np.mean([face.noise_px[INNER].mean() for face in faces]))


def apart(first: np.ndarray, second: np.ndarray) -> float:
    """Return the mean distance of inner landmarks, pixels."""
    return float(np.linalg.norm(first[INNER] - second[INNER], axis=1).mean())


@needs_networks
@pytest.mark.parametrize(
    ("name", "yaw"), [("front", 0.0), ("front-left", 45.0), ("front-right", -45.0)]
)
def test_faces_are_where_the_sample_says(views: dict[str, View], name: str, yaw: float) -> None:
    """Landmarks lie within three times their noise of the given ones, and the yaw is the view's."""
    view = views[name]
    face = find(view.image)
    assert face.sure
    assert view.landmarks is not None
    assert apart(face.landmarks, view.landmarks) < 3 * noise(face)
    assert face.yaw_deg == pytest.approx(yaw, abs=8)
    assert abs(face.roll_deg) < 6
    assert face.quarter_turns == 0


@needs_networks
@pytest.mark.parametrize("name", ["back", "back-left", "back-right"])
def test_there_is_no_face_at_the_back(views: dict[str, View], name: str) -> None:
    """Hair seen from behind is not a face, whichever way up."""
    assert find(views[name].image).presence < 0.3


@needs_networks
@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_photo_on_its_side_is_noticed(views: dict[str, View], turns: int) -> None:
    """Turn the photo and the landmarks turn with it; the turns back are counted."""
    view = views["front"]
    upright = find(view.image)
    turned = find(np.rot90(view.image, -turns))
    assert turned.quarter_turns == (4 - turns) % 4
    expected = upright.turned(turns, view.width, view.height).landmarks
    assert apart(turned.landmarks, expected) < noise(upright)
    assert turned.yaw_deg == pytest.approx(upright.yaw_deg, abs=3)
    assert turned.roll_deg == pytest.approx(upright.roll_deg, abs=3)


@needs_networks
def test_the_mirror_image_has_mirrored_landmarks(views: dict[str, View]) -> None:
    """Mirror the photo: landmarks change sides, yaw and roll their signs."""
    view = views["front-left"]
    plain, mirrored = find(view.image), find(view.image[:, ::-1])
    expected = (plain.landmarks * [-1, 1] + [view.width, 0])[MIRROR]
    assert apart(mirrored.landmarks, expected) < noise(plain)
    assert mirrored.yaw_deg == pytest.approx(-plain.yaw_deg, abs=3)
    assert mirrored.roll_deg == pytest.approx(-plain.roll_deg, abs=3)


@needs_networks
@pytest.mark.parametrize(("scale", "shift"), [(0.6, (0, 0)), (1.0, (37, -24)), (0.8, (-30, 20))])
def test_landmarks_move_with_the_photo(
    views: dict[str, View], scale: float, shift: tuple[int, int]
) -> None:
    """Shift and scale the photo, and the landmarks follow within their noise."""
    view = views["front"]
    matrix = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]], np.float64)
    centred = matrix + np.array([0, 0, scale / 2 - 0.5])
    size = (view.width, view.height)
    moved = cv2.warpAffine(
        view.image, centred, size, flags=cv2.INTER_AREA, borderMode=cv2.BORDER_REPLICATE
    )
    plain, found = find(view.image), find(moved)
    expected = plain.landmarks @ matrix[:, :2].T + matrix[:, 2]
    assert apart(found.landmarks, expected) < noise(plain)


@needs_networks
def test_a_picture_of_nothing_has_no_face() -> None:
    """Noise and a blank wall have no face, and the answer is that of an absent one."""
    assert find(np.full((300, 200, 3), 128, np.uint8)).presence < 0.3
    rng = np.random.default_rng(0)
    assert find(rng.integers(0, 255, (200, 300, 3), np.uint8)).presence < 0.3


def test_without_networks_there_is_no_answer(
    views: dict[str, View], monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    """The plugin abstains, so that the next one of the recipe is asked."""
    monkeypatch.setenv("HAIRKIT_MODELS", str(tmp_path))
    view = replace(views["front"], landmarks=None)
    assert face_mesh.detect_landmarks(view=view, options=Options()) is None
