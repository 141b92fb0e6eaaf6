"""Laws of the likeness of drawn hair and photos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit.arrays import UInt8Array
from hairkit.evaluation.likeness import MEASURES, likeness, measure
from hairkit.grooming.densify import densify
from hairkit.rendering.picture import draw_views
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera

CAMERAS = [Camera.on_turn(a, focal=600.0, width=270, height=360) for a in (0.0, 90.0)]


def test_a_picture_of_the_hair_looks_like_it() -> None:
    """Photos that are drawings of the groom give 1; half as bright, 2; dark hair on them, less."""
    groom = bristle_groom()
    photos = draw_views(densify(groom, 300), groom.head, CAMERAS, material=groom.material)
    hair = [np.ones(photo.shape[:2], np.bool_) for photo in photos]
    same = likeness(groom, CAMERAS, photos, hair, 300)
    assert same is not None
    assert same[:, 0] == pytest.approx((1, 1), abs=0.02)
    assert same.shape == (2, len(MEASURES))
    dim = [photo // 2 for photo in photos]
    found = likeness(groom, CAMERAS, dim, hair, 300)
    assert found is not None
    assert found[:, 0] == pytest.approx((2, 2), abs=0.04)
    black = replace(groom.material, root_colour=np.zeros(3), tip_colour=np.zeros(3))
    darker = likeness(replace(groom, material=black), CAMERAS, photos, hair, 300)
    assert darker is not None
    assert darker[:, 0].max() < 1


def stripes(pitch_px: float, contrast: float = 20.0) -> UInt8Array:
    """Return a brown picture with vertical stripes."""
    wave = contrast * np.sin(2 * np.pi * np.arange(540) / pitch_px)
    row = np.array([120.0, 90, 70]) + wave[:, None]
    return np.repeat(np.rint(row).astype(np.uint8)[None], 720, axis=0)


def test_measures_tell_pictures_apart() -> None:
    """Contrast is found at its own scale and grows with it; noise has no direction, grey no hue."""
    mask = np.ones((720, 540), np.bool_)
    fine, wide = measure(stripes(8), mask), measure(stripes(80), mask)
    assert fine[2:5].argmax() == 0
    assert wide[2:5].argmax() == 2
    faint = measure(stripes(8, 10), mask)
    assert fine[2] == pytest.approx(2 * faint[2], rel=0.1)
    noise = np.random.default_rng(0).integers(80, 120, (720, 540, 1), np.uint8).repeat(3, axis=2)
    grey = measure(noise, mask)
    assert fine[5] > 0.9 > 0.5 > grey[5]
    assert fine[1] > 10 > 1 > grey[1]


def test_what_lies_beside_the_hair_does_not_count() -> None:
    """The same hair before a white and a black wall measures the same."""
    mask = np.zeros((720, 540), np.bool_)
    mask[100:600, 100:400] = True
    light, dark = (np.where(mask[..., None], stripes(12), wall) for wall in (255, 0))
    assert measure(light.astype(np.uint8), mask) == pytest.approx(
        measure(dark.astype(np.uint8), mask), rel=0.02
    )
