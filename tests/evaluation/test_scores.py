"""Laws of precision, recall and F."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.arrays import UInt8Array
from hairkit.errors import InputError
from hairkit.evaluation.depth_map import first_surface
from hairkit.evaluation.neighbour_search import FIRST_HIT_NONE, HashGrid, first_hits
from hairkit.evaluation.scores import Score, occupancy_score, sample_strands, strand_scores
from hairkit.evaluation.truth import read_truth
from hairkit.types.camera import Camera
from hairkit.types.strands import Strands

DOWN = np.array([0.0, -1.0, 0.0])


def hanging(roots: list[list[float]], length: float = 0.1) -> Strands:
    """Straight strands straight down."""
    return Strands.from_list([[root, np.asarray(root) + length * DOWN] for root in roots])


def moved(strands: Strands, offset: list[float]) -> Strands:
    return replace(strands, points=strands.points + np.array(offset, np.float32))


def reversed_strands(strands: Strands) -> Strands:
    return Strands.from_list(
        [
            strands.points[a:b][::-1]
            for a, b in np.lib.stride_tricks.sliding_window_view(strands.offsets, 2)
        ]
    )


def f_of(scores: tuple[Score, ...]) -> list[float]:
    return [score.f for score in scores]


def test_hair_against_itself_is_perfect() -> None:
    """Every score of a groom against itself is one, signed too."""
    hair = hanging([[0.0, 0, 0], [0.05, 0, 0]])
    scores = strand_scores(hair, hair)
    assert f_of(scores.all) == f_of(scores.all_signed) == [1.0, 1.0, 1.0]
    assert (scores.predicted_strands, scores.true_strands) == (2, 2)
    assert scores.outer is None


def test_occupancy_counts_voxels_not_strands_or_directions() -> None:
    """Copies and reversed strands change nothing; hair in other voxels has no share in it."""
    hair = hanging([[0.0015, 0, 0.0015], [0.0495, 0, 0.0015]])
    one = sample_strands(hair.select(np.array([0])))
    both = sample_strands(hair)
    whole = occupancy_score(both, both)
    assert (whole.precision, whole.recall) == (1.0, 1.0)
    assert occupancy_score(sample_strands(hair.select(np.array([0, 1, 0, 1]))), both).f == 1.0
    half = occupancy_score(one, both)
    assert (half.precision, half.recall) == (1.0, 0.5)
    assert occupancy_score(sample_strands(reversed_strands(hair)), both).f > 0.97
    assert occupancy_score(one, sample_strands(moved(hair, [0.006, 0, 0]))).f == 0.0


def test_backwards_hair_is_right_only_without_its_sign() -> None:
    """Tip and root exchanged: sign-free scores stay one, signed ones fall to nothing."""
    hair = hanging([[0.0, 0, 0], [0.05, 0, 0]])
    scores = strand_scores(reversed_strands(hair), hair)
    assert f_of(scores.all) == [1.0, 1.0, 1.0]
    assert f_of(scores.all_signed) == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(("gap_mm", "right"), [(1.9, 3), (2.1, 2), (3.1, 1), (4.1, 0)])
def test_distance_decides(gap_mm: float, right: int) -> None:
    """A sideways shift passes exactly the thresholds beyond it."""
    hair = hanging([[0.0, 0, 0]])
    scores = strand_scores(moved(hair, [gap_mm / 1000, 0, 0]), hair)
    assert f_of(scores.all) == [0.0] * (3 - right) + [1.0] * right


@pytest.mark.parametrize(("tilt_deg", "right"), [(19, 3), (21, 2), (31, 1), (41, 0)])
def test_angle_decides(tilt_deg: float, right: int) -> None:
    """A strand through the same place at an angle passes exactly the thresholds above it."""
    a = np.radians(tilt_deg)
    true = hanging([[0.0, 0.5, 0]], length=1.0)
    tilted = Strands.from_list(
        [0.0075 * np.array([[np.sin(a), np.cos(a), 0], [-np.sin(a), -np.cos(a), 0]])]
    )
    scores = strand_scores(tilted, true)
    assert [score.precision > 0 for score in scores.all] == [False] * (3 - right) + [True] * right


def test_exchange_exchanges_precision_and_recall() -> None:
    """Scoring the truth against the prediction swaps the two."""
    few, many = hanging([[0.0, 0, 0]]), hanging([[0.0, 0, 0], [0.02, 0, 0], [0.04, 0, 0]])
    one, other = strand_scores(few, many), strand_scores(many, few)
    for a, b in zip(one.all, other.all, strict=True):
        assert (a.precision, a.recall) == (b.recall, b.precision) == (1.0, pytest.approx(1 / 3))
        assert a.f == pytest.approx(0.5)


def compare_all_pairs(
    targets: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]],
    queries: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]],
    distances: npt.NDArray[np.float64],
    cosines: npt.NDArray[np.float64],
) -> tuple[UInt8Array, UInt8Array]:
    """Compare every query with every target: the readable twin of `first_hits`."""
    gap = queries[0][:, None].astype(np.float64) - targets[0][None].astype(np.float64)
    squared = (gap**2).sum(axis=2)
    cosine = queries[1].astype(np.float64) @ targets[1].astype(np.float64).T
    free = np.full(len(queries[0]), FIRST_HIT_NONE, np.uint8)
    signed = free.copy()
    for rank in reversed(range(len(distances))):
        close = squared <= distances[rank] ** 2
        free[(close & (np.abs(cosine) >= cosines[rank])).any(axis=1)] = rank
        signed[(close & (cosine >= cosines[rank])).any(axis=1)] = rank
    return free, signed


@given(seed=st.integers(0, 1000), cell=st.sampled_from([0.002, 0.0007, 0.01]))
@settings(max_examples=25)
def test_the_grid_finds_what_comparing_all_pairs_finds(seed: int, cell: float) -> None:
    """The compiled search equals its twin, whatever the cell."""
    rng = np.random.default_rng(seed)
    sides = []
    for count in (60, 80):
        way = rng.normal(size=(count, 3))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        sides.append(
            (rng.uniform(-0.006, 0.006, (count, 3)).astype(np.float32), way.astype(np.float32))
        )
    distances = np.array([0.002, 0.003, 0.004])
    cosines = np.cos(np.radians([20.0, 30.0, 40.0]))
    found = first_hits(HashGrid.build(*sides[0], cell), *sides[1], distances, cosines)
    wanted = compare_all_pairs(sides[0], sides[1], distances, cosines)
    assert np.array_equal(found[0], wanted[0])
    assert np.array_equal(found[1], wanted[1])
    assert (found[0] <= found[1]).all()


def test_samples_stand_a_millimetre_apart_and_point_along() -> None:
    """A strand of 24.6 mm gives 25 equal samples whose directions are its own."""
    samples = sample_strands(hanging([[0.0, 0, 0]], 0.0246))
    assert len(samples) == 25
    assert np.allclose(samples.directions, DOWN, atol=1e-5)
    assert np.allclose(np.diff(samples.points[:, 1]), -0.000984, atol=1e-6)


def test_a_sample_takes_the_mark_of_the_nearer_point() -> None:
    """Half of a strand between a seen and an unseen point counts as seen."""
    samples = sample_strands(hanging([[0.0, 0, 0]], 0.0186), marked=[1, 0])
    assert samples.marked.tolist() == [True] * 10 + [False] * 9


def test_stubble_is_dropped() -> None:
    """Strands under a centimetre count on neither side; with nothing left there is one line."""
    long, stub = hanging([[0.0, 0, 0]], 0.05), hanging([[0.5, 0, 0]], 0.009)
    both = Strands.from_list([long.points, stub.points])
    assert f_of(strand_scores(both, long).all) == [1.0, 1.0, 1.0]
    assert strand_scores(both, long).predicted_strands == 1
    with pytest.raises(InputError, match="predicted strands is 10 mm long"):
        strand_scores(stub, long)
    assert strand_scores(stub, stub, shortest=0.005).predicted_strands == 1


def test_thresholds_must_grow() -> None:
    """A wider angle at a shorter distance is refused."""
    hair = hanging([[0.0, 0, 0]])
    with pytest.raises(InputError, match="thresholds must grow"):
        strand_scores(hair, hair, thresholds=[(0.002, 30.0), (0.003, 20.0)])


def test_outer_recall_asks_only_for_what_was_seen() -> None:
    """A strand that no camera saw costs recall, but no outer recall."""
    true = hanging([[0.0, 0, 0], [0.05, 0, 0]])
    camera = Camera.on_turn(0.0, distance=1.0, focal=1000.0, width=400, height=400)
    surface = first_surface(camera, sample_strands(true).points, None)
    scores = strand_scores(hanging([[0.0, 0, 0]]), true, visible=[1, 1, 0, 0], surfaces=[surface])
    assert scores.all[0].recall == pytest.approx(0.5)
    assert scores.outer is not None
    assert scores.outer[0].recall == 1.0


def test_outer_precision_asks_only_for_what_is_near_a_seen_surface() -> None:
    """Wrong hair counts against outer precision in front of the truth, not far behind it."""
    curtain = hanging([[x, 0.05, 0.0] for x in np.linspace(-0.05, 0.05, 101)])
    camera = Camera.on_turn(0.0, distance=1.0, focal=1000.0, width=400, height=400)
    surface = first_surface(camera, sample_strands(curtain).points, None)
    seen = np.ones(len(curtain.points))
    wrong_behind, wrong_before = (
        hanging([[0.0, 0.04, -0.02]], 0.05),
        hanging([[0.0, 0.04, 0.02]], 0.05),
    )
    precision = []
    for wrong in (wrong_behind, wrong_before):
        both = Strands.from_list([wrong.points, *curtain.points.reshape(-1, 2, 3)])
        outer = strand_scores(both, curtain, visible=seen, surfaces=[surface]).outer
        assert outer is not None
        precision.append(outer[0].precision)
    assert precision[0] == 1.0
    assert precision[1] < 1.0


def test_a_wrong_hairstyle_scores_what_was_measured_before(captures: Path) -> None:
    """1,500 strands of straight_long against wavy have the outer F that the captures state."""
    straight, wavy = read_truth(captures / "straight_long"), read_truth(captures / "wavy")
    chosen = np.random.default_rng(0).permutation(len(straight.strands))[:1500]
    scores = strand_scores(
        straight.strands.select(chosen),
        wavy.strands,
        visible=wavy.visible,
        surfaces=wavy.surfaces,
    )
    assert scores.outer is not None
    assert f_of(scores.outer) == pytest.approx([0.09, 0.27, 0.50], abs=0.02)
