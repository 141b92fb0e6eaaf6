"""Write large grooms in blocks, so that the output is never in memory as a whole.

A block is small enough for the processor's cache, so that converting it costs little more than
writing it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.types.groom import HairMaterial
from hairkit.types.strands import Strands

_POINTS = 32_000
"""Points of a block, unless one strand has more. Not a power of two: rows at such a distance share
cache lines, and transposing them is then six times as slow."""
_ROW = 1024


@dataclass(frozen=True)
class Block:
    """Some strands one after the other, and their points."""

    strands: slice
    points: slice


def blocks(strands: Strands) -> Iterator[Block]:
    """Yield all strands in blocks of whole strands, in their order."""
    offsets, start = strands.offsets, 0
    while start < len(strands):
        room = np.searchsorted(offsets, offsets[start] + _POINTS, side="right") - 1
        stop = max(int(room), start + 1)
        yield Block(slice(start, stop), slice(int(offsets[start]), int(offsets[stop])))
        start = stop


@dataclass(frozen=True, eq=False)
class Profile:
    """Values that depend only on a point's index in its strand and the strand's number of points.

    Strands of equal counts share their rows, so that expensive functions run once per count.
    """

    rows: npt.NDArray[Any]
    """(K, ...) values from root to tip, for each count of points that strands have."""
    first: Int64Array
    """(S,) row of each strand's root."""
    counts: Int64Array
    """(S,) points of each strand."""

    def mapped(self, function: Callable[[Any], npt.NDArray[Any]]) -> Profile:
        """Return the profile whose rows (K, ...) are the function's of these."""
        return Profile(function(self.rows), self.first, self.counts)

    def at(self, strands: slice = slice(None)) -> npt.NDArray[Any]:
        """Return (P, ...) the values at all points of some strands."""
        first, counts = self.first[strands], self.counts[strands]
        rest = self.rows.shape[1:]
        if len(counts) and (first == first[0]).all():
            each = self.rows[first[0] : first[0] + counts[0]]
            return np.broadcast_to(each, (len(counts), *each.shape)).reshape(-1, *rest)
        before = np.cumsum(counts) - counts
        row = np.arange(counts.sum()) + np.repeat(first - before, counts)
        values: npt.NDArray[Any] = self.rows[row]
        return values


def shares(counts: Int64Array) -> Profile:
    """Return the profile (K,) from 0 at the root to 1 at the tip by number of points, float64."""
    distinct, place = np.unique(counts, return_inverse=True)
    first = np.cumsum(distinct) - distinct
    rank = np.arange(distinct.sum()) - np.repeat(first, distinct)
    share: Float64Array = rank / np.repeat(distinct - 1, distinct)
    return Profile(share, first[place], counts)


def colours(look: HairMaterial, strands: Strands) -> Profile:
    """Return linear RGB (K, 3): the strands' own or, without, from the root's to the tip's."""
    if strands.colours is not None:
        return Profile(strands.colours, strands.offsets[:-1], strands.counts)
    share = shares(strands.counts).mapped(lambda share: share.astype(np.float32)[:, None])
    return share.mapped(lambda part: (1 - part) * look.root_colour + part * look.tip_colour)


def bounds(rows: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return the smallest and the largest value (C,) of each column of rows (N, C), N above 0.

    Taken over long rows of many points each, which is ten times as fast as over short ones.
    """
    whole = len(rows) // _ROW * _ROW
    found = []
    for least in (np.min, np.max):
        long = least(rows[:whole].reshape(-1, _ROW * rows.shape[1]), axis=0) if whole else rows[:0]
        rest = np.concatenate([long.reshape(-1, rows.shape[1]), rows[whole:]])
        found.append(least(rest, axis=0))
    return found[0], found[1]
