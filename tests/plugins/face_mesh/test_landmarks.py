"""Laws of the table of landmarks and of the head's angles, without any network."""

from __future__ import annotations

import numpy as np
import pytest
from hairkit_plugins.face_mesh import OVERSHOOT, measure_angles
from hairkit_plugins.face_mesh.crops import EDGE, Crop, crop_around, wobble
from hairkit_plugins.face_mesh.landmark_table import MIRROR, noise_of, pick_landmarks
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hairkit.head_model.template import default_head
from hairkit.types.camera import Camera

PLAIN, MIRRORED = np.array([False]), np.array([True])


def mesh(rng: np.random.Generator) -> np.ndarray:
    """Return a made-up mesh (1, 468, 3)."""
    return rng.uniform(0, 300, (1, 468, 3))


def test_landmarks_move_with_the_mesh(rng: np.random.Generator) -> None:
    """Shift, turn and scale the mesh, and the landmarks move in the same way."""
    points = mesh(rng)
    turn = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    moved = 1.7 * points @ turn.T + [40, -20, 5]
    expected = 1.7 * pick_landmarks(points, PLAIN) @ turn.T + [40, -20, 5]
    assert np.allclose(pick_landmarks(moved, PLAIN), expected, atol=0.05)  # weights have 5 decimals


def test_a_mirrored_mesh_gives_landmarks_in_mirrored_order(rng: np.random.Generator) -> None:
    """Left and right change places where the network saw the mirror image; twice is nothing."""
    points = mesh(rng)
    plain, mirrored = pick_landmarks(points, PLAIN), pick_landmarks(points, MIRRORED)
    assert np.array_equal(mirrored[0], plain[0][MIRROR])
    assert np.array_equal(MIRROR[MIRROR], np.arange(68))


def test_the_mirror_of_landmarks_is_that_of_the_head() -> None:
    """The default head, which is symmetric, is its own mirror image in the table's order."""
    head = default_head()
    places = head.vertices[np.asarray(head.landmark_vertices)]
    assert np.abs(places[MIRROR] * [-1, 1, 1] - places).max() < 2e-3


def test_noise_grows_with_the_picture_and_to_the_side() -> None:
    """The noise is a share of the face's size, and larger at 45 degrees than in front."""
    assert np.allclose(noise_of(20, 600), 2 * noise_of(20, 300))
    assert noise_of(45, 300).mean() > noise_of(0, 300).mean()
    assert np.allclose(noise_of(46, 300), noise_of(-45, 300))


@given(azimuth=st.floats(-55, 55), elevation=st.floats(-30, 40), roll=st.floats(-30, 30))
def test_angles_of_a_turned_head_are_read_back(
    azimuth: float, elevation: float, roll: float
) -> None:
    """Where the camera stands comes back from the landmarks in space, but for the overshoot."""
    head = default_head()
    places = head.vertices[np.asarray(head.landmark_vertices)].astype(np.float64)
    camera = Camera.on_turn(
        azimuth, elevation_deg=elevation, roll_deg=roll, focal=1000.0, width=800, height=800
    )
    found = measure_angles(700 * places @ camera.rotation.T + [300, 400, 10])
    expected = (azimuth * (1 - OVERSHOOT * abs(azimuth)), elevation, roll)
    assert np.allclose(found, expected, atol=1e-2)


@given(angle=st.floats(-3.1, 3.1), mirrored=st.booleans())
def test_a_crop_maps_its_middle_and_its_upper_edge(angle: float, mirrored: bool) -> None:
    """The middle of the crop is its centre in the photo, and its upper edge has its angle."""
    crop = Crop((120.0, 80.0), 96.0, angle, mirrored)
    matrix = crop.matrix()
    corners = np.array([[EDGE / 2, EDGE / 2, 1], [0, 0, 1], [EDGE, 0, 1]]) @ matrix.T
    assert np.allclose(corners[0], [120, 80])
    edge = (corners[2] - corners[1]) * (-1 if mirrored else 1)
    assert np.allclose(edge, 96 * np.array([np.cos(angle), np.sin(angle)]))


def test_a_crop_around_a_mesh_holds_it_upright(rng: np.random.Generator) -> None:
    """All points lie inside, and the eyes on a level line."""
    points = mesh(rng)[0]
    crop = crop_around(points)
    to_photo = crop.matrix()
    inside = np.linalg.solve(to_photo[:, :2], (points[:, :2] - to_photo[:, 2]).T).T
    assert (inside > 0).all()
    assert (inside < EDGE).all()
    assert inside[33, 1] == pytest.approx(inside[263, 1])
    assert inside[33, 0] < inside[263, 0]


def test_wobbled_crops_come_in_mirrored_pairs() -> None:
    """The first crop is unmoved, and the mirrored ones lie where the mirrored photo has them."""
    crop = Crop((50.0, 60.0), 100.0, 0.0)
    plain, mirrored = wobble(crop, 3)[:3], wobble(crop, 3)[3:]
    assert plain[0] == crop
    assert all(copy.mirrored for copy in mirrored)
    for one, other in zip(plain, mirrored, strict=True):
        assert one.size == other.size
        assert np.allclose(np.subtract(one.centre, (50, 60)) * [-1, 1] + (50, 60), other.centre)
