"""Laws of the smoothing of curves."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from hairkit.grooming.smooth_curves import smooth_curves


def test_ends_and_straight_curves_stay(rng: np.random.Generator) -> None:
    """A line is its own mean, and curves keep both ends whatever lies between."""
    ends = rng.normal(size=(5, 2, 3)).astype(np.float32)
    t = np.linspace(0, 1, 20, dtype=np.float32)[:, None]
    lines = ends[:, :1] + t * (ends[:, 1:] - ends[:, :1])
    np.testing.assert_allclose(smooth_curves(lines, 0.2), lines, atol=1e-6)
    rough = rng.normal(size=(5, 20, 3)).astype(np.float32)
    smooth = smooth_curves(rough, 0.1)
    np.testing.assert_allclose(smooth[:, [0, -1]], rough[:, [0, -1]], atol=1e-6)


def test_it_is_the_gaussian_of_curves_turned_about_their_ends(rng: np.random.Generator) -> None:
    """As SciPy's filter finds it on curves continued by hand, with a width for each curve."""
    rough = rng.normal(size=(2, 41, 3)).astype(np.float32)
    long = np.concatenate(
        [2 * rough[:, :1] - rough[:, :0:-1], rough, 2 * rough[:, -1:] - rough[:, -2::-1]], axis=1
    )
    smooth = smooth_curves(rough, np.array([0.05, 0.1]))
    for curve, wide, points in zip(smooth, long, (2, 4), strict=True):
        wanted = ndimage.gaussian_filter1d(wide, points, axis=0, truncate=8)[40:81]
        np.testing.assert_allclose(curve, wanted, atol=1e-3)


def test_no_width_and_two_points_change_nothing(rng: np.random.Generator) -> None:
    """Zero is the identity, and a curve of its two ends has nothing to smooth."""
    rough = rng.normal(size=(3, 9, 3)).astype(np.float32)
    np.testing.assert_allclose(smooth_curves(rough, 0), rough, atol=1e-6)
    np.testing.assert_allclose(smooth_curves(rough[:, :2], 0.1), rough[:, :2], atol=1e-6)
