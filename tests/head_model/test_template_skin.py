"""Laws of the painted skin: the shipped picture is the painted one, features lie at landmarks."""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import Float64Array
from hairkit.head_model.template import default_head
from hairkit.head_model.template_skin import paint_skin, template_maps

LIPS = slice(48, 60)
BROWS = slice(17, 27)


def _colour(vertices: list[int] | np.ndarray) -> Float64Array:
    """Colours of the default head at vertices."""
    head = default_head()
    assert head.maps is not None
    assert head.maps.albedo is not None
    return np.asarray(head.maps.albedo.sample(head.uv[vertices]), np.float64)


def test_the_shipped_picture_is_what_the_program_paints() -> None:
    """Painted again, smaller, the picture is the shipped one within JPEG's losses."""
    shipped = template_maps().albedo
    assert shipped is not None
    small = cv2.resize(shipped.pixels, (256, 256), interpolation=cv2.INTER_AREA)
    off = np.abs(small.astype(int) - paint_skin(256))
    assert off.mean() < 2
    assert np.quantile(off, 0.99) < 30


def test_eyes_brows_and_lips_lie_at_their_landmarks() -> None:
    """Brows are darker than the forehead, lips darker and redder, pupils in front and dark."""
    head = default_head()
    marks = head.landmark_vertices
    assert marks is not None
    forehead = np.linalg.norm(head.vertices - [0.0, 0.02, 0.09], axis=1).argmin()
    skin = _colour([int(forehead)])[0]
    assert _colour(marks[BROWS]).mean() < skin.mean() - 0.12
    lips = _colour(marks[LIPS]).mean(axis=0)
    assert lips[0] / lips[1] > 1.03 * skin[0] / skin[1]
    assert lips.mean() < skin.mean() - 0.02
    assert head.eye_vertices is not None
    pupils = _colour(head.eye_vertices[:, 0])
    assert pupils.max() < 0.2
