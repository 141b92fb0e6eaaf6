"""Laws of finding guides in full hair."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.grooming.decimate import cluster_strands, decimate
from hairkit.grooming.guide_weights import closest_guides
from hairkit.grooming.prepare_export import dense_groom
from hairkit.testing import bristle_groom
from hairkit.types.strands import Strands


def wisps(rng: np.random.Generator) -> tuple[Strands, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Twelve wisps of thirty strands; neighbours in pairs share a root, but not a direction."""
    number = np.repeat(np.arange(12), 30)
    rng.shuffle(number)
    roots = np.stack([0.05 * (number // 2), 0 * number, 0 * number], axis=1)
    way = np.where((number % 2 == 0)[:, None], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2])
    roots = roots + 0.001 * rng.standard_normal((360, 3))
    points = roots[:, None] + np.linspace(0, 1, 9)[:, None] * way[:, None]
    return Strands(points.reshape(-1, 3).astype(np.float32), np.arange(361) * 9), number


def test_wisps_are_found_by_root_and_by_shape(rng: np.random.Generator) -> None:
    """Strands of one root but two directions fall into two clusters, each a wisp."""
    strands, number = wisps(rng)
    clusters = cluster_strands(strands, 12)
    pairs = set(zip(number.tolist(), clusters.cluster.tolist(), strict=True))
    assert len(pairs) == 12
    assert sorted(number[clusters.guides].tolist()) == list(range(12))


@pytest.mark.parametrize("count", [1, 7, 360])
def test_as_many_guides_as_wanted(count: int, rng: np.random.Generator) -> None:
    """All different, and each guide belongs to its own cluster."""
    clusters = cluster_strands(wisps(rng)[0], count)
    assert len(np.unique(clusters.guides)) == count
    np.testing.assert_array_equal(clusters.cluster[clusters.guides], np.arange(count))


def test_a_simplified_groom_keeps_its_hair_and_follows_its_guides() -> None:
    """Every strand stays; hair between guides is tied to guides only."""
    full = dense_groom(bristle_groom(), 900, seed=2)
    found = decimate(full, 60)
    np.testing.assert_array_equal(found.strands.points, full.strands.points)
    assert found.strands.guide is not None
    assert found.strands.guide.sum() == 60
    assert found.strands.guide[closest_guides(found.strands).guides].all()


def test_more_guides_bring_the_hair_closer_to_them(rng: np.random.Generator) -> None:
    """The mean distance of strands to their guide falls with the number of guides."""
    strands, _ = wisps(rng)
    shapes = strands.points.reshape(len(strands), -1)

    def spread(count: int) -> float:
        clusters = cluster_strands(strands, count)
        own = clusters.guides[clusters.cluster]
        return float(np.linalg.norm(shapes - shapes[own], axis=1).mean())

    assert spread(40) < spread(12) < spread(4)


def test_equal_input_gives_equal_guides(rng: np.random.Generator) -> None:
    """The seed decides, nothing else."""
    strands, _ = wisps(rng)
    first, again = (cluster_strands(strands, 9, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.guides, again.guides)


def test_no_more_guides_than_strands(rng: np.random.Generator) -> None:
    """The error names both numbers."""
    with pytest.raises(InputError, match="361 guides are wanted, expected 1 to 360"):
        cluster_strands(wisps(rng)[0], 361)
