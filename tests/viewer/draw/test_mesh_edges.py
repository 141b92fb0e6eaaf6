"""Laws of smooth outlines."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import UInt8Array
from hairkit.viewer.draw.mesh_edges import (
    Replaced,
    list_edges,
    put_back,
    select_outlines,
    smooth_outlines,
)

SIZE = 64
SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 17.3
FACES = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
BRIGHT = 200


class Scene:
    """A bright square before black, with one sample a pixel, turned by an angle in radians."""

    def __init__(self, angle: float) -> None:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        self.seen = np.full((4, 4), 0.5, np.float32)
        self.seen[:, :2] = SQUARE @ turn.T + (31.7, 32.4)
        vertices = np.pad(self.seen[:, :2], ((0, 0), (0, 1)))
        self.edges = list_edges(vertices, FACES)
        middles = np.stack(np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij"), -1) + 0.5
        local = (middles - (31.7, 32.4)) @ turn
        inside = (np.abs(local) < 17.3).all(axis=-1)
        self.depth = np.where(inside, 0.5, 1.0).astype(np.float32)
        self.meshes = np.zeros((SIZE, SIZE, 4), np.uint8)
        self.meshes[inside.T] = BRIGHT
        self.replaced = Replaced.for_picture(self.meshes)

    def smooth(self, picture: UInt8Array) -> None:
        """Smooth the square's outlines in the picture."""
        outlines = np.empty((len(self.edges), 3), np.int32)
        outlines = outlines[: select_outlines(self.edges, self.seen, outlines)]
        smooth_outlines(outlines, self.seen, self.meshes, self.depth, picture, self.replaced)


def test_edges_of_a_seam_are_one() -> None:
    """Two triangles have five edges, also if each has vertices of its own; one has two faces."""
    vertices = np.random.default_rng(1).normal(size=(4, 3)).astype(np.float32)
    for v, faces in (
        (vertices, FACES),
        (vertices[FACES.reshape(-1)], np.arange(6, dtype=np.int32).reshape(2, 3)),
    ):
        edges = list_edges(v, faces)
        assert len(edges) == 5
        assert (edges[:, 3] >= 0).sum() == 1
        a, b, c, d = v[edges[edges[:, 3] >= 0][0]]
        corners = {tuple(x) for x in (a, b)}
        assert corners == {tuple(vertices[0]), tuple(vertices[2])}
        assert {tuple(c), tuple(d)} == {tuple(vertices[1]), tuple(vertices[3])}


@pytest.mark.parametrize("angle", [0.0, 0.1, 0.4, np.pi / 4, 1.3, 2.0, 3.5])
def test_pixels_are_as_bright_as_they_are_covered(angle: float) -> None:
    """Nine of ten pixels on outlines are within an eighth of their coverage, and the mean error and
    that of the area are small."""
    scene = Scene(angle)
    picture = scene.meshes.copy()
    scene.smooth(picture)
    fine = (np.arange(SIZE * 16) + 0.5) / 16
    x, y = np.meshgrid(fine - 31.7, fine - 32.4)
    across = (
        np.abs(x * np.cos(angle) + y * np.sin(angle)),
        np.abs(y * np.cos(angle) - x * np.sin(angle)),
    )
    inside = (across[0] < 17.3) & (across[1] < 17.3)
    covered = BRIGHT * inside.reshape(SIZE, 16, SIZE, 16).mean(axis=(1, 3))
    off = np.abs(picture[:, :, 0] - covered)
    before = np.abs(scene.meshes[:, :, 0] - covered)
    assert np.quantile(off[before > 0], 0.9) < 0.12 * BRIGHT
    assert off.mean() < 0.4 * before.mean() + 1e-3
    assert picture[:, :, 0].sum() == pytest.approx(covered.sum(), rel=4e-3)


def test_what_was_smoothed_can_be_put_back() -> None:
    """Putting back gives the picture as it was, whatever was smoothed twice."""
    scene = Scene(0.3)
    picture = scene.meshes.copy()
    scene.smooth(picture)
    scene.smooth(picture)
    assert (picture != scene.meshes).any()
    put_back(picture, scene.replaced)
    np.testing.assert_array_equal(picture, scene.meshes)
    assert scene.replaced.used[0] == 0


def test_outlines_that_nobody_sees_stay() -> None:
    """Hair over the mesh, or a mesh before it, leaves the picture as it is."""
    scene = Scene(0.3)
    hair = scene.meshes.copy()
    hair[scene.depth.T < 1] = 90
    picture = hair.copy()
    scene.smooth(picture)
    np.testing.assert_array_equal(picture, hair)
    scene.depth[:] = 0.2
    picture = scene.meshes.copy()
    scene.smooth(picture)
    np.testing.assert_array_equal(picture, scene.meshes)


def test_a_mesh_without_faces_has_no_edges() -> None:
    """Nothing is smoothed, and nothing fails."""
    for count in (0, 3):
        vertices = np.zeros((count, 3), np.float32)
        assert list_edges(vertices, np.empty((0, 3), np.int32)).shape == (0, 4)


@pytest.mark.parametrize("place", [1e5, -1e5, 1e30, -1e30])
def test_corners_far_outside_the_picture_are_no_harm(place: float) -> None:
    """Outlines end at the picture's edges, and can be put back."""
    scene = Scene(0.3)
    scene.seen[1, :2] = place
    picture = scene.meshes.copy()
    scene.smooth(picture)
    put_back(picture, scene.replaced)
    np.testing.assert_array_equal(picture, scene.meshes)


def test_a_full_list_ends_it() -> None:
    """No more pixels are smoothed than can be put back."""
    scene = Scene(0.3)
    scene.replaced = Replaced(
        np.empty((7, 2), np.int32), np.empty((7, 3), np.uint8), np.zeros(1, np.int64)
    )
    picture = scene.meshes.copy()
    scene.smooth(picture)
    assert (picture != scene.meshes).any(axis=2).sum() <= 7
    put_back(picture, scene.replaced)
    np.testing.assert_array_equal(picture, scene.meshes)
