"""Laws of the plugin `sobel`."""

import hairkit_sobel
import numpy as np
import pytest

from hairkit.manager import Manager
from hairkit.testing import ball_mask, striped_view, turn_scene
from hairkit.types.orientation import angle_between


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 90.0, 135.0])
def test_finds_the_angle_of_stripes(angle_deg: float) -> None:
    """Strands drawn at an angle are found at that angle, wherever the gradient is strong."""
    manager = Manager()
    manager.register(hairkit_sobel, "sobel")
    mask = ball_mask(turn_scene().cameras[0])
    found = manager.call("orient", "sobel", view=striped_view(angle_deg), mask=mask)
    sure = found.confidence > 0.5
    error = np.degrees(angle_between(found.angle[sure], np.radians(angle_deg)))
    assert sure.any()
    assert np.median(error) < 1
