"""Laws of guides that are drawn into photos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit.pipeline import drawn_hair
from hairkit.pipeline.drawn_hair import HEIGHT, SHADE, PhotoHair, compare_drawing, with_pieces
from hairkit.pipeline.health import assess_drawing
from hairkit.testing import bristle_groom, turn_scene
from hairkit.types.mask import Mask


@pytest.mark.parametrize("pitch", [0.0, 0.02])
def test_guides_are_compared_alike_however_many_at_a_time(
    monkeypatch: pytest.MonkeyPatch, pitch: float
) -> None:
    """Lengths and pixels that one view shows do not depend on the size of the blocks."""
    groom, camera = bristle_groom(), turn_scene().cameras[0]
    groom = replace(
        groom, material=replace(groom.material, curl_radius=pitch / 4, curl_pitch=pitch)
    )
    photo = np.random.default_rng(0).integers(0, 255, (camera.height, camera.width, 3), np.uint8)
    shown = PhotoHair.of(photo, Mask(np.full(photo.shape[:2], 255, np.uint8), True))
    whole = compare_drawing(with_pieces(groom), camera, shown)
    assert whole.shown > 0
    monkeypatch.setattr(drawn_hair, "AT_ONCE", 5)
    parts = compare_drawing(with_pieces(groom), camera, shown)
    assert vars(parts) == pytest.approx(vars(whole))


@pytest.mark.parametrize(("rows", "judged"), [(SHADE - 1, False), (HEIGHT, True)])
def test_directions_are_judged_away_from_the_edges_of_hair(rows: int, judged: bool) -> None:
    """A narrow band shows how the head is shaded: it has no figure of directions."""
    scene = turn_scene()
    random = np.random.default_rng(0)
    shown = []
    for camera in scene.cameras:
        size = round(HEIGHT * camera.width / camera.height), HEIGHT
        labels = np.zeros(size[::-1], np.uint8)
        labels[HEIGHT // 2 - rows // 2 :][:rows] = 255
        photo = random.integers(0, 255, (*labels.shape, 3), np.uint8)
        shown.append(PhotoHair.of(photo, Mask(labels, True)))
    assert any(each.judged.any() for each in shown) == judged
    figures = assess_drawing(shown, scene, bristle_groom(), 0.0)
    assert ("directions as photographed" in [figure.name for figure in figures]) == judged
