"""The search for cameras where one view is held by a false minimum."""

from __future__ import annotations

import numpy as np

from hairkit.cameras.camera_search import Evidence, Fit, Search
from hairkit.cameras.turntable import PER_VIEW, SHARED

FALSE, STIFFNESS, DEARER = 0.8, 1e4, 50.0
"""Elevation of the false minimum, radians, how narrow both minima are, and its cost."""


def two_minima(fit: Fit, noise: float) -> Evidence:
    """Return the evidence of the first view's elevation: 0, or `FALSE` from half of it on."""
    at = fit.vector[SHARED + 1]
    nearer = FALSE if at > FALSE / 2 else 0.0
    normal, right = np.zeros((len(fit.vector),) * 2), np.zeros(len(fit.vector))
    normal[SHARED + 1, SHARED + 1] = STIFFNESS
    right[SHARED + 1] = STIFFNESS * (nearer - at)
    cost = STIFFNESS * (nearer - at) ** 2 + (DEARER if nearer else 0.0)
    return Evidence(cost, normal, right, None)


def test_a_view_far_above_the_others_is_tried_level() -> None:
    """From the false minimum of one view of three the search comes to the true one."""
    vector = np.zeros(SHARED + 3 * PER_VIEW)
    start = Fit(vector.copy(), np.zeros((68, 3)), True, vector.copy())
    start.vector[SHARED + 1] = FALSE
    search = Search(two_minima, np.full(len(vector), 0.05), 20, any_distance=False)
    held = search.settle(start)
    assert held.vector[SHARED + 1] > 0.7
    found = search.find(start, np.zeros(3))
    assert abs(found.vector[SHARED + 1]) < 0.01
