"""Laws of the hairline: bare skin loses its hair, covered and unseen skin keeps it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit.arrays import BoolArray
from hairkit.cameras.depth_raster import mesh_depth
from hairkit.head_model.hairline import measure_hairline
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.head import Head
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.scene import Scene

HAIR_THICKNESS = 1.1
"""Size of the surface of the hair over that of the scalp."""


def scene_of(head: Head) -> Scene:
    """Return eight level cameras around the head and one above it."""
    cameras = [
        Camera.on_turn(45.0 * k, distance=0.8, focal=900.0, width=300, height=400) for k in range(8)
    ]
    above = Camera.on_turn(
        0.0, elevation_deg=60.0, distance=0.8, focal=900.0, width=300, height=400
    )
    cameras.append(above)
    return Scene(tuple(str(k) for k in range(9)), tuple(cameras), head)


def masks_of(scene: Scene, hairy: BoolArray) -> tuple[Mask, ...]:
    """Return the masks of a head with hair of even thickness over the hairy vertices (V,)."""
    head = scene.head
    faces = head.faces[hairy[head.faces].all(axis=1)]
    masks = []
    for camera in scene.cameras:
        skin = mesh_depth(head.vertices, head.faces, camera)
        hair = mesh_depth((HAIR_THICKNESS * head.vertices).astype(np.float32), faces, camera)
        labels = np.where(np.isfinite(skin), PERSON, BACKGROUND)
        labels[np.isfinite(hair) & (hair < skin)] = HAIR
        masks.append(Mask(labels, True))
    return tuple(masks)


def crown(head: Head, degrees: float) -> BoolArray:
    """Return (V,) the vertices of the scalp within an angle of straight up."""
    up = head.vertices[:, 1] / np.linalg.norm(head.vertices, axis=1)
    return np.asarray((up > np.cos(np.radians(degrees))) & (head.scalp > 0.5))


def test_a_full_head_keeps_all_of_its_hair() -> None:
    """Where hair covers the whole scalp in every view the density is 1 but for the very edge."""
    scene = scene_of(default_head())
    scalp = scene.head.scalp > 0.5
    density = measure_hairline(scene, masks_of(scene, scalp)).density
    assert density[scalp].mean() > 0.97


@pytest.mark.parametrize("shift_px", [0.0, 2.0])
def test_a_bald_crown_bears_no_roots(shift_px: float) -> None:
    """A crown that is seen bare has no root, the rest keeps its hair; cameras may be a bit off."""
    scene = scene_of(default_head())
    scalp, bald = scene.head.scalp > 0.5, crown(scene.head, 40.0)
    masks = masks_of(scene, scalp & ~bald)
    moved = (replace(c, centre=(c.centre[0] + shift_px, c.centre[1])) for c in scene.cameras)
    density = measure_hairline(replace(scene, cameras=tuple(moved)), masks).density
    inner, outer = crown(scene.head, 32.0), scalp & ~crown(scene.head, 55.0)
    assert density[inner].max() < 0.05
    assert density[outer].mean() > 0.95
    head = replace(scene.head, density=density)
    roots = sample_roots(head, 500)
    up = roots.positions[:, 1] / np.linalg.norm(roots.positions, axis=1)
    assert up.max() < np.cos(np.radians(28.0))


def test_hair_grows_up_to_the_line_of_a_parting() -> None:
    """A bare strip over the crown, as narrow as a finger, closes; the forehead stays bare."""
    head = default_head()
    scene, scalp = scene_of(head), head.scalp > 0.5
    parted = scalp & (np.abs(head.vertices[:, 0]) < 0.004) & crown(head, 45.0)
    density = measure_hairline(scene, masks_of(scene, scalp & ~parted)).density
    assert density[parted].mean() > 0.9
    forehead = ~scalp & (head.vertices[:, 2] > 0.05) & (np.abs(head.vertices[:, 0]) < 0.03)
    assert density[forehead].mean() < 0.1


def test_a_fringe_does_not_hide_roots_and_nothing_is_taken_where_nobody_looks() -> None:
    """Covered skin keeps its hair, and so does skin that no camera sees."""
    head = default_head()
    whole = scene_of(head)
    masks = masks_of(whole, head.scalp > 0.5)
    back = Scene(whole.names[4:5], whole.cameras[4:5], head)
    density = measure_hairline(back, masks[4:5]).density
    assert density[head.scalp > 0.5].mean() > 0.97


def test_thinned_roots_are_those_of_the_full_sequence() -> None:
    """Density only leaves roots out; more roots begin with those of fewer, at the same places."""
    head = default_head()
    density = np.where(head.vertices[:, 0] > 0, 1.0, 0.5).astype(np.float32)
    thin = replace(head, density=density)
    few, many = sample_roots(thin, 200), sample_roots(thin, 900)
    np.testing.assert_array_equal(few.positions, many.positions[:200])
    np.testing.assert_array_equal(
        sample_roots(thin, 700, first=200).positions, many.positions[200:]
    )
    full = {tuple(place) for place in sample_roots(head, 2000).positions}
    assert all(tuple(place) in full for place in many.positions)
    side = many.positions[:, 0]
    left, right = np.count_nonzero(side > 0.005), np.count_nonzero(side < -0.005)
    assert 1.8 < left / right < 2.2


def test_density_one_changes_nothing_and_is_kept(tmp_path: Path) -> None:
    """Full density gives the roots of a head without one; a groom keeps it in its file."""
    head = default_head()
    full = replace(head, density=np.ones(len(head.vertices), np.float32))
    np.testing.assert_array_equal(
        sample_roots(full, 300).positions, sample_roots(head, 300).positions
    )
    groom = bristle_groom()
    assert (groom.root_density == 1).all()
    half = replace(groom.head, density=np.full(len(groom.head.vertices), 0.5, np.float32))
    replace(groom, head=half).save(tmp_path / "groom.npz")
    np.testing.assert_allclose(Groom.load(tmp_path / "groom.npz").root_density, 0.5, atol=1e-6)
