"""Laws of blocks and profiles: together they are the whole groom, and rows the points' own."""

import numpy as np
import pytest
from rich_groom import rich_groom

from hairkit.grooming.prepare_export import point_colours
from hairkit.types import strand_blocks
from hairkit.types.strand_blocks import blocks, bounds, colours, shares
from hairkit.types.strands import Strands


def _straight(counts: list[int]) -> Strands:
    return Strands.from_list([np.arange(3 * count).reshape(-1, 3) for count in counts])


@pytest.mark.parametrize("size", [1, 7, 100_000])
def test_blocks_are_whole_strands_one_after_the_other(
    size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every strand is in one block, with its points; a strand longer than a block has its own."""
    monkeypatch.setattr(strand_blocks, "_POINTS", size)
    strands = _straight([2, 30, 2, 3, 2])
    found = list(blocks(strands))
    numbers = np.concatenate([np.arange(5)[block.strands] for block in found])
    np.testing.assert_array_equal(numbers, np.arange(5))
    for block in found:
        np.testing.assert_array_equal(
            strands.points[block.points],
            strands.select(np.arange(5)[block.strands]).points,
        )
        alone = block.strands.stop - block.strands.start == 1
        assert alone or block.points.stop - block.points.start <= size


@pytest.mark.parametrize("counts", [[4, 4, 4], [2, 5, 3, 5], [7]])
def test_a_profile_runs_from_0_to_1_along_each_strand(counts: list[int]) -> None:
    """Equal or not, each strand's shares are evenly spaced from its root to its tip."""
    wanted = np.concatenate([np.linspace(0, 1, count) for count in counts])
    np.testing.assert_allclose(shares(np.array(counts)).at(), wanted, atol=1e-15)


def test_a_profile_has_no_more_rows_than_counts_ask_for() -> None:
    """A thousand strands of equal count share the rows of one."""
    assert len(shares(np.full(1000, 32)).rows) == 32
    assert len(shares(np.array([3, 2, 3, 2])).rows) == 5


def test_blocks_of_a_profile_are_the_profile() -> None:
    """Colours taken block by block are those of all points, as a function of rows is."""
    groom = rich_groom()
    shades = colours(groom.material, groom.strands)
    parts = [shades.at(slice(start, start + 7)) for start in range(0, len(groom.strands), 7)]
    np.testing.assert_array_equal(np.concatenate(parts), point_colours(groom))
    doubled = shades.mapped(lambda rows: 2 * rows).at()
    np.testing.assert_array_equal(doubled, 2 * point_colours(groom))


@pytest.mark.parametrize("count", [1, 1023, 1024, 5000])
def test_bounds_are_the_extremes_of_each_column(count: int) -> None:
    """However many points there are, none is left out."""
    rows = np.random.default_rng(count).normal(size=(count, 3)).astype(np.float32)
    low, high = bounds(rows)
    np.testing.assert_array_equal(low, rows.min(axis=0))
    np.testing.assert_array_equal(high, rows.max(axis=0))
