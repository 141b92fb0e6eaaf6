"""Laws of files' axes and units."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hairkit.io.coordinate_space import SPACES, FileSpace, SpaceOptions

coordinates = hnp.arrays(np.float32, (5, 3), elements=st.floats(-2, 2, width=32))
names = st.sampled_from(sorted(SPACES))


@given(points=coordinates, name=names)
def test_there_and_back_is_the_same(points: np.ndarray, name: str) -> None:
    """Writing, then reading, gives the points back within float32."""
    space = SpaceOptions(name).space
    back = space.points_to_head(space.points_to_file(points))
    assert np.allclose(back, points, rtol=3e-7, atol=1e-30)


@given(points=coordinates, name=names)
def test_lengths_change_by_the_unit_only(points: np.ndarray, name: str) -> None:
    """A file's coordinates are a rotation or mirroring of the head frame, times the unit."""
    space = SpaceOptions(name).space
    lengths = np.linalg.norm(space.points_to_file(points).astype(float), axis=1) * space.metres
    assert np.allclose(lengths, np.linalg.norm(points.astype(float), axis=1), atol=1e-6)
    turned = np.linalg.norm(space.directions_to_file(points).astype(float), axis=1)
    assert np.allclose(turned, np.linalg.norm(points.astype(float), axis=1), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "up", "face"),
    [
        ("y_up_metres", (0, 1, 0), (0, 0, 1)),
        ("y_up_centimetres", (0, 100, 0), (0, 0, 100)),
        ("z_up_metres", (0, 0, 1), (0, -1, 0)),
        ("z_up_centimetres", (0, 0, 100), (0, -100, 0)),
        ("unreal", (0, 0, 100), (0, 100, 0)),
    ],
)
def test_up_and_face_lie_where_programs_expect(
    name: str, up: tuple[int, ...], face: tuple[int, ...]
) -> None:
    """One metre up, and one out of the face, in the file's axes and unit."""
    found = SpaceOptions(name).space.points_to_file(np.array([[0, 1, 0], [0, 0, 1]]))
    assert np.allclose(found, [up, face])


@pytest.mark.parametrize("name", sorted(SPACES))
def test_faces_stay_outward(name: str) -> None:
    """The normal of a triangle, computed in the file as its handedness has it, points the same."""
    space = SpaceOptions(name).space
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 0, -1]], np.float32)
    faces = np.array([[0, 1, 2]], np.int32)
    a, b, c = space.points_to_file(corners)[space.faces_to_file(faces)[0]].astype(float)
    normal = np.cross(b - a, c - a)
    wanted = space.directions_to_file(np.array([[0, 1, 0]], np.float32))[0]
    assert np.allclose(normal / np.linalg.norm(normal), wanted)
    assert space.mirrored == (name == "unreal")
    assert np.array_equal(space.faces_to_file(space.faces_to_file(faces)), faces)


@given(points=coordinates, name=names, angle=st.floats(-3, 3))
def test_transforms_move_points_alike(points: np.ndarray, name: str, angle: float) -> None:
    """Moving in the head frame, then writing, is writing, then moving in the file."""
    space = SpaceOptions(name).space
    cos, sin = np.cos(angle), np.sin(angle)
    move = np.array([[cos, 0, sin, 0.1], [0, 1, 0, -0.2], [-sin, 0, cos, 0.3], [0, 0, 0, 1]])
    ours = space.points_to_file(points @ move[:3, :3].T + move[:3, 3])
    theirs = space.transform_to_file(move)
    moved = space.points_to_file(points) @ theirs[:3, :3].T + theirs[:3, 3]
    assert np.allclose(ours * space.metres, moved * space.metres, atol=2e-6)


def test_a_scale_overrules_the_unit() -> None:
    """`scale` says metres per unit; 0 leaves the unit of `axis`."""
    assert SpaceOptions("y_up_centimetres", 0.5).space == FileSpace("y_up", 0.5)
    assert SpaceOptions("y_up_centimetres").space == FileSpace("y_up", 0.01)
