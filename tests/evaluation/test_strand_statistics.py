"""Laws of lengths, roots and what lies inside the head."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.evaluation.scores import sample_strands
from hairkit.evaluation.strand_statistics import (
    broken,
    deeper_than,
    head_measures,
    length_measures,
    strand_consistency,
)
from hairkit.head_model.signed_distance import distance_to
from hairkit.testing import ball_head, bristle_groom
from hairkit.types.strands import Strands


def combed(lengths: list[float]) -> Strands:
    """Strands straight down, a centimetre apart."""
    return Strands.from_list(
        [[[0.01 * i, 0, 0], [0.01 * i, -length, 0]] for i, length in enumerate(lengths)]
    )


def test_lengths_are_compared_by_their_means() -> None:
    """Hair of half the length has the ratio one half."""
    measures = length_measures(combed([0.1] * 10), combed([0.2] * 12))
    assert measures.mean_ratio == pytest.approx(0.5)
    assert (measures.broken_share, measures.true_broken_share) == (0.0, 0.0)


def test_a_strand_is_broken_beside_strands_more_than_twice_its_length() -> None:
    """One short strand among long ones is found, at less than half, and only that one."""
    lengths = [0.1] * 20
    lengths[7], lengths[12] = 0.049, 0.051
    assert np.flatnonzero(broken(combed(lengths))).tolist() == [7]


def test_short_hair_all_over_is_not_broken() -> None:
    """Breaking is relative to neighbours; one or two strands have too few to tell."""
    assert not broken(combed([0.1] * 10 + [0.02] * 10))[15:].any()
    assert not broken(combed([0.1])).any()
    assert broken(combed([0.1, 0.01])).tolist() == [False, True]


def test_roots_in_one_place_still_have_neighbours() -> None:
    """Strands that share their root are each other's neighbours."""
    strands = Strands.from_list([[[0, 0, 0], [0, -0.1, 0]]] * 12 + [[[0, 0, 0], [0, -0.01, 0]]])
    assert np.flatnonzero(broken(strands)).tolist() == [12]


def test_roots_on_the_head_and_nothing_inside() -> None:
    """Bristles on the ball have their roots on it and no point in it."""
    groom = bristle_groom()
    measures = head_measures(groom.strands, sample_strands(groom.strands), groom.head)
    assert measures.root_distance_max_mm < 0.01
    assert (measures.points_inside, measures.samples_inside) == (0, 0)


def test_segments_through_the_head_are_found_between_their_points() -> None:
    """A strand from one side of the ball to the other has no point inside, but samples."""
    through = Strands.from_list([[[-0.2, 0, 0], [0.2, 0, 0]]])
    measures = head_measures(through, sample_strands(through), ball_head())
    assert measures.points_inside == 0
    assert measures.samples_inside == pytest.approx(196, abs=4)


def test_skipping_cells_skips_no_point() -> None:
    """Depths found by cells are those of asking for every point."""
    points = np.random.default_rng(0).uniform(-0.13, 0.13, (4000, 3)).astype(np.float32)
    exact = distance_to(ball_head(), points)
    for depth in (0.0, 0.002, 0.05):
        assert np.array_equal(deeper_than(ball_head(), points, depth), exact < -depth)


def test_consistency_is_what_one_strand_follows() -> None:
    """Whole strands are followed wholly, strands cut in the middle by half."""
    whole = combed([0.2] * 10)
    halves = Strands.from_list(
        [
            [[0.01 * i, -0.1 * k, 0], [0.01 * i, -0.1 * k - 0.1, 0]]
            for i in range(10)
            for k in (0, 1)
        ]
    )
    assert strand_consistency(whole, whole, every=1) == 1.0
    assert strand_consistency(halves, whole, every=1) == pytest.approx(0.5, abs=0.03)
    away = Strands(whole.points + np.float32([0, 0, 0.1]), whole.offsets)
    assert strand_consistency(away, whole) == 0.0
