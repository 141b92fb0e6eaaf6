"""Assemble strands from the unordered edges of mesh formats."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import BoolArray, Int64Array
from hairkit.errors import FormatError


def chains(edges: Int64Array, vertices: int) -> tuple[Int64Array, Int64Array]:
    """Return the vertices (P,) strand after strand, and the points (S,) of each strand.

    A strand starts at the end where its first edge starts too; where both ends do or none, at the
    end of the lower number. Strands come in the order of the vertices they start at.

    Parameters
    ----------
    edges
        (E, 2) vertex numbers from 0.
    vertices
        Number of vertices.

    Raises
    ------
    FormatError
        An edge names no vertex, strands branch, or one is closed.
    """
    if edges.size and (edges.min() < 0 or edges.max() >= vertices):
        raise FormatError(f"edges name a vertex outside 0 to {vertices - 1}")
    if (edges[:, 0] == edges[:, 1]).any():
        raise FormatError("an edge joins a vertex with itself")
    degree = np.bincount(edges.reshape(-1), minlength=vertices)
    if degree.max(initial=0) > 2:
        raise FormatError(f"{np.count_nonzero(degree > 2)} vertices are on more than two edges")
    after = _next_half_edge(edges, vertices)
    last, steps = _ends(after)
    start = np.concatenate([edges[:, 0], edges[:, 1]])
    first = _first_half_edges(start, last, degree, len(edges))
    counts = steps[first] + 2
    return _walk(start, after, first, counts), counts


def _next_half_edge(edges: Int64Array, vertices: int) -> Int64Array:
    """Return (2E,) the half-edge that goes on from each; itself at an end.

    Half-edge e runs along edge e, half-edge E + e back.
    """
    count = len(edges)
    start = np.concatenate([edges[:, 0], edges[:, 1]])
    own = np.arange(2 * count)
    twin = np.concatenate([own[count:], own[:count]])
    total = np.zeros(vertices, np.int64)
    np.add.at(total, start, own)  # the sum of a vertex's two half-edges, less one, is the other
    degree = np.bincount(start, minlength=vertices)
    there = start[twin]
    return np.where(degree[there] == 2, total[there] - twin, own)


def _ends(after: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return (2E,) the half-edge at the end of each one's way, and the steps there.

    Pointer doubling: after log2(E) rounds only closed loops have not reached an end.
    """
    is_end = after == np.arange(len(after))
    steps = (~is_end).astype(np.int64)
    for _ in range(int(np.ceil(np.log2(max(len(after), 2)))) + 1):
        if is_end[after].all():
            return after, steps
        steps = steps + steps[after]
        after = after[after]
    raise FormatError("a strand is closed: its edges come back to where they start")


def _first_half_edges(
    start: Int64Array, last: Int64Array, degree: Int64Array, count: int
) -> Int64Array:
    """Return (S,) the half-edge that each strand starts with."""
    leaving: BoolArray = degree[start] == 1
    first = np.flatnonzero(leaving)
    other = (last[first] + count) % (2 * count) if count else first
    along, other_along = first < count, other < count
    lower = start[first] < start[other]
    chosen = first[np.where(along != other_along, along, lower)]
    return chosen[np.argsort(start[chosen])]


def _walk(
    start: Int64Array, after: Int64Array, first: Int64Array, counts: Int64Array
) -> Int64Array:
    """Return the vertices of all strands; one step of the longest strand is one step of all."""
    order = np.empty(int(counts.sum()), np.int64)
    place = np.cumsum(counts) - counts
    half = len(start) // 2
    at, alive = first, np.arange(len(first))
    for step in range(int(counts.max(initial=1)) - 1):
        alive = alive[counts[alive] > step + 1]
        order[place[alive] + step] = start[at[alive]]
        ending = alive[counts[alive] == step + 2]
        order[place[ending] + step + 1] = start[(at[ending] + half) % (2 * half)]
        at = after[at]
    return order
