"""Laws of telling a braid from a plain tail."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.field.find_ties import measure_crossing
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap, wrap_angle

HEAD = ball_head(rings=12)
CAMERAS = tuple(
    Camera.on_turn(90.0 * k, distance=0.9, focal=300.0, width=160, height=220) for k in range(4)
)
SPINE = np.stack([np.zeros(30), np.linspace(0.0, -0.15, 30), np.full(30, -0.16)], axis=1)
SPOKES = np.broadcast_to([[0.02, 0, 0], [0, 0, 0.02]], (30, 2, 3))


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.6])
def test_the_crossing_is_that_of_the_pictures(angle: float) -> None:
    """Hair that leans to one side and the other by an angle from a hanging tail has that angle."""
    shape = (220, 160)
    side = np.where(np.add.outer(np.arange(220), np.arange(160)) % 2 == 0, 1.0, -1.0)
    lean = wrap_angle(np.full(shape, np.pi / 2) + angle * side).astype(np.float32)
    maps = [OrientationMap(lean, np.ones(shape, np.float32))] * 4
    masks = [Mask(np.full(shape, 255, np.uint8), True)] * 4
    found = measure_crossing(SPINE, SPOKES, masks, maps, CAMERAS, HEAD)
    assert found == pytest.approx(angle, abs=0.06)


def test_a_tail_that_no_view_sees_crosses_nothing() -> None:
    """Without views the angle is 0."""
    assert measure_crossing(SPINE, SPOKES, [], [], [], HEAD) == 0
