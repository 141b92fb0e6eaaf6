"""Laws of points on splines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import FormatError
from hairkit.io.spline_curves import BASES, cubic_map, nurbs_map


@pytest.mark.parametrize("basis", BASES)
@pytest.mark.parametrize("pinned", [False, True])
@given(cubics=st.lists(st.integers(1, 6), min_size=1, max_size=5))
def test_straight_lines_stay_straight(basis: str, pinned: bool, cubics: list[int]) -> None:
    """Rows add to 1, and evenly spaced control points of a line give points of that line."""
    counts = np.array([3 * n + 1 for n in cubics])
    spline = cubic_map(counts, basis, pinned=pinned)
    np.testing.assert_allclose(spline.sum(axis=1), 1, atol=1e-12)
    rank = np.concatenate([np.arange(n, dtype=float) for n in counts])
    found = spline @ rank
    last = np.cumsum(counts) - 1
    assert (np.diff(found)[np.setdiff1d(np.arange(len(rank) - 1), last)] > 0).all()
    if pinned or basis == "bezier":
        np.testing.assert_allclose(found[last], counts - 1)
        np.testing.assert_allclose(found[last - counts + 1], 0, atol=1e-12)


def test_one_curve_in_three_bases_is_one_curve() -> None:
    """Uniform and Bezier cubics are NURBS of certain knots (Piegl and Tiller, The NURBS Book)."""
    counts, order = np.array([7]), np.array([4])
    uniform = nurbs_map(counts, order, np.arange(11.0), None, "file")
    np.testing.assert_allclose(
        uniform.toarray(), cubic_map(counts, "bspline").toarray(), atol=1e-15
    )
    ends = np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2.0])
    bezier = nurbs_map(counts, order, ends, None, "file")
    np.testing.assert_allclose(bezier.toarray(), cubic_map(counts, "bezier").toarray(), atol=1e-15)


def test_weights_make_a_circle() -> None:
    """A rational quadratic with weights 1, sqrt(1/2), 1 is a quarter of a circle."""
    knots, weights = np.array([0, 0, 0, 1, 1, 1.0]), np.array([1, np.sqrt(0.5), 1])
    points = np.array([[1, 0], [1, 1], [0, 1.0]])
    on = nurbs_map(np.array([3]), np.array([3]), knots, weights, "file") @ points
    np.testing.assert_allclose(np.linalg.norm(on, axis=1), 1)


def test_curves_too_short_for_a_cubic_stay() -> None:
    """Two or three control points, or no whole number of cubics, are the curve."""
    counts = np.array([2, 3, 5])
    np.testing.assert_array_equal(cubic_map(counts, "bezier").toarray(), np.eye(10))


def test_knots_that_do_not_fit_are_refused() -> None:
    """Too few knots, or none that ascend, are told."""
    for knots in (np.arange(7.0), np.zeros(8)):
        with pytest.raises(FormatError, match="knots"):
            nurbs_map(np.array([4]), np.array([4]), knots, None, "file")
