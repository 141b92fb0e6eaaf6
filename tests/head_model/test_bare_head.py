"""Laws of the part of a photo where the head bears no hair."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.head_model.bare_head import BESIDE, FULL, NONE, mark_bare_head, mark_upper_head
from hairkit.head_model.template import default_head
from hairkit.types.camera import Camera

PIXELS = 1000.0
"""Pixels a metre of the orthographic cameras."""
NOSE, CROWN = (0.0, -0.07, 0.1), (0.0, 0.065, 0.0)
ABOVE, COLLAR = (0.0, 0.09, 0.0), (0.0, -0.2, -0.08)
"""Hair on the crown, and where a hood lies behind the neck."""


def camera(azimuth: float) -> Camera:
    return Camera.on_turn(azimuth, focal=PIXELS, width=400, height=600, model="orthographic")


def value(azimuth: float, point: tuple[float, float, float]) -> float:
    u, v = camera(azimuth).project(point)
    return float(mark_bare_head(default_head(), camera(azimuth))[int(v), int(u)])


@pytest.mark.parametrize(
    ("azimuth", "point", "bare"), [(0, NOSE, 1), (0, CROWN, 0), (180, NOSE, 0), (90, NOSE, 1)]
)
def test_face_is_bare_and_scalp_is_not(
    azimuth: float, point: tuple[float, float, float], bare: int
) -> None:
    """The nose is bare in front and in profile; behind, the scalp hides it."""
    assert value(azimuth, point) == pytest.approx(bare, abs=0.02)


def test_what_sticks_out_belongs_to_the_nearest_part() -> None:
    """Before the chin a beard's pixels are bare, as far as beards reach, and none beyond."""
    head = default_head()
    assert head.landmark_vertices is not None
    chin = head.vertices[head.landmark_vertices[8]].astype(float)
    ahead = max(float(head.vertices[:, 2].max()), chin[2])
    near = (0.0, chin[1], chin[2] + 0.3 * FULL)
    far = (0.0, chin[1], ahead + NONE + 0.01)
    assert value(90, near) > 0.9
    assert value(90, far) == 0


def test_a_mirrored_view_is_the_mirror_image() -> None:
    """Left and right of the symmetric head are alike, but for pixels at the border."""
    left, right = (mark_bare_head(default_head(), camera(side)) for side in (-60, 60))
    assert np.abs(left - right[:, ::-1]).mean() < 0.01


@pytest.mark.parametrize("azimuth", [0, 90, 180])
def test_the_upper_head_reaches_from_the_brows_to_the_hair_on_it(azimuth: float) -> None:
    """Crown and the hair above it are of the upper head from all sides; chin and collar are not."""
    upper = mark_upper_head(default_head(), camera(azimuth))
    chin, higher = (0.0, -0.11, 0.08), (0.0, CROWN[1] + BESIDE + 0.02, 0.0)
    for point, share in ((CROWN, 1), (ABOVE, 1), (higher, 0), (chin, 0), (COLLAR, 0)):
        u, v = camera(azimuth).project(point)
        assert upper[int(v), int(u)] == share


def test_no_head_marks_nothing() -> None:
    """A camera that does not see the head gets empty maps."""
    away = Camera.on_turn(0, target=(9, 9, 0), distance=1.0, focal=900, width=80, height=60)
    assert not mark_bare_head(default_head(), away).any()
    assert not mark_upper_head(default_head(), away).any()
