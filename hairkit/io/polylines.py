"""Strands put together from line segments: by order where a file keeps it, else by list ranking.

List ranking by pointer jumping (Wyllie, The Complexity of Parallel Computations, 1979) over the
two directions of every segment takes log2(longest strand) rounds over all strands at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import BoolArray, Int64Array
from hairkit.errors import FormatError


def join_segments(segments: Int64Array, vertices: int) -> tuple[Int64Array, Int64Array]:
    """Return the vertices (P,) of all strands in order and the point counts (S,).

    Strands end where a vertex has one segment, or more than two; a ring is cut open at its first
    segment and ends where it starts. Each strand runs as most of its segments do.

    Parameters
    ----------
    segments
        (M, 2) vertex numbers below `vertices`.
    vertices
        Number of vertices.
    """
    in_order = _consecutive(segments, vertices)
    if in_order is not None:
        return in_order
    segments = segments[segments[:, 0] != segments[:, 1]]
    _, first = np.unique(np.sort(segments, axis=1), axis=0, return_index=True)
    segments = segments[np.sort(first)]
    if not len(segments):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    return _strands(_rank(_Halves.of(segments, vertices)))


def chains(edges: Int64Array, vertices: int) -> tuple[Int64Array, Int64Array]:
    """Return the strands of a mesh's edges as `join_segments`, sorted by their first vertices.

    Raises `FormatError` where an edge names no vertex, strands branch, or one is closed.
    """
    if edges.size and (edges.min() < 0 or edges.max() >= vertices):
        raise FormatError(f"edges name a vertex outside 0 to {vertices - 1}")
    if (edges[:, 0] == edges[:, 1]).any():
        raise FormatError("an edge joins a vertex with itself")
    degree = np.bincount(edges.reshape(-1), minlength=vertices)
    if degree.max(initial=0) > 2:
        raise FormatError(f"{np.count_nonzero(degree > 2)} vertices are on more than two edges")
    order, counts = join_segments(edges, vertices)
    if 2 * len(counts) != np.count_nonzero(degree == 1):
        raise FormatError("a strand is closed: its edges come back to where they start")
    first = order[np.cumsum(counts) - counts]
    turn = np.argsort(np.repeat(first, counts), kind="stable")
    return order[turn], counts[np.argsort(first)]


@dataclass(frozen=True, eq=False)
class _Halves:
    """Both directions of every segment: half 2 e runs as segment e does, half 2 e + 1 back."""

    start: Int64Array
    end: Int64Array
    following: Int64Array
    """The half that goes on from each one's end; itself where the strand ends."""

    @staticmethod
    def of(segments: Int64Array, vertices: int) -> _Halves:
        start, end = segments.ravel(), segments[:, ::-1].ravel()
        number = np.arange(len(start))
        degree = np.bincount(start, minlength=vertices)
        # of the two halves that leave a vertex, one is the way back: the sum tells the other
        leaving = np.bincount(start, number, minlength=vertices).astype(np.int64)
        following = np.where(degree[end] == 2, leaving[end] - (number ^ 1), number)
        return _Halves(start, end, following)


@dataclass(frozen=True, eq=False)
class _Ranked:
    """Halves with their place in the strand."""

    halves: _Halves
    last: Int64Array
    """The last half of each one's strand."""
    left: Int64Array
    """Halves that follow up to it."""
    kept: BoolArray
    """False for one direction of every ring."""


def _consecutive(segments: Int64Array, vertices: int) -> tuple[Int64Array, Int64Array] | None:
    """Return the strands of segments that stand one after the other in the file, else None."""
    if not len(segments):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    ends = np.append(segments[1:, 0] != segments[:-1, 1], True)
    counts = np.diff(np.flatnonzero(ends), prepend=-1) + 1
    first = np.flatnonzero(np.append(True, ends[:-1]))
    order = np.insert(segments[:, 1], first, segments[first, 0])
    if np.bincount(order, minlength=vertices).max() > 1:
        return None
    return order, counts


def _rank(halves: _Halves) -> _Ranked:
    last, left = _jump_to_ends(halves.following)
    open_ended = halves.following[last] == last
    kept = np.ones(len(last), bool)
    if not open_ended.all():
        halves, kept = _cut_rings(halves, ~open_ended)
        last, left = _jump_to_ends(halves.following)
    return _Ranked(halves, last, left, kept)


def _jump_to_ends(following: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return where each half's way ends and after how many steps; rings come to no end."""
    last, left = following, (following != np.arange(len(following))).astype(np.int64)
    for _ in range(len(following).bit_length()):
        if (following[last] == last).all():
            break
        left = left + left[last]
        last = last[last]
    return last, left


def _cut_rings(halves: _Halves, ring: BoolArray) -> tuple[_Halves, BoolArray]:
    """Return halves whose rings end before their lowest half, and which direction to keep."""
    lowest, jump = np.arange(len(ring)), halves.following
    for _ in range(len(ring).bit_length()):
        lowest = np.minimum(lowest, lowest[jump])
        jump = jump[jump]
    following = halves.following.copy()
    before = np.flatnonzero(ring & (following == lowest))
    following[before] = before
    kept = ~ring | (lowest < lowest[np.arange(len(ring)) ^ 1])
    return _Halves(halves.start, halves.end, following), kept


def _strands(ranked: _Ranked) -> tuple[Int64Array, Int64Array]:
    """Return vertices in order and counts, of the better direction of each strand."""
    halves, last, left = ranked.halves, ranked.last, ranked.left
    number = np.arange(len(last))
    along = np.bincount(last, number % 2 == 0, minlength=len(last))
    members = np.bincount(last, minlength=len(last))
    is_first = left == members[last] - 1
    first = np.zeros(len(last), np.int64)
    first[last[is_first]] = number[is_first]
    backward = first[last] ^ 1  # the last half of the same strand, run the other way
    better = 2 * along[last] - members[last]
    root, tip = halves.start[first[last]], halves.end[last]
    take = (better > 0) | ((better == 0) & ((root < tip) | ((root == tip) & (last < backward))))
    whole_ring = ~ranked.kept | ~ranked.kept[number ^ 1]
    take = np.where(whole_ring, ranked.kept, take)
    chosen = np.flatnonzero(take)
    # strands in the order of their first segment in the file
    earliest = np.full(len(last), len(last))
    np.minimum.at(earliest, last[chosen], chosen // 2)
    order = chosen[np.lexsort((-left[chosen], last[chosen], earliest[last[chosen]]))]
    ends = np.append(last[order[1:]] != last[order[:-1]], True)
    counts = np.diff(np.flatnonzero(ends), prepend=-1) + 1
    begins = np.flatnonzero(np.append(True, ends[:-1]))
    return np.insert(halves.end[order], begins, halves.start[order[begins]]), counts
