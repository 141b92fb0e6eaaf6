"""The law of smoothed volumes: they are SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from hairkit.field.smooth_volume import smooth_volume


@pytest.mark.parametrize("shape", [(9, 30, 14), (1, 5, 3), (40, 1, 2)])
@pytest.mark.parametrize("sigma", [0.7, 2.0])
def test_volumes_are_smoothed_as_scipy_does(shape: tuple[int, ...], sigma: float) -> None:
    """A volume under a Gaussian is SciPy's to rounding, also where the kernel is larger than it."""
    values = np.random.default_rng(1).normal(size=shape).astype(np.float32)
    expected = ndimage.gaussian_filter(values, sigma)
    np.testing.assert_allclose(smooth_volume(values, sigma), expected, atol=2e-6)
