"""Number of helix arcs that a strand needs."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import InputError
from hairkit.helices.arc_length import Path, dot
from hairkit.helices.floating_tangents import Arcs, cuts, even, fit_arcs
from hairkit.types.strands import Strands

FEWEST, MOST = 3, 25
"""Arcs of the shortest and of the longest strands (patent, step 3)."""
SHORT, LONG = 0.05, 0.80
"""Lengths in metres below and above which a strand has the fewest and the most arcs."""
MERGED, SPLIT = 0.95, 0.0
"""Cosines between neighbouring tangents above and up to which an arc is taken or added."""
UNMERGED = 0.8
"""Share of the count by length that the adaptive count starts from at least."""
TOLERANCE = 0.00025
"""Mean distance in metres that `adaptive_counts` allows by default."""
MOST_ADAPTIVE, ROUNDS = 64, 4
"""Most arcs of a strand, and how often the count is raised."""
ERROR_POWER = 0.7
"""The count grows with this power of the error over the tolerance: arcs are never taken away, so
a strand must not get more of them than it needs."""
LEAST_GROWTH, MOST_GROWTH = 1.15, 3.0
"""Bounds of the growth in a round."""
_SAMPLES = (0.25, 0.5, 0.75, 1.0)


def patent_counts(strands: Strands) -> Int64Array:
    """Return (S,) how many arcs the patent's rule gives each strand, `FEWEST` to `MOST`.

    Linear in the length, one more for each pair of neighbouring tangents a right angle or more
    apart, one less for each pair that is nearly the same (patent, step 3).
    """
    path = Path.of(strands)
    counts = _by_length(path.lengths)
    if not len(counts):
        return counts
    first, offsets = cuts(counts)
    _, tangents = path.at(*even(path, counts))
    cosine = dot(tangents[first], tangents[first + 1])
    change = (cosine <= SPLIT).astype(np.int64) - (cosine > MERGED)
    between = (path.lengths > SHORT) & (path.lengths < LONG)
    changed = counts + between * np.add.reduceat(change, offsets[:-1])
    return np.clip(changed, FEWEST, MOST)


def adaptive_counts(
    strands: Strands, tolerance: float = TOLERANCE, *, most: int = MOST_ADAPTIVE
) -> Int64Array:
    """Return (S,) arcs a strand that keep it within `tolerance`, metres, on average along it.

    Starts from `patent_counts`, or near its count by length where that merged nearly all
    arcs of long straight hair, and adds arcs where the curve is too far off, up to `most`.
    """
    if not tolerance > 0:
        raise InputError(f"tolerance of the helices is {tolerance}, expected metres above 0")
    start = np.ceil(UNMERGED * _by_length(strands.lengths())).astype(np.int64)
    counts: Int64Array = np.minimum(np.maximum(patent_counts(strands), start), most)
    open_ = np.arange(len(strands))
    for _ in range(ROUNDS):
        if not len(open_):
            break
        path = Path.of(strands.select(open_))
        error = mean_error(path, fit_arcs(path, counts[open_])) / tolerance
        bad = (error > 1) & (counts[open_] < most)
        open_ = open_[bad]
        factor = np.clip(error[bad] ** ERROR_POWER, LEAST_GROWTH, MOST_GROWTH)
        counts[open_] = np.minimum(np.ceil(counts[open_] * factor), most).astype(np.int64)
    return counts


def _by_length(lengths: Float64Array) -> Int64Array:
    share = np.clip((lengths - SHORT) / (LONG - SHORT), 0, 1)
    return np.rint(FEWEST + (MOST - FEWEST) * share).astype(np.int64)


def mean_error(path: Path, arcs: Arcs) -> Float64Array:
    """Return (S,) mean distance in metres across each strand between it and its arcs."""
    counts = np.diff(arcs.offsets)
    strand = np.repeat(np.arange(len(counts)), counts)
    rank = np.arange(len(strand)) - arcs.offsets[:-1][strand]
    piece = path.lengths[strand] / counts[strand]
    total = np.zeros(len(strand))
    for share in _SAMPLES:
        points, tangents = arcs.at(np.arange(len(strand)), np.full(len(strand), share))
        wanted, _ = path.at(strand, (rank + share) * piece)
        gap = points - wanted
        across = gap - dot(gap, tangents)[:, None] * tangents
        total += np.sqrt(dot(across, across))
    return np.asarray(np.bincount(strand, total, len(counts)) / (counts * len(_SAMPLES)))
