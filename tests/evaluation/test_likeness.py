"""Laws of the brightness of drawn hair over that of photos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit.evaluation.brightness import brightness_ratios
from hairkit.grooming.densify import densify
from hairkit.rendering.picture import draw_views
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera

CAMERAS = [Camera.on_turn(a, focal=600.0, width=270, height=360) for a in (0.0, 90.0)]


def test_a_picture_of_the_hair_is_as_bright_as_it() -> None:
    """Photos that are drawings of the groom give 1; half as bright, 2; dark hair on them, less."""
    groom = bristle_groom()
    photos = draw_views(densify(groom, 300), groom.head, CAMERAS, material=groom.material)
    hair = [np.ones(photo.shape[:2], np.bool_) for photo in photos]
    ratios = brightness_ratios(groom, CAMERAS, photos, hair, 300)
    assert ratios == pytest.approx((1, 1), abs=0.01)
    dim = [photo // 2 for photo in photos]
    assert brightness_ratios(groom, CAMERAS, dim, hair, 300) == pytest.approx((2, 2), abs=0.02)
    black = replace(groom.material, root_colour=np.zeros(3), tip_colour=np.zeros(3))
    darker = brightness_ratios(replace(groom, material=black), CAMERAS, photos, hair, 300)
    assert darker is not None
    assert max(darker) < 1
