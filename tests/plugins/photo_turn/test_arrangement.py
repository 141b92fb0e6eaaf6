"""Laws of the costs of arrangements."""

from __future__ import annotations

import numpy as np
from hairkit_plugins.photo_turn.arrangement import Evidence, OutlineTable, measure_cost
from hypothesis import given
from hypothesis import strategies as st


@given(seed=st.integers(0, 1000), count=st.integers(3, 12))
def test_outlines_by_the_table_cost_what_they_do_anew(seed: int, count: int) -> None:
    """A photo that moves, or changes places with another, changes the cost of outlines alike."""
    random = np.random.default_rng(seed)
    alike, mirrored = (np.abs(part + part.T) for part in random.normal(size=(2, count, count)))
    nothing = np.full(count, np.nan)
    evidence = Evidence(nothing, nothing, 0 * nothing, alike, mirrored, None, np.zeros(count))
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
