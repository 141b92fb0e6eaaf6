"""Laws of the shell that continues hair to where no photo shows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.visual_hull import Options, build_hull, shell
from hairkit_plugins.visual_hull.shell import CUT_OFF

from hairkit.cameras.depth_raster import head_depth
from hairkit.field.hair_depth import HairDepth
from hairkit.head_model.template import default_head
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.scene import Scene

WIDTH, HEIGHT = 270, 360
THICK, LOW = 0.02, -0.12
"""Metres of hair beside the head, and where it ends."""
OPTIONS = Options(voxel_size=0.006)


def photo(azimuth: float = 0.0, aside: float = 0.0) -> tuple[Scene, tuple[Mask, ...]]:
    """One photo of the default head with a bob, whose side may be thicker by `aside` metres."""
    head = default_head()
    camera = Camera.on_turn(
        azimuth, distance=0.8, target=[0, -0.05, 0], focal=600.0, width=WIDTH, height=HEIGHT
    )
    depth = head_depth(head, camera)
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    across = camera.unproject(np.stack([x, y], axis=-1), np.full(x.shape, 0.8))
    side = across @ np.array([np.cos(np.radians(azimuth)), 0, -np.sin(np.radians(azimuth))])
    wide = 0.0884 + THICK + aside * (side > 0)
    up = np.maximum(across[..., 1], 0) / (0.07 + THICK)
    hair = ((side / wide) ** 2 + up**2 < 1) & (across[..., 1] > LOW)
    hair &= (across[..., 2] < 0.06) | (across[..., 1] > 0.04)  # none before a profile's face
    person = np.isfinite(depth)
    skin = camera.unproject(np.stack([x, y], axis=-1), np.where(person, depth, 1.0))
    bare = person & (skin[..., 2] > 0.01) & (skin[..., 1] < 0.04)
    labels = np.where(hair, HAIR, np.where(person, PERSON, BACKGROUND))
    labels = np.where(bare, PERSON, labels).astype(np.uint8)
    return Scene(("photo",), (camera,), head), (Mask(labels, True),)


def cells(scene: Scene, masks: tuple[Mask, ...]) -> np.ndarray:
    """Centres (N, 3) of the dense cells; no strand's direction is known."""
    blank = [np.zeros(mask.labels.shape, np.float32) for mask in masks]
    maps = tuple(OrientationMap(each, each) for each in blank)
    hull = build_hull(scene, masks, maps, OPTIONS)
    return hull.grid.centres_of(hull.dense).astype(np.float64)


def tell(first: float, last: float) -> Callable[..., HairDepth]:
    """A network that tells the same depths everywhere, metres behind the head's origin."""

    def guess(head: Head, camera: Camera, mask: Mask, known: OrientationMap) -> HairDepth:
        at = float(camera.depth([0.0, 0.0, 0.0]))
        near, far = (np.full(mask.labels.shape, at + d, np.float32) for d in (first, last))
        return HairDepth(camera, mask.hair, near, far)

    return guess


def test_hair_behind_is_as_thick_as_beside() -> None:
    """What the photo does not show stands off the head as far as its outline, and is as long."""
    found = cells(*photo())
    level = found[np.abs(found[:, 1]) < 0.01]
    back = -default_head().vertices[:, 2].min()
    assert -level[:, 2].min() - back == pytest.approx(THICK, abs=0.008)
    behind = found[found[:, 2] < -0.07]
    assert behind[:, 1].min() == pytest.approx(LOW, abs=0.015)


def test_locks_that_bulge_beside_a_view_bulge_less_behind_the_head() -> None:
    """Hair far from every outline is as thick as they are over some centimetres together."""
    heights = shell._heights()
    support = np.full((shell.BEARINGS, len(heights)), 0.09)
    bulge = np.where(np.abs(heights + 0.04) < 0.02, 0.04, 0.0)
    sides = [(side, 0.09 + THICK + bulge) for side in (-np.pi / 2, np.pi / 2)]
    thick, there = shell._between(sides, support)
    assert there.all()
    row = int(np.abs(heights + 0.04).argmin())
    beside, behind = thick[shell._column(np.pi / 2), row], thick[0, row]
    assert beside == pytest.approx(THICK + 0.04, abs=0.002)
    assert behind < THICK + 0.02
    assert thick[0, -1] == pytest.approx(THICK, abs=0.002)


def test_hair_that_is_seen_lies_between_the_depths_that_are_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Cells behind the photo's hair follow the network, and not the outline's thickness."""
    scene, masks = photo()
    monkeypatch.setattr(shell, "guess_hair_depth", tell(-0.03, 0.05))
    found = cells(scene, masks)
    x, y = np.floor(scene.cameras[0].project(found)).astype(int).T
    seen = found[masks[0].hair[y, x]]
    assert seen[:, 2].max() == pytest.approx(0.03, abs=2 * OPTIONS.voxel_size)
    assert seen[:, 2].min() == pytest.approx(-0.05, abs=2 * OPTIONS.voxel_size)


def test_hair_beside_the_face_does_not_hide_it_from_the_side(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However near the network takes hair to be, it stays behind the eyes, if a face says where
    these are."""
    scene, masks = photo()
    monkeypatch.setattr(shell, "guess_hair_depth", tell(-0.14, 0.05))
    places = scene.head.vertices[scene.head.landmark_vertices]
    corner = places[shell.EYE_CORNERS, 2].mean()
    nearest = []
    for head in (scene.head, replace(scene.head, landmark_vertices=None)):
        found = cells(replace(scene, head=head), masks)
        level = (found[:, 1] > places[8, 1]) & (found[:, 1] < places[shell.BROWS, 1].mean())
        nearest.append(found[level & (np.abs(found[:, 0]) > 0.09), 2].max())
    assert nearest[0] < corner - shell.BEHIND_EYES + OPTIONS.voxel_size
    assert nearest[1] > corner + 0.02


@pytest.mark.parametrize("height", [-0.08, -0.1])
def test_hair_that_the_lower_edge_cuts_off_goes_on(height: float) -> None:
    """It ends `CUT_OFF` below the edge of a photo that is cropped above the hair's ends."""
    scene, masks = photo()
    edge = round(float(scene.cameras[0].project([0.1, height, 0.0])[1]))
    cropped = replace(scene, cameras=(replace(scene.cameras[0], height=edge),))
    found = cells(cropped, (Mask(masks[0].labels[:edge], True),))
    behind = found[found[:, 2] < -0.07]
    assert behind[:, 1].min() == pytest.approx(height - CUT_OFF, abs=0.02)


def test_hair_that_the_upper_edge_cuts_off_is_as_thick_as_below() -> None:
    """A photo that ends within the hair on top gives nearly the hull of the whole photo."""
    scene, masks = photo()
    edge = round(float(scene.cameras[0].project([0.0, 0.085, 0.0])[1]))
    camera = scene.cameras[0]
    cropped = replace(camera, height=HEIGHT - edge, centre=camera.centre - np.array([0.0, edge]))
    labels = masks[0].labels[edge:]
    whole = cells(scene, masks)
    found = cells(replace(scene, cameras=(cropped,)), (Mask(labels, True),))
    for beside in (0.0, 0.05):
        top, true = (each[np.abs(each[:, 0] - beside) < 0.01, 1].max() for each in (found, whole))
        assert top == pytest.approx(true, abs=0.01)


def test_seen_skin_stays_bare() -> None:
    """No cell lies before the face, nor beside what the photo shows of the hair."""
    scene, masks = photo()
    found = cells(scene, masks)
    assert not ((found[:, 2] > 0.07) & (found[:, 1] < 0.0)).any()
    x, y = np.floor(scene.cameras[0].project(found)).astype(int).T
    assert np.mean(masks[0].labels[y, x] == BACKGROUND) < 0.05


def test_the_mirrored_photo_has_the_mirrored_hull() -> None:
    """Hair that is thicker on one side is so on the other side of the mirrored photo."""
    scene, masks = photo(aside=0.02)
    mirrored = Mask(masks[0].labels[:, ::-1], True)
    other = replace(scene, cameras=(scene.cameras[0].mirrored(),))
    widths = [np.quantile(cells(*each)[:, 0], [0.01, 0.99])
              for each in ((scene, masks), (other, (mirrored,)))]  # fmt: skip
    assert widths[0] == pytest.approx(-widths[1][::-1], abs=0.008)
    assert widths[0][1] > -widths[0][0] + 0.01


@pytest.mark.parametrize("azimuth", [90.0, 180.0])
def test_side_and_back_give_a_whole_head_of_hair(azimuth: float) -> None:
    """From the side, or from behind, hair covers both sides of the head and no face."""
    found = cells(*photo(azimuth))
    assert (found[:, 0] > 0.08).any()
    assert (found[:, 0] < -0.08).any()
    face = (found[:, 2] > 0.09) & (np.abs(found[:, 1] + 0.05) < 0.04)
    assert not (face & (np.abs(found[:, 0]) < 0.04)).any()


def test_a_photo_from_the_other_side_ends_the_guess() -> None:
    """Views that leave no half of the head unseen make no shell, two always do."""
    scene, _ = photo()
    turn = [Camera.on_turn(a, focal=600.0, width=9, height=9) for a in (0.0, 135.0, 225.0)]
    assert not Scene(("a", "b", "c"), tuple(turn), scene.head).one_sided
    assert Scene(("a", "b"), tuple(turn[:2]), scene.head).one_sided
    near = [Camera.on_turn(a, focal=600.0, width=9, height=9) for a in (0.0, 40.0, 80.0)]
    assert Scene(("a", "b", "c"), tuple(near), scene.head).one_sided
