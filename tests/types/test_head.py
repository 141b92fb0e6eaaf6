"""Laws of the head type: its shapes and eyes fit its vertices, and move with them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich_groom import rich_groom

from hairkit.errors import DataError
from hairkit.types.head import Head
from hairkit.types.skin import Blendshape


@pytest.fixture
def head() -> Head:
    """The ball head with maps, shapes, and two vertices for each eye."""
    return replace(rich_groom().head, eye_vertices=np.array([[3, 4], [5, 6]], np.int32))


def test_a_similarity_scales_the_shapes(head: Head) -> None:
    """Turned, enlarged and moved, the head with a shape is the shape's head moved alike."""
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], np.float32)
    moved = head.carried(lambda points: 2 * points @ turn.T + np.float32(0.3), 2.0)
    for shape, before in zip(moved.blendshapes, head.blendshapes, strict=True):
        with_shape = 2 * (head.vertices + before.offsets) @ turn.T + np.float32(0.3)
        np.testing.assert_allclose(moved.vertices + shape.offsets, with_shape, atol=1e-6)
    np.testing.assert_allclose(moved.capsules.radius, 2 * head.capsules.radius)
    centres, moved_centres = head.eye_centres(), moved.eye_centres()
    assert centres is not None
    assert moved_centres is not None
    np.testing.assert_allclose(moved_centres, 2 * centres @ turn.T + 0.3, atol=1e-6)


def test_a_stored_head_comes_back(head: Head, tmp_path: Path) -> None:
    """Maps, shapes and eyes survive `save` and `load`; files without them have none."""
    head.save(tmp_path / "head.npz")
    found = Head.load(tmp_path / "head.npz")
    assert [shape.name for shape in found.blendshapes] == ["smile", "jaw_open"]
    assert found.maps is not None
    assert set(found.maps.present()) == {"albedo", "roughness", "normal", "bump"}
    np.testing.assert_array_equal(found.eye_vertices, head.eye_vertices)
    replace(head, maps=None, blendshapes=(), eye_vertices=None).save(tmp_path / "bare.npz")
    bare = Head.load(tmp_path / "bare.npz")
    assert (bare.maps, bare.blendshapes, bare.eye_vertices) == (None, (), None)


def test_shapes_and_eyes_of_another_mesh_are_refused(head: Head) -> None:
    """A shape of other vertices, a name used twice and eyes beyond the mesh are one line each."""
    shape = head.blendshapes[0]
    with pytest.raises(DataError, match="two blendshapes"):
        replace(head, blendshapes=(shape, shape))
    with pytest.raises(DataError, match="'other' has 3 vertices"):
        replace(head, blendshapes=(Blendshape("other", np.zeros((3, 3), np.float32)),))
    with pytest.raises(DataError, match="eye_vertices"):
        replace(head, eye_vertices=np.array([[0], [10**6]], np.int32))
