"""Laws of the eyes: they fill the opening of the lids on any head, in the colours of the photos."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from hairkit.head_model.eye_colours import find_eye_colours
from hairkit.head_model.eyes import (
    CENTRE,
    CORNEA,
    IRIS,
    IRIS_RADIUS,
    RADIUS,
    SCLERA,
    between_lids,
    eyeballs,
    has_default_eyes,
    paint_eyes,
)
from hairkit.head_model.identity import blend_head
from hairkit.head_model.template import default_head
from hairkit.types.capture import View
from hairkit.types.head import EYES, Head

HEADS = {
    "average": {},
    "man": {"man": 1.0},
    "woman": {"woman": 1.0},
    "child": {"child": 1.0},
    "deep": {"eyes_deep": 2.0, "eyes_apart": -2.0},
}


def first_hits(head: Head, starts: np.ndarray) -> np.ndarray:
    """Return which faces rays from places before the face meet first, backwards along z."""
    mesh = trimesh.Trimesh(head.vertices, head.faces, process=False)
    ways = np.tile([0.0, 0.0, -1.0], (len(starts), 1))
    return np.asarray(mesh.ray.intersects_first(starts, ways))


def test_eyeballs_are_closed_spheres() -> None:
    """Both are closed, wound outwards, have the radius but at the cornea, and are mirror images."""
    balls = eyeballs()
    mesh = trimesh.Trimesh(balls.vertices, balls.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(2 * 4 / 3 * np.pi * (1e-3 * RADIUS) ** 3, rel=0.05)
    left, right = np.split(balls.vertices, 2)
    away = np.linalg.norm(1e3 * left - CENTRE, axis=1)
    assert away[0] == away.max() == pytest.approx(RADIUS + CORNEA)
    iris = np.linalg.norm(1e3 * left[:, :2] - CENTRE[:2], axis=1) < IRIS_RADIUS
    np.testing.assert_allclose(away[~iris], RADIUS)
    np.testing.assert_allclose(left * [-1, 1, 1], right)


@pytest.mark.parametrize("name", HEADS)
def test_eyes_are_seen_between_the_lids_and_nowhere_else(name: str) -> None:
    """From the front the pupils are seen; beside the lids, and on the lids, skin covers the eye."""
    head = blend_head(HEADS[name])
    assert head.eye_vertices is not None
    assert head.landmark_vertices is not None
    is_eye = np.isin(head.faces, head.eye_vertices).any(axis=1)
    pupils = head.vertices[head.eye_vertices[:, 0]].astype(np.float64)
    assert is_eye[first_hits(head, pupils + np.array([0, 0, 0.05]))].all()
    lids = np.stack([head.vertices[head.landmark_vertices[eye]] for eye in EYES]).astype(float)
    middle = lids.mean(axis=1, keepdims=True)
    beside = middle + 1.3 * (lids - middle) + np.array([0, 0, 0.05])
    assert not is_eye[first_hits(head, beside.reshape(-1, 3))].any()


def test_lids_have_no_notches() -> None:
    """Rays 0.25 mm apart towards an eye: nowhere is it seen a millimetre beyond the lids' edges."""
    head = default_head()
    assert head.eye_vertices is not None
    x, y = (0.25e-3 * a.ravel() for a in np.mgrid[4 * 14 : 4 * 47, -4 * 44 : -4 * 27])
    points = np.stack([x, y, np.full(x.size, 0.12)], axis=1)
    is_eye = np.isin(head.faces, head.eye_vertices).any(axis=1)[first_hits(head, points)]
    depth = between_lids(points)
    assert depth[is_eye].min() > -1
    assert is_eye[depth > 2].all()


def test_eyes_do_not_overlap_the_skin_in_the_texture() -> None:
    """The discs of the eyeballs lie within the picture and outside that of the head."""
    uv = eyeballs().uv
    assert uv.min() > 0
    assert uv.max() < 1
    head = default_head()
    assert has_default_eyes(head)
    skin = np.unique(head.skin_faces())
    assert (
        np.linalg.norm(uv - 0.5, axis=1).min() > np.linalg.norm(head.uv[skin] - 0.5, axis=1).max()
    )


def photograph(iris: tuple[float, float, float], white: tuple[float, float, float]) -> View:
    """Return a view of two drawn eyes, 40 pixels wide, and their landmarks."""
    points = np.zeros((68, 2))
    photo = np.full((120, 240, 3), (190, 150, 130), np.uint8)
    rows, columns = np.mgrid[:120, :240] + 0.5
    for eye, x in zip(EYES, (70.0, 170.0), strict=True):
        off = np.array([[-20, 0], [-8, -7], [8, -7], [20, 0], [8, 6], [-8, 6]])
        points[eye] = off + np.array([x, 60.0])
        opening = np.abs(rows - 60) < 7 * (1 - ((columns - x) / 20) ** 2)
        distance = np.hypot(columns - x - 2, rows - 60)
        for colour, within in ((white, opening), (iris, distance < 9), ((15,) * 3, distance < 3)):
            photo[opening & within] = colour
    return View("front", 0.0, photo, landmarks=points)


def test_colours_are_those_of_the_photos() -> None:
    """Iris and white of drawn eyes are found, times the view's gain; without eyes, average ones."""
    iris, white = (70.0, 110.0, 150.0), (205.0, 200.0, 190.0)
    found = find_eye_colours([photograph(iris, white)], np.full((1, 3), 1.1))
    np.testing.assert_allclose(found[0], 1.1 * np.array(iris), atol=3)
    np.testing.assert_allclose(found[1], 1.1 * np.array(white), atol=3)
    unseen = View("back", 180.0, np.zeros((8, 8, 3), np.uint8))
    assert find_eye_colours([unseen], np.ones((1, 3))) == (IRIS, SCLERA)


def test_the_iris_has_its_colour() -> None:
    """The painted iris has the given colour on average, the pupil is dark, beside it is white."""
    uv = eyeballs().uv
    blue = (60.0, 90.0, 140.0)
    painted = paint_eyes(uv, blue)
    assert painted[0].max() < 20
    rim = paint_eyes(uv[:1] + np.column_stack([0.0135 * np.cos(np.arange(40)),
                                               0.0135 * np.sin(np.arange(40))]), blue)  # fmt: skip
    np.testing.assert_allclose(rim.mean(axis=0), blue, rtol=0.15)
    assert paint_eyes(uv[:1] + np.array([0.026, 0.0]), blue).min() > 180
