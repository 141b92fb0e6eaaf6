"""Laws of the torso and of finding it in silhouettes."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hairkit_plugins.visual_hull.torso_fit import fit_torso

from hairkit.cameras.depth_raster import mesh_depth
from hairkit.head_model.template import default_head
from hairkit.head_model.torso import Torso
from hairkit.types.camera import Camera
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.volume import VoxelGrid

HEAD = default_head()
USUAL = Torso.under(HEAD)
PEOPLE = {
    "usual": USUAL,
    "broad": replace(USUAL, breadth=1.2, depth=1.1, drop=-0.01),
    "narrow": replace(USUAL, breadth=0.85, depth=0.8, slope=0.8, drop=0.02),
    "turned": replace(USUAL, yaw=0.15, sideways=0.015, forward=0.02, roll=0.05),
}


def cameras(model: str = "perspective") -> list[Camera]:
    """Eight cameras around the head, each a little higher or lower than the one before."""
    return [
        Camera.on_turn(
            45.0 * i,
            elevation_deg=3.0 * (-1) ** i,
            distance=0.8,
            target=np.array([0.0, -0.12, 0.0]),
            focal=400.0 if model == "perspective" else 500.0,
            width=240,
            height=320,
            model="perspective" if model == "perspective" else "orthographic",
        )
        for i in range(8)
    ]


def pictured(torso: Torso, views: list[Camera], hair: float = 0.0) -> list[Mask]:
    """Masks of head and torso; everything above the ears, and a rim of `hair` metres on the
    silhouette's upper half, is hair."""
    masks = []
    for camera in views:
        body = np.isfinite(mesh_depth(*torso.mesh(), camera))
        whole = body | np.isfinite(mesh_depth(HEAD.vertices, HEAD.faces, camera))
        top = int(camera.project([0.0, 0.05, 0.0])[1])
        labels = np.where(whole, PERSON, BACKGROUND).astype(np.uint8)
        labels[:top][whole[:top]] = HAIR
        if hair:
            size = 2 * round(hair * 500) + 1
            disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
            rim = (cv2.dilate(whole.astype(np.uint8), disc) > 0) & ~whole
            rim[camera.height * 3 // 4 :] = False
            labels[rim] = HAIR
        masks.append(Mask(labels, True))
    return masks


@pytest.mark.parametrize(
    ("person", "model"),
    [*((person, "perspective") for person in PEOPLE), ("broad", "orthographic")],
)
def test_a_torso_comes_back_from_its_silhouettes(person: str, model: str) -> None:
    """Whoever stands there: fitted and true shoulders and chest are nearly the same cells."""
    true, views = PEOPLE[person], cameras(model)
    found = fit_torso(HEAD, views, pictured(true, views))
    assert found is not None
    half = np.array([0.3, 0.1, 0.2])
    low, high = USUAL.joint - half * [1, 2, 1], USUAL.joint + half * [1, 0, 1]
    grid = VoxelGrid.around(low, high, 0.008)
    mine, theirs = found.inside(grid), true.inside(grid)
    assert (mine & theirs).sum() > 0.93 * (mine | theirs).sum()
    assert abs(np.log(found.breadth / true.breadth)) < 0.08
    assert abs(found.yaw - true.yaw) < 0.08


def test_hair_on_the_shoulders_is_no_shoulder() -> None:
    """A rim of hair 12 mm thick makes the torso grow by less than half of that."""
    views = cameras()
    found = fit_torso(HEAD, views, pictured(USUAL, views, hair=0.012))
    assert found is not None
    heights = np.linspace(0.0, -0.08, 8)
    outward = USUAL.surface(heights, 32) - USUAL.surface(heights, 32).mean(axis=1, keepdims=True)
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    growth = ((found.surface(heights, 32) - USUAL.surface(heights, 32)) * outward).sum(axis=-1)
    assert growth.mean() < 0.006


def test_without_clothes_there_is_no_torso() -> None:
    """Masks that know hair alone, photos cropped at the chin, and too few of many give None."""
    views = cameras()
    masks = pictured(USUAL, views)
    hair_only = [Mask(np.where(m.labels == HAIR, m.labels, 0), False) for m in masks]
    assert fit_torso(HEAD, views, hair_only) is None
    assert fit_torso(HEAD, views, [*masks[:2], *hair_only[2:]]) is None
    assert fit_torso(HEAD, views[:2], masks[:2]) is not None
    chin = int(min(camera.project(USUAL.joint)[1] for camera in views))
    cropped = [replace(camera, height=chin) for camera in views]
    assert fit_torso(HEAD, cropped, [Mask(m.labels[:chin], True) for m in masks]) is None


def test_what_is_no_torso_is_not_taken_for_one() -> None:
    """Where the person fills the whole lower part of every picture, nothing is fitted."""
    views = cameras()
    masks = []
    for camera, mask in zip(views, pictured(USUAL, views), strict=True):
        labels = mask.labels.copy()
        labels[camera.height // 3 :][labels[camera.height // 3 :] == BACKGROUND] = PERSON
        masks.append(Mask(labels, True))
    assert fit_torso(HEAD, views, masks) is None


@pytest.mark.parametrize("person", PEOPLE)
def test_the_surface_parts_inside_from_outside(person: str) -> None:
    """Cells a little within the surface are inside, those a little beyond are not; `depth` moves
    the border in."""
    torso = PEOPLE[person]
    heights = np.linspace(0.03, -0.3, 9)
    skin = torso.surface(heights, 24)
    middle = skin.mean(axis=1, keepdims=True)
    for share, expected in ((0.9, True), (1.1, False)):
        for point in (middle + share * (skin - middle)).reshape(-1, 3)[::23]:
            cell = VoxelGrid(point - 5e-4, 1e-3, (1, 1, 1))
            assert torso.inside(cell)[0, 0, 0] == expected
            assert not torso.inside(cell, depth=0.05)[0, 0, 0] or expected
    grid = VoxelGrid.around(skin.min(axis=(0, 1)), skin.max(axis=(0, 1)), 0.02)
    whole, core = torso.inside(grid), torso.inside(grid, depth=0.02)
    assert core.any()
    assert not (core & ~whole).any()
    assert core.sum() < whole.sum()
