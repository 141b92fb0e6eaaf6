"""Laws of curves of several objects: values of every scope, and sets that lack what others have."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.arrays import Int64Array
from hairkit.errors import FormatError
from hairkit.grooming.curve_sets import (
    CONSTANT,
    UNIFORM,
    VERTEX,
    CurveSet,
    Spread,
    join_sets,
    strands_of,
)


def curves(counts: list[int], group: list[int] | None = None, guide: bool = False) -> CurveSet:
    """Return curves of so many points along +X."""
    number = np.arange(sum(counts), dtype=np.float32)
    points = np.stack([number, 0 * number, 0 * number], axis=1)
    whole: Int64Array = np.array(counts, np.int64)
    named = None if group is None else np.array(group, np.int64)
    guides = np.ones(len(counts), np.int64) if guide else None
    return CurveSet(points, whole, number, None, None, named, guides)


@given(counts=st.lists(st.integers(2, 5), min_size=2, max_size=6))
def test_values_of_every_scope_reach_points_and_strands(counts: list[int]) -> None:
    """What strands have is the root's of what their points have, whatever the scope."""
    spread = Spread(np.array(counts))
    sizes = {CONSTANT: 1, UNIFORM: len(counts), VERTEX: sum(counts)}
    roots = np.cumsum(counts) - counts
    for scope, size in sizes.items():
        values = np.arange(2 * size).reshape(size, 2)
        points, strands = spread.to_points(values, scope), spread.to_strands(values, scope)
        assert points.shape == (sum(counts), 2)
        np.testing.assert_array_equal(points[roots], strands)
    assert spread.to_points(np.zeros(sum(counts) + 1), VERTEX) is None


def test_sets_that_lack_groups_are_groups() -> None:
    """Each is one where none has any; where some have, the others are 0. Guides likewise."""
    plain = join_sets([curves([2, 3]), curves([4])])
    assert plain.group is not None
    assert plain.group.tolist() == [0, 0, 1]
    assert plain.guide is None
    some = join_sets([curves([2, 3], [7, 8], guide=True), curves([4])])
    assert some.group is not None
    assert some.guide is not None
    assert (some.group.tolist(), some.guide.tolist()) == ([7, 8, 0], [1, 1, 0])


def test_values_go_with_the_strands_that_are_kept() -> None:
    """A curve of one point is dropped with its group and its width."""
    strands, kept = strands_of(curves([2, 1, 3], [4, 5, 6]), "a.abc")
    assert strands.group is not None
    assert strands.group.tolist() == [4, 6]
    np.testing.assert_array_equal(strands.widths, [0, 1, 3, 4, 5])
    np.testing.assert_array_equal(kept.points, strands.points)
    with pytest.raises(FormatError, match="group of number"):
        strands_of(curves([2], [2**40]), "a.abc")
