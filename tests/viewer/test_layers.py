"""Laws of the layers: what the stages found is shown where the photos saw it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit import stages
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.pipeline.work_folder import WorkFolder
from hairkit.rendering.context import renderer
from hairkit.testing import (
    ball_mask,
    bristle_groom,
    combed_field,
    combed_orientation,
    shell_hull,
    turn_scene,
)
from hairkit.viewer.actions.actions import perform
from hairkit.viewer.layers import BILLBOARDS, Layers
from hairkit.viewer.preview import Preview
from hairkit.viewer.session import Session

SCENE = turn_scene()


def keep_views(work: WorkFolder, names: Sequence[str]) -> None:
    """Keep masks and orientation maps of the views, and the scene, by these names."""
    work.put(stages.SCENE, replace(SCENE, names=tuple(names)), "x")
    for name, camera in zip(names, SCENE.cameras, strict=True):
        work.put(stages.LABELS, ball_mask(camera), "x", name)
        work.put(stages.ORIENTED, combed_orientation(ball_mask(camera)), "x", name)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A folder of results, as `reconstruct` leaves it."""
    with WorkFolder(tmp_path / "work") as work:
        keep_views(work, SCENE.names)
        work.put(stages.HULL, shell_hull(), "x")
        work.put(stages.FIELD, combed_field(shell_hull().grid), "x")
    bristle_groom().save(tmp_path / "groom.npz")
    return tmp_path


def test_a_picture_in_space_covers_what_its_camera_sees(results: Path) -> None:
    """Its corners project onto the corners of the photo."""
    layers = Layers(Manager(), results)
    for layer in ("masks", "orientation"):
        billboards = layers.billboards(layer)
        assert sorted(billboards) == sorted(SCENE.names)
        for name, camera in zip(SCENE.names, SCENE.cameras, strict=True):
            corners = camera.project(billboards[name].corners)
            size = np.array([camera.width, camera.height])
            np.testing.assert_allclose(corners, [[0, 0], [1, 0], [0, 1], [1, 1]] * size, atol=1e-3)


def test_a_view_may_have_any_name(tmp_path: Path) -> None:
    """A view called `left side` has its mask and its directions like all others."""
    names = ("left side", *SCENE.names[1:])
    with WorkFolder(tmp_path / "work") as work:
        keep_views(work, names)
    layers = Layers(Manager(), tmp_path)
    assert {"masks", "orientation", "cameras"} <= {*layers.available}
    assert sorted(layers.billboards("masks")) == sorted(names)
    assert sorted(layers.billboards("orientation")) == sorted(names)


def test_masks_show_hair_and_orientation_shows_upright_strands_in_one_hue(results: Path) -> None:
    """Opaque where hair is, clear in the background."""
    layers = Layers(Manager(), results)
    mask = ball_mask(SCENE.cameras[0])
    image = layers.billboards("masks")["front"].image
    assert (image[mask.hair][:, 3] > 200).all()
    assert (image[mask.labels == 0][:, 3] == 0).all()
    angles = layers.billboards("orientation")["front"].image
    assert len(np.unique(angles[mask.hair], axis=0)) == 1


def test_field_lines_run_along_the_field(results: Path) -> None:
    """Each stroke of a field combed down the ball lies square to the ball's radius."""
    lines = Layers(Manager(), results).field_lines()
    assert lines is not None
    ends = lines.points.reshape(-1, 2, 3)
    way, middle = ends[:, 1] - ends[:, 0], ends.mean(axis=1)
    cosine = (way * middle).sum(axis=1) / (
        np.linalg.norm(way, axis=1) * np.linalg.norm(middle, axis=1)
    )
    assert np.abs(cosine).max() < 0.05


def test_confidence_is_the_fields_at_the_guides(results: Path) -> None:
    """Guides inside the certain shell are certain, far away they are not."""
    inside = np.array([[[0.0, 0.112, 0.0], [0.0, 0.115, 0.0]]], np.float32)
    confidence = Layers(Manager(), results).confidence(inside)
    assert confidence is not None
    assert (confidence > 0.4).all()
    far = Layers(Manager(), results).confidence(inside * 0)
    assert far is not None
    assert (far < 0.1).all()


def test_a_groom_alone_has_the_head_alone(tmp_path: Path) -> None:
    """Layers that are not there are refused with what to do."""
    layers = Layers(Manager(), None)
    assert layers.available == ("head", "torso")
    with pytest.raises(InputError, match="open a folder that hairkit reconstruct wrote"):
        layers.check("hull")
    with pytest.raises(InputError, match="no layer 'hat'"):
        layers.check("hat")
    assert layers.field_lines() is None
    assert layers.hull() is None


def test_a_damaged_stage_is_left_out(results: Path) -> None:
    """A file that cannot be read shows nothing, and nothing else suffers."""
    (results / "work" / "field.npz").write_bytes(b"PK broken")
    assert Layers(Manager(), results).field_lines() is None
    assert Layers(Manager(), results).hull() is not None


def test_every_layer_changes_the_picture(results: Path, swaying_manager: Manager) -> None:
    """Shown on opening the folder itself; hidden again, the picture is as before."""
    session = Session(swaying_manager, results, size=(160, 120), hairs=200)
    perform(session, "zoom", {"factor": 0.5})
    with renderer() as gl:
        preview = Preview(gl, session)
        preview.frame(0.0, still=True)
        plain = preview.picture().copy()
        for layer in (*BILLBOARDS[1:], "cameras", "hull", "field", "head"):
            perform(session, "layer", {"name": layer})
            preview.frame(0.0, still=True)
            assert (preview.picture() != plain).any(), layer
            perform(session, "layer", {"name": layer})
            preview.frame(0.0, still=True)
            assert (preview.picture() == plain).all(), layer
        preview.release()


def test_looking_through_a_photos_camera_sees_what_the_photo_saw(
    results: Path, swaying_manager: Manager
) -> None:
    """The camera of the picture projects points where the photo's does, scaled to fit."""
    session = Session(swaying_manager, results, size=(160, 120), hairs=200)
    perform(session, "through", {"name": "left"})
    camera, photo = session.camera(), session.layers.cameras["left"]
    points = np.array([[0.02, 0.05, 0.01], [0.0, -0.03, 0.06]])
    scale = min(160 / photo.width, 120 / photo.height)
    expected = (photo.project(points) - photo.centre) * scale + [80, 60]
    np.testing.assert_allclose(camera.project(points), expected, atol=1e-6)
    perform(session, "orbit", {"right": 5.0})
    assert session.shown.through is None


def test_a_wipe_shows_the_photo_left_of_its_line(
    results: Path, swaying_manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Photo, white line, hair; it goes with its key, and where no photo's camera is used."""
    session = Session(swaying_manager, results, size=(160, 120), hairs=200)
    photo = SCENE.cameras[0]
    image = np.full((photo.height, photo.width, 3), (250, 0, 250), np.uint8)
    monkeypatch.setattr(Layers, "check", lambda self, name: None)
    monkeypatch.setattr(Layers, "photos", dict.fromkeys(SCENE.names, image))
    with renderer() as gl:
        preview = Preview(gl, session)
        perform(session, "wipe", {"at": 0.25})
        preview.draw(still=True)
        picture = preview.picture().copy()
        assert (picture[:, 40:42] == 255).all()
        left = round(80 - photo.width * min(160 / photo.width, 120 / photo.height) / 2)
        assert (picture[5:115, left + 1 : 40] == (250, 0, 250)).all()
        assert not (picture == (250, 0, 250)).all(axis=2)[:, 42:].any()
        perform(session, "wipe")
        preview.draw(still=True)
        assert not (preview.picture() == (250, 0, 250)).all(axis=2).any()
        perform(session, "wipe")
        perform(session, "orbit", {"right": 5.0})
        preview.draw(still=True)
        assert not (preview.picture() == (250, 0, 250)).all(axis=2).any()
        preview.release()


def test_a_photo_that_the_capture_lacks_is_not_compared(
    results: Path, swaying_manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Photos of another capture: one line, and the next view is drawn without them."""
    session = Session(swaying_manager, results, size=(160, 120), hairs=200)
    monkeypatch.setattr(Layers, "check", lambda self, name: None)
    monkeypatch.setattr(Layers, "photos", {})
    with pytest.raises(InputError, match=r"no photo '.*--capture"):
        perform(session, "wipe", {"at": 0.25})
    assert session.shown.wipe is None
    session.shown.through, session.shown.wipe = SCENE.names[0], 0.5
    with renderer() as gl:
        preview = Preview(gl, session)
        preview.draw(still=True)
        preview.release()
