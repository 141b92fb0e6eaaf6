"""Precision, recall and F of strands against true ones (Nam et al. 2019; docs/evaluation.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Int64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.evaluation.depth_map import Surface, near_some_surface
from hairkit.evaluation.neighbour_search import HashGrid, first_hits
from hairkit.types.strands import Strands

THRESHOLDS = ((0.002, 20.0), (0.003, 30.0), (0.004, 40.0))
"""Pairs (distance in metres, angle in degrees) at which scores are quoted."""
SAMPLE_STEP = 0.001
"""Arc length between samples, metres."""
SHORTEST_STRAND = 0.01
"""Strands shorter than this many metres are dropped on both sides."""
OUTER_DEPTH = 0.003
"""A predicted sample is outer at most this far behind some view's first surface, metres."""
ANY_DIRECTION = 90.0
"""Largest angle in degrees between directions whose sign does not count."""
OCCUPANCY_VOXEL = 0.003
"""Edge of the voxels whose occupancy is compared, metres."""


@dataclass(frozen=True)
class Score:
    """Precision, recall and their harmonic mean at one threshold, each in [0, 1]."""

    distance_mm: float
    angle_deg: float
    precision: float
    recall: float

    @property
    def f(self) -> float:
        """Harmonic mean of precision and recall; 0 when both are."""
        total = self.precision + self.recall
        return 2 * self.precision * self.recall / total if total > 0 else 0.0


@dataclass(frozen=True)
class StrandScores:
    """Scores at every threshold; `outer` is None when visibility or surfaces were not given."""

    predicted_strands: int
    true_strands: int
    all: tuple[Score, ...]
    """Sign-free: a strand that runs backwards counts."""
    all_signed: tuple[Score, ...]
    outer: tuple[Score, ...] | None
    outer_signed: tuple[Score, ...] | None


@dataclass(frozen=True, eq=False)
class Samples:
    """Points along strands with unit directions: what precision and recall are shares of."""

    points: Float32Array
    """(N, 3) starts of segments about 1 mm long, metres."""
    directions: Float32Array
    """(N, 3) unit forward differences, root to tip."""
    strand: Int64Array
    """(N,) number of the strand in the `Strands` that was sampled."""
    marked: BoolArray
    """(N,) whether the nearer native point was marked (all true without marks)."""

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True, eq=False)
class Hits:
    """Per sample the first threshold (0, 1, ..) at which it has a partner; 255 where at none."""

    samples: Samples
    free: UInt8Array
    """(N,) either direction allowed."""
    signed: UInt8Array
    """(N,) directions must agree."""
    outer: BoolArray | None
    """(N,) the outer samples of this side, None when unknown."""


def strand_scores(
    pred: Strands,
    true: Strands,
    *,
    visible: npt.ArrayLike | None = None,
    surfaces: Sequence[Surface] | None = None,
    thresholds: Sequence[tuple[float, float]] = THRESHOLDS,
    shortest: float = SHORTEST_STRAND,
) -> StrandScores:
    """Score predicted strands against true ones that stand in the same frame.

    A sample is right when any sample of the other side lies within the distance and the angle.

    Parameters
    ----------
    pred, true : Strands
        Both are resampled to 1 mm; strands shorter than `shortest` metres are dropped.
    visible : (P,) array, optional
        Nonzero where a camera saw that point of `true`; limits outer recall.
    surfaces : sequence of Surface, optional
        First visible surface of each true view; limits outer precision.
    thresholds : sequence of (metres, degrees)
        Each must contain the one before it.

    Raises
    ------
    InputError
        When no strand is left on a side, or thresholds do not grow.
    """
    predicted = sample_strands(pred, shortest=shortest, name="predicted")
    truth = sample_strands(true, marked=visible, shortest=shortest, name="true")
    precision, recall = sample_hits(
        predicted, truth, surfaces=surfaces, visible=visible is not None, thresholds=thresholds
    )
    return scores_of_hits(precision, recall, thresholds)


def sample_hits(
    predicted: Samples,
    truth: Samples,
    *,
    surfaces: Sequence[Surface] | None = None,
    visible: bool = False,
    thresholds: Sequence[tuple[float, float]] = THRESHOLDS,
) -> tuple[Hits, Hits]:
    """Return the hits of every predicted sample (precision) and of every true one (recall).

    `visible` says that the marks of `truth` are what cameras saw; the rest as in `strand_scores`.
    """
    outer = None
    if surfaces is not None:
        outer = near_some_surface(predicted.points, surfaces, OUTER_DEPTH)
    precision = Hits(predicted, *_match(predicted, truth, thresholds), outer)
    recall = Hits(truth, *_match(truth, predicted, thresholds), truth.marked if visible else None)
    return precision, recall


def scores_of_hits(
    precision: Hits, recall: Hits, thresholds: Sequence[tuple[float, float]] = THRESHOLDS
) -> StrandScores:
    """Return the shares of samples hit at every threshold as scores."""
    whole = (np.ones(len(precision.free), bool), np.ones(len(recall.free), bool))
    free, signed = (precision.free, recall.free), (precision.signed, recall.signed)
    outer = outer_signed = None
    if precision.outer is not None and recall.outer is not None:
        shell = (precision.outer, recall.outer)
        outer, outer_signed = _table(free, shell, thresholds), _table(signed, shell, thresholds)
    return StrandScores(
        predicted_strands=len(np.unique(precision.samples.strand)),
        true_strands=len(np.unique(recall.samples.strand)),
        all=_table(free, whole, thresholds),
        all_signed=_table(signed, whole, thresholds),
        outer=outer,
        outer_signed=outer_signed,
    )


def occupancy_score(predicted: Samples, true: Samples) -> Score:
    """Return precision and recall of the voxels that strands run through, whatever the direction.

    Voxels have edges of `OCCUPANCY_VOXEL` from the origin. Counted once each, they do
    not depend on the number of strands in them, which F of samples does.
    """
    mine, other = (
        np.unique(np.floor(samples.points / OCCUPANCY_VOXEL).astype(np.int64), axis=0)
        for samples in (predicted, true)
    )
    both = len(mine) + len(other) - len(np.unique(np.concatenate([mine, other]), axis=0))
    return Score(1000 * OCCUPANCY_VOXEL, ANY_DIRECTION, both / len(mine), both / len(other))


def sample_strands(
    strands: Strands,
    *,
    marked: npt.ArrayLike | None = None,
    shortest: float = SHORTEST_STRAND,
    name: str = "given",
) -> Samples:
    """Return samples every `SAMPLE_STEP` of arc length, of the strands at least `shortest` long.

    `marked` (P,) are flags of the native points; a sample takes that of the nearer one.
    """
    kept = np.flatnonzero(strands.lengths() >= shortest)
    if not len(kept):
        raise InputError(
            f"none of the {len(strands)} {name} strands is {1000 * shortest:g} mm long: "
            "nothing to score"
        )
    # Linear interpolation of 0/1 flags, cut at one half, is the flag of the nearer point;
    # the optional per-point channel of Strands carries them through the resampling.
    flags = None if marked is None else (np.asarray(marked) != 0).astype(np.float32)
    dense = replace(strands, widths=flags).select(kept).resampled_by_length(SAMPLE_STEP)
    vectors, first = dense.segments()
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    directions = (vectors / np.maximum(length, 1e-12)).astype(np.float32)
    marks = np.ones(len(first), bool) if dense.widths is None else dense.widths[first] >= 0.5
    return Samples(dense.points[first], directions, kept[dense.strand_of_point[first]], marks)


def _match(
    query: Samples, target: Samples, thresholds: Sequence[tuple[float, float]]
) -> tuple[UInt8Array, UInt8Array]:
    pairs = np.asarray(thresholds, np.float64).reshape(-1, 2)
    if not len(pairs) or (np.diff(pairs, axis=0) < 0).any():
        raise InputError("thresholds must grow: each distance and angle at least the one before")
    grid = HashGrid.build(target.points, target.directions, float(pairs[0, 0]))
    return first_hits(
        grid, query.points, query.directions, pairs[:, 0], np.cos(np.radians(pairs[:, 1]))
    )


def _table(
    hits: tuple[UInt8Array, UInt8Array],
    limits: tuple[BoolArray, BoolArray],
    thresholds: Sequence[tuple[float, float]],
) -> tuple[Score, ...]:
    rows = []
    for rank, (distance, angle) in enumerate(thresholds):
        precision, recall = (
            float(np.mean(level[limit] <= rank)) if limit.any() else 0.0
            for level, limit in zip(hits, limits, strict=True)
        )
        rows.append(Score(1000 * distance, angle, precision, recall))
    return tuple(rows)
