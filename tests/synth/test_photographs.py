"""Laws of the photos taken of a groom: what is written is true and laid out like a capture."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.evaluation.truth import read_truth
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import TURN
from hairkit.synth import grow, photograph
from hairkit.types.groom import Groom
from hairkit.types.orientation import angle_between

SIZE = (90, 120)


@pytest.fixture(scope="module")
def groom() -> Groom:
    return grow("parted", default_head(), 700, seed=4)


@pytest.fixture(scope="module")
def folder(groom: Groom, tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.mktemp("capture")
    photograph(groom, base, seed=4, size=SIZE)
    return base


def read(path: Path) -> np.ndarray:
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    return np.asarray(picture)


def test_a_capture_is_complete(folder: Path) -> None:
    """Eight photos, masks and orientation maps of the size asked for, landmarks in three views."""
    stems = [f"{i}_{name}" for i, name in enumerate(TURN)]
    for kind, ending in (("photos", "jpg"), ("masks", "png"), ("truth/orientation", "png")):
        files = sorted((folder / kind).iterdir())
        assert [f.name for f in files] == [f"{stem}.{ending}" for stem in stems]
        assert all(read(f).shape == SIZE[::-1] for f in files)
    landmarks = json.loads((folder / "landmarks.json").read_text())["views"]
    assert list(landmarks) == [stems[0], stems[1], stems[7]]
    assert set(np.unique(read(folder / "masks" / "0_front.png"))) == {0, 128, 255}


def test_any_number_of_photos_goes_evenly_round(groom: Groom, tmp_path: Path) -> None:
    """Twelve photos are 30 degrees apart, each seen point is marked in its view, in any range."""
    photograph(groom, tmp_path, seed=4, size=SIZE, views=12, jitter=0)
    truth = read_truth(tmp_path)
    azimuths = np.array([camera.azimuth_deg for camera in truth.cameras])
    off = (azimuths - 30.0 * np.arange(12) + 180) % 360 - 180
    assert np.abs(off).max() < 0.5
    with np.load(tmp_path / "truth" / "strands.npz") as data:
        seen = data["visible"]
    assert all((seen >> np.uint64(view) & np.uint64(1)).any() for view in range(12))
    names = list(json.loads((tmp_path / "landmarks.json").read_text())["views"])
    assert names == ["photo-01", "photo-02", "photo-12"]
    with pytest.raises(InputError, match="0 photos, expected 1 to 36"):
        photograph(groom, tmp_path, views=0)


def test_the_truth_is_the_groom(folder: Path, groom: Groom) -> None:
    """Strands, head and cameras read back; the cameras are the turn's up to their jitter."""
    truth = read_truth(folder)
    assert np.allclose(truth.strands.points, groom.strands.points)
    assert np.allclose(truth.head.vertices, groom.head.vertices, atol=1e-5)
    for camera, azimuth in zip(truth.cameras, TURN.values(), strict=True):
        assert abs((camera.azimuth_deg - azimuth + 180) % 360 - 180) < 5


def test_visible_hair_projects_into_the_masks(folder: Path, groom: Groom) -> None:
    """Points marked as seen by a view lie on hair there, with the angle of their strand."""
    truth = read_truth(folder)
    with np.load(folder / "truth" / "strands.npz") as data:
        visible = data["visible"]
    tangents = groom.strands.tangents()
    for view in (0, 3):
        camera = truth.cameras[view]
        seen = (visible >> view & 1) == 1
        assert 0.02 < seen.mean() < 0.7
        points = groom.strands.points[seen].astype(np.float64)
        column, row = np.floor(camera.project(points)).astype(int).T
        assert (truth.hair_mask(view)[row, column] == 255).mean() > 0.9
        step = camera.project(points + 1e-4 * tangents[seen]) - camera.project(points)
        coded = truth.orientation(view)[row, column]
        angle = (coded.astype(np.float64) - 1) / 255 * np.pi
        gap = np.degrees(angle_between(angle, np.arctan2(step[:, 1], step[:, 0])))
        assert np.median(gap[coded > 0]) < 8


def test_landmarks_lie_near_their_vertices(folder: Path, groom: Groom) -> None:
    """A detector's noise is a fraction of a percent of the picture's width."""
    truth = read_truth(folder)
    index = groom.head.landmark_vertices
    assert index is not None
    views = json.loads((folder / "landmarks.json").read_text())["views"]
    gap = views["0_front"] - truth.cameras[0].project(groom.head.vertices[index])
    assert 0 < np.sqrt((gap**2).mean()) < 0.006 * SIZE[0]


def test_equal_seeds_take_equal_photos(folder: Path, groom: Groom, tmp_path: Path) -> None:
    """Every file is the same, byte for byte, when it is made again."""
    photograph(groom, tmp_path, seed=4, size=SIZE)
    for path in folder.rglob("*.*"):
        assert path.read_bytes() == (tmp_path / path.relative_to(folder)).read_bytes(), path.name


def test_tiny_photos_are_refused(groom: Groom, tmp_path: Path) -> None:
    """A size that cannot be a photo is refused before anything is written."""
    with pytest.raises(InputError, match="expected 64 to 8192"):
        photograph(groom, tmp_path / "new", size=(10, 10))
    assert not (tmp_path / "new").exists()
