"""Strands put together from line segments: by order where a file keeps it, else as a graph."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from hairkit.arrays import Int64Array
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
    vertex = np.concatenate([np.arange(vertices), segments.ravel()])
    nodes, counts = _strands(_paths(segments, vertices), vertex)
    return vertex[nodes], counts


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


def _paths(segments: Int64Array, vertices: int) -> Int64Array:
    """Return the segments (M, 2) between nodes that are joined to strands alone.

    A node is a vertex, or has the number of an end of a segment above those of all vertices: where
    strands end, each segment has a node of its own there, and so has the first one of a ring.
    """
    own = vertices + np.arange(segments.size).reshape(-1, 2)
    nodes = np.where(
        np.bincount(segments.ravel(), minlength=vertices)[segments] == 2, segments, own
    )
    strand = _strand_of(nodes)[nodes[:, 0]]
    first = np.unique(strand, return_index=True)[1]
    opened = np.bincount(strand, (nodes >= vertices).any(axis=1))[np.unique(strand)] > 0
    nodes[first[~opened], 0] = own[first[~opened], 0]
    return nodes


def _strand_of(nodes: Int64Array) -> Int64Array:
    """Return the number of the strand of each node."""
    count = int(nodes.max()) + 1
    graph = coo_matrix((np.ones(len(nodes), np.int8), tuple(nodes.T)), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def _strands(nodes: Int64Array, vertex: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return the nodes (P,) of all strands in order and their counts, by `vertex` (N,) of nodes."""
    used, ends = np.unique(nodes, return_inverse=True)
    ends, count = ends.reshape(-1, 2), len(used)
    _, strand = np.unique(_strand_of(nodes)[used], return_inverse=True)
    earliest = np.unique(strand[ends[:, 0]], return_index=True)[1]
    # steps from the end whose vertex comes first, all strands at once from a node beyond
    outer = np.flatnonzero(np.bincount(ends.ravel()) == 1)
    outer = outer[np.lexsort((vertex[used[outer]], strand[outer]))][::2]
    pairs = np.concatenate([ends, np.stack([outer, np.full(len(outer), count)], axis=1)])
    graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), (count + 1, count + 1))
    steps = dijkstra(graph, directed=False, indices=count, unweighted=True)[:count]
    along = np.sign(steps[ends[:, 1]] - steps[ends[:, 0]])
    backwards = np.bincount(strand[ends[:, 0]], along) < 0
    order = np.lexsort((np.where(backwards[strand], -steps, steps), earliest[strand]))
    return used[order], np.bincount(strand)[np.argsort(earliest)]
