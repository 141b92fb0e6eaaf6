"""Laws of taking the body out of the hull."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hairkit_plugins.visual_hull import Options, build_hull

from hairkit.arrays import Float32Array, Int32Array
from hairkit.cameras.depth_raster import mesh_depth
from hairkit.head_model.template import default_head
from hairkit.head_model.torso import Torso
from hairkit.types.camera import Camera
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.scene import Scene

RADIUS, BOTTOM = 0.12, -0.30
"""Of a tube of hair around the head, open in front, that ends below the shoulders; metres."""


def curtain() -> tuple[Float32Array, Int32Array]:
    """A lofted sheet of hair behind the head and down the back, over the shoulders."""
    angle = np.linspace(np.pi / 2, 3 * np.pi / 2, 41)
    height = np.linspace(0.12, BOTTOM, 30)
    rings = np.stack(
        np.broadcast_arrays(RADIUS * np.sin(angle), height[:, None], RADIUS * np.cos(angle) - 0.02),
        axis=-1,
    )
    row, column = np.meshgrid(np.arange(29), np.arange(40), indexing="ij")
    a = row * 41 + column
    faces = np.concatenate(
        [np.stack([a, a + 41, a + 1], -1), np.stack([a + 1, a + 41, a + 42], -1)]
    )
    return rings.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.int32)


def people(clothes: bool) -> tuple[Scene, tuple[Mask, ...]]:
    """A person with a curtain of hair behind, and masks that know of clothes or of hair alone."""
    head = default_head()
    cameras = tuple(
        Camera.on_turn(
            45.0 * i,
            distance=0.8,
            target=np.array([0.0, -0.12, 0.0]),
            focal=380.0,
            width=240,
            height=320,
        )
        for i in range(8)
    )
    torso = Torso.under(head).mesh()
    masks = []
    for camera in cameras:
        hair = mesh_depth(*curtain(), camera)
        body = np.minimum(mesh_depth(*torso, camera), mesh_depth(head.vertices, head.faces, camera))
        labels = np.where(np.isfinite(body), PERSON, BACKGROUND)
        labels[hair < body] = HAIR
        if not clothes:
            labels[labels == PERSON] = BACKGROUND
        masks.append(Mask(labels.astype(np.uint8), clothes))
    return Scene(tuple("abcdefgh"), cameras, head), tuple(masks)


def test_a_fitted_torso_is_taken_out_of_the_hull() -> None:
    """Hair hangs over the back: without the torso the hull reaches into the body, with it no cell
    lies deep in the body, and the hair that lies outside of it stays; the grid is smaller then."""
    scene, masks = people(clothes=True)
    options = Options(voxel_size=0.008, opening=0.0)
    filled = build_hull(scene, masks, (), replace(options, cut_body=False))
    carved = build_hull(scene, masks, (), options)
    assert filled.torso is None
    assert carved.torso is not None
    true = Torso.under(scene.head)
    assert abs(np.log(carved.torso.breadth / true.breadth)) < 0.1
    assert np.count_nonzero(filled.loose & true.inside(filled.grid, 0.02)) > 100
    assert not (carved.loose & true.inside(carved.grid, 0.02)).any()
    points = curtain()[0]
    cells = tuple(carved.grid.nearest_cell(points).T)
    hair = ~true.inside(carved.grid, -0.016)[cells] & (carved.head_distance[cells] > 0.008)
    kept = carved.loose[cells][hair]
    before = filled.loose[tuple(filled.grid.nearest_cell(points[hair]).T)]
    assert kept.sum() > 0.97 * before.sum() > 0
    assert np.prod(carved.grid.shape) < np.prod(filled.grid.shape)


def test_without_clothes_the_hull_stays_as_it_is() -> None:
    """Where no view shows clothes, asking for the body to be cut changes no cell."""
    scene, masks = people(clothes=False)
    options = Options(voxel_size=0.012, opening=0.0)
    one, other = (
        build_hull(scene, masks, (), replace(options, cut_body=cut)) for cut in (True, False)
    )
    np.testing.assert_array_equal(one.loose, other.loose)
    np.testing.assert_array_equal(one.dense, other.dense)
