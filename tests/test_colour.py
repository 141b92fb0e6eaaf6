"""Laws of the sRGB curve."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from hairkit.colour import linear_from_srgb, srgb_from_linear


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_curves_are_inverse(dtype: type) -> None:
    """There and back is the same value, of the same type; the curves ascend from 0 to 1."""
    values = np.linspace(0, 1, 1001, dtype=dtype)
    for there, back in ((linear_from_srgb, srgb_from_linear), (srgb_from_linear, linear_from_srgb)):
        curve = there(values)
        assert curve.dtype == dtype
        assert (np.diff(curve) > 0).all()
        np.testing.assert_allclose(curve[[0, -1]], [0, 1], atol=1e-6)
        np.testing.assert_allclose(back(curve), values, atol=1e-5)


def test_the_curve_is_opencvs() -> None:
    """OpenCV's conversion to CIE XYZ starts from the same linear light."""
    grey = np.linspace(0, 1, 256, dtype=np.float32)
    luminance = cv2.cvtColor(np.repeat(grey[None, :, None], 3, axis=2), cv2.COLOR_RGB2Luv)[0, :, 0]
    lightness = 116 * np.cbrt(linear_from_srgb(grey)) - 16
    bright = grey > 0.2  # darker ones are on the straight piece of CIE's curve
    np.testing.assert_allclose(luminance[bright], lightness[bright], atol=0.3)
