"""The search for cameras where views are held by a false minimum."""

from __future__ import annotations

import numpy as np

from hairkit.cameras.camera_search import Evidence, Fit, Search
from hairkit.cameras.turntable import ELEVATION, PER_VIEW, SHARED

FALSE, STIFFNESS, DEARER = 0.8, 1e4, 50.0
"""Elevation of the false minimum, radians, how narrow both minima are, and its cost."""


def two_minima(fit: Fit, noise: float) -> Evidence:
    """Return the evidence of the first view's elevation: 0, or `FALSE` from half of it on."""
    at = fit.vector[SHARED + ELEVATION]
    nearer = FALSE if at > FALSE / 2 else 0.0
    normal, right = np.zeros((len(fit.vector),) * 2), np.zeros(len(fit.vector))
    normal[SHARED + ELEVATION, SHARED + ELEVATION] = STIFFNESS
    right[SHARED + ELEVATION] = STIFFNESS * (nearer - at)
    cost = STIFFNESS * (nearer - at) ** 2 + (DEARER if nearer else 0.0)
    return Evidence(cost, normal, right, None)


def test_a_view_far_above_the_others_is_tried_level() -> None:
    """From the false minimum of one view of three the search comes to the true one."""
    vector = np.zeros(SHARED + 3 * PER_VIEW)
    start = Fit(vector.copy(), np.zeros((68, 3)), True, vector.copy())
    start.vector[SHARED + ELEVATION] = FALSE
    search = Search(two_minima, 400 * np.eye(len(vector)), 20, any_distance=False)
    held = search.settle(start)
    assert held.vector[SHARED + ELEVATION] > 0.7
    found = search.find(start, np.zeros(3))
    assert abs(found.vector[SHARED + ELEVATION]) < 0.01


def test_turns_held_above_are_tried_from_below() -> None:
    """All views are found above the head, where they hold each other up: none is a stray."""
    low = np.radians(-14)

    def evidence(fit: Fit, noise: float) -> Evidence:
        """Return the cost of the mean elevation: least at `low`, with a false minimum at 0.1."""
        raised = np.zeros(len(fit.vector))
        raised[SHARED + ELEVATION :: PER_VIEW] = 1 / 8
        nearer = 0.1 if fit.vector @ raised > -0.05 else low
        off = fit.vector @ raised - nearer
        cost = STIFFNESS * off**2 + (DEARER if nearer > 0 else 0.0)
        normal, right = np.outer(raised, raised), -off * raised
        return Evidence(cost, STIFFNESS * normal, STIFFNESS * right, None)

    start = np.zeros(SHARED + 8 * PER_VIEW)
    search = Search(evidence, 25 * np.eye(len(start)), 20, any_distance=False)
    fit = Fit(start, np.zeros((68, 3)), True, start)
    assert search.settle(fit).vector[SHARED + ELEVATION] > 0.05
    found = search.find(fit, np.arange(8) * np.pi / 4).vector[SHARED + ELEVATION :: PER_VIEW]
    assert abs(found.mean() - low) < 0.02
