"""Laws of landmarks for a head that has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit.errors import RenderError
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.nets.model_folder import missing_models
from hairkit.pipeline import own_head
from hairkit.pipeline.own_head import find_landmarks, mark_head
from hairkit.pipeline.recipe import load_recipe
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.face import Face

BARE = replace(default_head(), landmark_vertices=None)


def places() -> np.ndarray:
    """Return the landmarks of the default head, (68, 3) metres."""
    head = default_head()
    return head.vertices[np.asarray(head.landmark_vertices)].astype(np.float64)


def true_face(view: View) -> Face:
    """Return the face as a perfect detector would see it."""
    camera: Camera = own_head._camera(view.azimuth_deg)
    return Face(1.0, camera.project(places()), np.ones(68), view.azimuth_deg, 0.0, 0.0)


def gap(head: object) -> np.ndarray:
    """Return how far the found landmarks are from the true ones, metres."""
    vertices = head.vertices[head.landmark_vertices]  # type: ignore[attr-defined]
    return np.linalg.norm(vertices - places(), axis=1)


def test_a_perfect_detector_gives_the_very_vertices() -> None:
    """Landmarks seen from three sides are intersected in space and found on the mesh again."""
    marked = find_landmarks(BARE, true_face)
    assert marked is not None
    assert gap(marked).max() < 1e-6


@pytest.mark.parametrize("seen", [0, 1])
def test_one_picture_is_not_enough(seen: int) -> None:
    """A face found in fewer than two pictures gives no landmarks."""
    left = iter([True] * seen + [False] * 3)
    assert find_landmarks(BARE, lambda view: true_face(view) if next(left) else None) is None


def test_a_head_with_landmarks_keeps_them(manager: Manager) -> None:
    """Nothing is drawn or looked for where landmarks are given."""
    head = default_head()
    said: list[str] = []
    assert mark_head(head, load_recipe("default"), manager, said.append) is head
    assert not said


def test_without_graphics_the_run_goes_on(
    monkeypatch: pytest.MonkeyPatch, manager: Manager
) -> None:
    """Where no picture can be drawn, one line says so and the head stays as it is."""

    def no_graphics(*_: object) -> None:
        raise RenderError("no OpenGL")

    monkeypatch.setattr(own_head, "_pictures", no_graphics)
    said: list[str] = []
    assert mark_head(BARE, load_recipe("default"), manager, said.append) is BARE
    assert said == ["no landmarks for the head: no OpenGL"]


@pytest.mark.skipif(
    bool(missing_models(["face_landmark", "face_detection_short_range"])),
    reason="networks are not installed: hairkit models install",
)
def test_the_recipes_detector_finds_the_default_heads_face(manager: Manager) -> None:
    """The inner landmarks lie within 3 mm on average, and one line says that they were found."""
    said: list[str] = []
    marked = mark_head(BARE, load_recipe("default"), manager, said.append)
    assert marked.landmark_vertices is not None
    assert gap(marked)[27:].mean() < 0.003
    assert said == ["the head's landmarks were found in pictures of it"]
