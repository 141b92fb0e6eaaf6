"""Dyed hair is found in photos of it, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit import Groom
from hairkit.grooming.densify import densify
from hairkit.grooming.photo_colours import measure_colour, with_hues
from hairkit.grooming.prepare_export import point_colours
from hairkit.rendering.picture import draw_views
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, Mask

PLAIN = bristle_groom()
CAMERAS = [
    Camera.on_turn(azimuth, distance=0.6, focal=400.0, width=240, height=240)
    for azimuth in (0.0, 90.0, 180.0, 270.0)
]
HAIRS = 6000
SEEN = 25
"""Difference in levels of pixels where hair is."""


def half_pink() -> Groom:
    """Return hair that is pink on the subject's left."""
    strands, colours = PLAIN.strands, point_colours(PLAIN).copy()
    left = strands.roots[strands.strand_of_point, 0] > 0
    colours[left] = [0.4, 0.05, 0.15]
    return replace(PLAIN, strands=replace(strands, colours=colours))


def photographed(groom: Groom, light: float = 1.0) -> tuple[list[View], list[Mask]]:
    """Return photos of full hair, each exposed otherwise, and their masks."""
    hair = densify(groom, HAIRS)
    pictures = draw_views(hair, groom.head, CAMERAS, material=groom.material)
    bald = draw_views(densify(groom, HAIRS).select([0]), groom.head, CAMERAS)
    masks = [
        np.abs(each.astype(int) - without).max(axis=2) > SEEN
        for each, without in zip(pictures, bald, strict=True)
    ]
    views = [
        View(f"{k}", 90.0 * k, np.rint(each * light ** (k / 3)).astype(np.uint8))
        for k, each in enumerate(pictures)
    ]
    return views, [Mask(np.where(hair, HAIR, 0).astype(np.uint8), False) for hair in masks]


def test_hair_of_one_colour_is_not_dyed() -> None:
    """Light, shade and the exposure of the photos change no hue."""
    for light in (1.0, 0.6):
        views, masks = photographed(PLAIN, light)
        assert with_hues(PLAIN, views, masks, CAMERAS).strands.colours is None


def test_hair_of_two_hues_has_both() -> None:
    """Half of the head is pink, half brown, as bright as they are in the photos."""
    true = half_pink()
    views, masks = photographed(true)
    material = replace(measure_colour(views, masks), width=PLAIN.material.width)
    groom = replace(PLAIN, material=material)
    found = with_hues(groom, views, masks, CAMERAS).strands.colours
    assert found is not None
    x = PLAIN.strands.points[:, 0]
    assert true.strands.colours is not None
    wanted, had = (
        np.log([np.median(part[side], axis=0) for side in (x > 0.03, x < -0.03)])
        for part in (true.strands.colours, found)
    )
    assert np.abs(had.mean(axis=1) - wanted.mean(axis=1)).max() < np.log(2.5)
    hues, true_hues = (each - each.mean(axis=1, keepdims=True) for each in (had, wanted))
    between = np.abs(true_hues[0] - true_hues[1]).max()
    assert np.abs(hues - true_hues).max() < 0.5 * between  # grey light makes pink paler


def test_one_photo_dyes_no_patches() -> None:
    """It may show light of two colours: the hair has the hues of its roots and tips alone."""
    views, masks = photographed(half_pink())
    assert with_hues(PLAIN, views[:1], masks[:1], CAMERAS[:1]).strands.colours is None


def test_the_hue_is_that_of_the_strands() -> None:
    """What masks take for hair beside the strands, such as clothes, gives the hair no hue."""
    views, masks = photographed(PLAIN)
    painted = [
        replace(view, image=np.where(aside(view), [20, 40, 250], view.image).astype(np.uint8))
        for view in views
    ]
    wrong = [
        Mask(np.where(aside(view)[..., 0], HAIR, mask.labels).astype(np.uint8), False)
        for view, mask in zip(views, masks, strict=True)
    ]
    hues = []
    for photos, marked in ((views, masks), (painted, wrong)):
        groom = replace(PLAIN, material=measure_colour(photos, marked))
        look = with_hues(groom, photos, marked, CAMERAS).material
        hues.append(np.log(look.tip_colour / look.tip_colour.mean()))
    assert np.abs(hues[0] - hues[1]).max() < 0.1
    pixels = measure_colour(painted, wrong).tip_colour
    assert np.abs(np.log(pixels / pixels.mean()) - hues[0]).max() > 0.5


def aside(view: View) -> np.ndarray:
    """Return (H, W, 1) the lowest quarter of a photo."""
    low: np.ndarray = np.arange(len(view.image))[:, None, None] > 0.75 * len(view.image)
    return low & np.ones((1, view.image.shape[1], 1), bool)
