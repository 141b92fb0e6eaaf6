"""Laws of strands put together from edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import FormatError
from hairkit.io.polylines import chains


@given(counts=st.lists(st.integers(2, 9), min_size=1, max_size=8), seed=st.integers(0, 99))
def test_shuffled_edges_give_the_strands_back(counts: list[int], seed: int) -> None:
    """Whatever the order of edges and vertices, directed edges tell each strand and its root."""
    rng = np.random.default_rng(seed)
    total = sum(counts)
    name = rng.permutation(total)
    strands = np.split(name, np.cumsum(counts)[:-1])
    edges = np.concatenate([np.stack([run[:-1], run[1:]], axis=1) for run in strands])
    order, found = chains(rng.permutation(edges), total)
    runs = {tuple(run) for run in np.split(order, np.cumsum(found)[:-1])}
    assert runs == {tuple(run) for run in strands}
    assert order[np.cumsum(found) - found].tolist() == sorted(run[0] for run in strands)


@given(count=st.integers(2, 12), seed=st.integers(0, 99))
def test_edges_that_disagree_start_at_one_of_the_ends(count: int, seed: int) -> None:
    """Edges turned over at random still give the strand, in one direction or the other."""
    rng = np.random.default_rng(seed)
    edges = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    flipped = np.where(rng.random((count - 1, 1)) < 0.5, edges, edges[:, ::-1])
    order, found = chains(flipped, count)
    assert found.tolist() == [count]
    assert order.tolist() in (list(range(count)), list(range(count))[::-1])


def test_vertices_without_edges_are_left_out() -> None:
    """No edges are no strands."""
    order, counts = chains(np.zeros((0, 2), np.int64), 5)
    assert len(order) == len(counts) == 0


@pytest.mark.parametrize(
    ("edges", "reason"),
    [
        ([[0, 5]], "outside 0 to 4"),
        ([[-1, 0]], "outside 0 to 4"),
        ([[1, 1]], "with itself"),
        ([[0, 1], [1, 2], [1, 3]], "1 vertices are on more than two"),
        ([[0, 1], [1, 2], [2, 0], [3, 4]], "closed"),
        ([[0, 1], [1, 0]], "closed"),
    ],
)
def test_what_is_no_strand_is_refused(edges: list[list[int]], reason: str) -> None:
    """Branches and loops have no root."""
    with pytest.raises(FormatError, match=reason):
        chains(np.array(edges), 5)
