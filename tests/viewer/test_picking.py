"""Laws of hair under the mouse."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.types.camera import Camera
from hairkit.types.strands import Strands
from hairkit.viewer.picking import LOCK_RADIUS, grab_lock, nearest_hair

CAMERA = Camera.on_turn(0.0, distance=1.0, focal=500.0, width=400, height=400)
Y = np.array([0.15, 0.1, 0.0, -0.1], np.float32)
STRANDS = Strands.from_list(
    [np.stack([np.full(4, x), Y, np.full(4, 0.1)], axis=1) for x in (-0.1, 0.0, 0.01, 0.1)]
)


@pytest.mark.parametrize("height", [-0.095, -0.06, -0.04, 0.03])
def test_a_guide_is_picked_between_its_points(height: float) -> None:
    """What is nearest is a place on the guide; the guide's nearer point stands for it."""
    pixel = CAMERA.project(np.array([0.1, height, 0.1]))
    found = nearest_hair(CAMERA, STRANDS.points, STRANDS.offsets, pixel)
    assert found is not None
    assert found[0] == 12 + np.argmin(np.abs(Y - height))
    np.testing.assert_allclose(found[1], [0.1, height, 0.1], atol=0.1 / 16 + 1e-6)


def test_nothing_is_picked_beside_hair() -> None:
    """A pixel far from every guide picks none, and grabs none."""
    pixel = CAMERA.project(np.array([0.05, 0.0, 0.1]))
    assert nearest_hair(CAMERA, STRANDS.points, STRANDS.offsets, pixel) is None
    assert grab_lock(CAMERA, STRANDS.points, STRANDS.offsets, pixel) is None


def test_a_lock_holds_what_is_near_the_mouse_however_far_the_points() -> None:
    """A grab between points holds one point of each strand near it, and moves nothing by itself."""
    pixel = CAMERA.project(np.array([0.0, -0.06, 0.1]))
    lock = grab_lock(CAMERA, STRANDS.points, STRANDS.offsets, pixel)
    assert lock is not None
    assert lock.points.tolist() == [7, 11]  # the tips of two strands, more than a radius away
    assert np.linalg.norm(lock.offsets, axis=1).min() > LOCK_RADIUS
    for grab in lock.grabs():
        np.testing.assert_allclose(grab.target, STRANDS.points[grab.point], atol=1e-6)
