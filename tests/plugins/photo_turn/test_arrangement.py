"""Laws of the costs of arrangements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.photo_turn.arrangement import Evidence, OutlineTable, measure_cost
from hypothesis import given
from hypothesis import strategies as st


@given(seed=st.integers(0, 1000), count=st.integers(3, 12))
def test_outlines_by_the_table_cost_what_they_do_anew(seed: int, count: int) -> None:
    """A photo that moves, or changes places with another, changes the cost of outlines alike."""
    random = np.random.default_rng(seed)
    alike, mirrored = (np.abs(part + part.T) for part in random.normal(size=(2, count, count)))
    nothing = np.full(count, np.nan)
    evidence = Evidence(nothing, nothing, np.zeros(count), alike, mirrored, None, np.zeros(count))
    azimuth, photo = random.uniform(-180, 180, count), int(random.integers(count))
    moves, others = np.array([-20.0, 3.0]), np.delete(np.arange(count), photo)
    trials = np.repeat(azimuth[None], len(moves) + len(others), axis=0)
    trials[: len(moves), photo] += moves
    for row, other in zip(trials[len(moves) :], others, strict=True):
        row[[photo, other]] = azimuth[[other, photo]]
    table = OutlineTable.of(azimuth, evidence)
    known = np.concatenate([table.moved(photo, moves), table.swapped(photo, others)])
    np.testing.assert_allclose(
        measure_cost(trials, evidence, known), measure_cost(trials, evidence), rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize("follow", [2.0, np.inf])
def test_an_even_turn_in_the_order_of_the_photos_costs_less(follow: float) -> None:
    """By the odds that it was taken so; frames of a video have no other order."""
    nothing, way = np.full(8, np.nan), np.arange(8)
    evidence = Evidence(nothing, nothing, np.zeros(8), None, None, None, np.zeros(8))
    given = replace(evidence, sequence=way[::-1], follow=follow)
    turns = 45.0 * np.array([way, way[::-1], way[[0, 3, 1, 6, 2, 7, 5, 4]]])
    in_order, back, mixed = measure_cost(turns, given) - measure_cost(turns, evidence)
    assert in_order == pytest.approx(back)
    if np.isinf(follow):
        assert mixed - in_order > 20
    else:
        assert (mixed, in_order) == pytest.approx((0, -np.logaddexp(follow, 0)), abs=0.01)


def test_a_photo_left_out_leaves_the_order_of_the_rest() -> None:
    """What is asked of some of the photos follows their own order."""
    nothing = np.full(4, np.nan)
    evidence = Evidence(nothing, nothing, nothing, None, None, None, nothing)
    given = replace(evidence, sequence=np.array([3, 0, 2, 1]))
    assert given.only(np.array([0, 1, 3])).sequence.tolist() == [2, 0, 1]
