"""Strand statistics besides the F score: lengths, roots, points inside the head, broken strands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray
from hairkit.evaluation.neighbour_search import HashGrid, most_followed
from hairkit.evaluation.scores import THRESHOLDS, Samples, sample_strands
from hairkit.head_model.signed_distance import distance_to
from hairkit.types.head import Head
from hairkit.types.strands import Strands

NEIGHBOURS = 8
"""Strands by nearest root that a strand's length is compared with."""
INSIDE_DEPTH = 0.002
"""Points deeper than this under the head's surface count as inside, metres."""
_CELL = 0.005
"""Edge of the cells that are skipped together when they lie wholly outside the head, metres."""
ROOT_PERCENTILE = 95
"""Percentile that `root_distance_95_mm` is."""


@dataclass(frozen=True)
class LengthMeasures:
    """Arc lengths of all strands, none dropped."""

    mean_m: float
    true_mean_m: float
    median_m: float
    true_median_m: float
    broken_share: float
    """Share of strands shorter than half the median of their 8 nearest neighbours by root."""
    true_broken_share: float

    @property
    def mean_ratio(self) -> float:
        """Predicted over true mean length."""
        return self.mean_m / self.true_mean_m


@dataclass(frozen=True)
class HeadMeasures:
    """Position of strands relative to one head mesh."""

    root_distance_mean_mm: float
    """Unsigned distance of roots to the mesh."""
    root_distance_95_mm: float
    root_distance_max_mm: float
    points_inside: int
    """Native points deeper than 2 mm."""
    samples_inside: int
    """Samples every millimetre deeper than 2 mm: segments may cut through where points do not."""
    samples: int


def length_measures(pred: Strands, true: Strands) -> LengthMeasures:
    """Compare arc lengths (metres) and count strands that break off beside longer neighbours."""
    mine, other = pred.lengths(), true.lengths()
    return LengthMeasures(
        mean_m=float(mine.mean()),
        true_mean_m=float(other.mean()),
        median_m=float(np.median(mine)),
        true_median_m=float(np.median(other)),
        broken_share=float(broken(pred).mean()),
        true_broken_share=float(broken(true).mean()),
    )


def broken(strands: Strands) -> BoolArray:
    """Return (S,) which strands are shorter than half the median of their 8 nearest by root."""
    count = min(NEIGHBOURS, len(strands) - 1)
    if count < 1:
        return np.zeros(len(strands), bool)
    lengths, roots = strands.lengths(), strands.roots.astype(np.float64)
    _, near = cKDTree(roots).query(roots, k=count + 1)
    # A strand is among its own nearest; with roots in one place it may not be the first.
    own = near == np.arange(len(strands))[:, None]
    own[~own.any(axis=1), -1] = True
    others = near[~own].reshape(len(strands), count)
    return np.asarray(lengths < 0.5 * np.median(lengths[others], axis=1))


def head_measures(strands: Strands, samples: Samples, head: Head) -> HeadMeasures:
    """Measure roots and depth of strands and of their samples against a head in the same frame."""
    roots = 1000 * np.abs(distance_to(head, strands.roots))
    return HeadMeasures(
        root_distance_mean_mm=float(roots.mean()),
        root_distance_95_mm=float(np.percentile(roots, ROOT_PERCENTILE)),
        root_distance_max_mm=float(roots.max()),
        points_inside=int(deeper_than(head, strands.points, INSIDE_DEPTH).sum()),
        samples_inside=int(deeper_than(head, samples.points, INSIDE_DEPTH).sum()),
        samples=len(samples),
    )


def deeper_than(head: Head, points: npt.NDArray[np.float32], depth: float) -> BoolArray:
    """Return (N,) which of many points (N, 3) lie more than `depth` metres inside the head."""
    deep = np.zeros(len(points), bool)
    candidates = np.flatnonzero(_maybe_inside(head, points))
    deep[candidates] = distance_to(head, points[candidates]) < -depth
    return deep


def _maybe_inside(head: Head, points: npt.NDArray[np.float32]) -> BoolArray:
    """Leave out points whose cell lies wholly outside, judged by the distance of its middle."""
    low, high = head.vertices.min(axis=0) - _CELL, head.vertices.max(axis=0) + _CELL
    shape = tuple(np.ceil((high - low) / _CELL).astype(np.int64))
    cell = np.floor((points - low) / _CELL).astype(np.int64)
    maybe: BoolArray = ((cell >= 0) & (cell < shape)).all(axis=1)
    used, back = np.unique(np.ravel_multi_index(tuple(cell[maybe].T), shape), return_inverse=True)
    middle = low + (np.stack(np.unravel_index(used, shape), axis=1) + 0.5) * _CELL
    maybe[maybe] = (distance_to(head, middle) < _CELL * np.sqrt(3) / 2)[back]
    return maybe


def strand_consistency(pred: Strands, true: Strands, *, every: int = 10) -> float:
    """Return how much of a true strand one single predicted strand follows, mean in [0, 1].

    For each true strand the largest share of its samples that any one predicted strand matches,
    sign-free (the consistency of Hair-GS, Pan et al. 2025); taken over every tenth true strand.
    """
    predicted = sample_strands(pred, name="predicted")
    chosen = true.select(np.arange(0, len(true), every))
    truth = sample_strands(chosen, name="true")
    distance, angle = THRESHOLDS[-1]
    grid = HashGrid.build(predicted.points, predicted.directions, distance / 2)
    owner = predicted.strand[grid.source]
    starts = np.flatnonzero(np.diff(truth.strand, prepend=-1))
    bounds = np.append(starts, len(truth))
    share = most_followed(
        grid,
        owner,
        truth.points,
        truth.directions,
        bounds,
        distance,
        float(np.cos(np.radians(angle))),
    )
    return float(share.mean())
