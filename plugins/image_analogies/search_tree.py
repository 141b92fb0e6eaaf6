"""A k-d tree over features reduced by principal components, searched best bin first.

The tree is complete and balanced: its nodes are numbered as in a heap, and all leaves have the same
number of points. A search takes the nearest unseen cell first (Beis and Lowe 1997) and ends
when no cell can hold anything better, or after a given number of leaves. Principal components are
orthonormal, so distances in the tree never exceed those of whole features: what is too far there is
too far.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Int32Array, Int64Array
from hairkit.parallel import compiled, compiled_with

from .features import Pair, gather_feature

MOST_POINTS = 2**18
"""Pixels of the example that are put into a tree; of more, evenly chosen ones."""
COMPONENTS = 16
"""Principal components that the tree is built over."""
LEAF_POINTS = 16
"""Points of a leaf, about."""
_SAMPLED = 20_000
"""Features from which the principal components are computed."""
_ROW, _COLUMN = 0, 1
"""Columns of places."""


class Tree(NamedTuple):
    """A k-d tree over some of the numbers of features; K components, 2^d leaves of m points."""

    first: int
    """The first number of a feature that counts here."""
    mean: Float32Array
    """(D,) mean of those numbers."""
    components: Float32Array
    """(D, K) principal components, orthonormal columns."""
    axis: Int32Array
    """(2^d - 1,) component along which a node is split."""
    split: Float32Array
    """(2^d - 1,) value at which; smaller ones are in child 2 i + 1, larger ones in 2 i + 2."""
    points: Float32Array
    """(2^d, K, m) points by leaf; the points of a component lie side by side."""
    places: Int32Array
    """(2^d, m, 2) row and column of each in the example."""


class Heap(NamedTuple):
    """Cells that a search has left aside, the nearest first."""

    bound: Float32Array
    """(Q,) squared distance of each cell at least."""
    node: Int32Array
    """(Q,) node of each cell."""


def build_tree(
    example: Pair, places: Int32Array, roots: Float32Array, first: int, last: int
) -> Tree:
    """Return the tree over numbers `first` to `last` of the features at `places` (N, 2)."""
    if len(places) > MOST_POINTS:
        places = places[np.linspace(0, len(places) - 1, MOST_POINTS).astype(np.int64)]
    features = np.empty((len(places), len(roots)), np.float32)
    gather_features(example, places, roots, features)
    features = features[:, first:last]
    sample = features[:: max(len(features) // _SAMPLED, 1)].astype(np.float64)
    mean = sample.mean(axis=0)
    spread, vectors = np.linalg.eigh((sample - mean).T @ (sample - mean))
    components = vectors[:, np.argsort(spread)[::-1][:COMPONENTS]].astype(np.float32)
    points = (features - mean.astype(np.float32)) @ components
    depth = max(math.ceil(math.log2(len(points) / LEAF_POINTS)), 0)
    size = math.ceil(len(points) / 2**depth) * 2**depth
    order = np.resize(np.arange(len(points)), size)  # the first ones twice
    axis, split, order = _split(np.ascontiguousarray(points[order]), order, depth)
    leaves = order.reshape(2**depth, -1)
    return Tree(
        first,
        mean.astype(np.float32),
        np.ascontiguousarray(components),
        axis,
        split,
        np.ascontiguousarray(points[leaves].transpose(0, 2, 1)),
        np.ascontiguousarray(places[leaves]),
    )


def new_heap(leaves: int, trees: tuple[Tree, ...]) -> Heap:
    """Return an empty heap for searches of at most so many leaves."""
    depth = max(int(math.log2(len(tree.points))) for tree in trees)
    most = min(leaves, max(len(tree.points) for tree in trees)) * depth + 1
    return Heap(np.empty(most, np.float32), np.empty(most, np.int32))


@compiled
def gather_features(
    example: Pair, places: Int32Array, roots: Float32Array, features: Float32Array
) -> None:
    """Write the features (N, D) at places (N, 2)."""
    for n in range(len(places)):
        gather_feature(example, places[n, _ROW], places[n, _COLUMN], roots, features[n])


def _split(
    points: Float32Array, order: Int64Array, depth: int
) -> tuple[Int32Array, Float32Array, Int64Array]:
    """Halve all nodes of each level at their medians, along the axis of their largest variance."""
    axes, splits = [np.empty(0, np.int32)], [np.empty(0, np.float32)]
    for level in range(depth):
        nodes = points.reshape(2**level, -1, points.shape[1])
        half = nodes.shape[1] // 2
        axis = nodes.var(axis=1).argmax(axis=1)
        along = np.take_along_axis(nodes, axis[:, None, None], axis=2)[..., 0]
        turn = np.argpartition(along, half, axis=1)
        splits.append(np.take_along_axis(along, turn[:, half : half + 1], axis=1)[:, 0])
        axes.append(axis.astype(np.int32))
        points = np.take_along_axis(nodes, turn[..., None], axis=1).reshape(points.shape)
        order = np.take_along_axis(order.reshape(2**level, -1), turn, axis=1).ravel()
    return np.concatenate(axes), np.concatenate(splits), order


@compiled_with(allocates=True)
def search_tree(
    tree: Tree, heap: Heap, feature: Float32Array, leaves: int, limit: float, place: Int32Array
) -> bool:
    """Write the place (2,) of the nearest reduced feature; return whether there is one.

    Parameters
    ----------
    tree, heap
        Where to search, and working memory.
    feature
        (D,) the feature that is looked for.
    leaves
        Number of leaves that are looked at, at most.
    limit
        Only what is nearer than this squared distance counts; nothing is written otherwise.
    """
    query = np.zeros(tree.components.shape[1], np.float32)
    for i in range(len(tree.mean)):
        above = feature[tree.first + i] - tree.mean[i]
        for k in range(len(query)):
            query[k] += tree.components[i, k] * above
    distances = np.empty(tree.points.shape[2], np.float32)
    best, found = np.float32(limit), False
    inner = len(tree.split)
    heap.bound[0], heap.node[0] = 0.0, 0
    waiting = 1
    for _ in range(leaves):
        if waiting == 0 or heap.bound[0] >= best:
            break
        bound, node = heap.bound[0], heap.node[0]
        waiting = _take_first(heap, waiting)
        while node < inner:
            beyond = query[tree.axis[node]] - tree.split[node]
            near, far = 2 * node + 1, 2 * node + 2
            if beyond > 0:
                near, far = far, near
            farther = max(bound, beyond * beyond)
            if farther < best:
                waiting = _add(heap, waiting, farther, far)
            node = near
        leaf = node - inner
        distances[:] = 0.0
        for k in range(len(query)):
            for n in range(len(distances)):
                along = tree.points[leaf, k, n] - query[k]
                distances[n] += along * along
        for n in range(len(distances)):
            if distances[n] < best:
                best, found = distances[n], True
                place[:] = tree.places[leaf, n]
    return found


@compiled
def _add(heap: Heap, waiting: int, bound: float, node: int) -> int:
    """Put a cell into a heap of `waiting` ones; return how many wait now."""
    i = waiting
    while i > 0 and heap.bound[(i - 1) // 2] > bound:
        heap.bound[i], heap.node[i] = heap.bound[(i - 1) // 2], heap.node[(i - 1) // 2]
        i = (i - 1) // 2
    heap.bound[i], heap.node[i] = bound, node
    return waiting + 1


@compiled_with(inside=True)
def _take_first(heap: Heap, waiting: int) -> int:
    """Remove the nearest cell; return how many are left."""
    last = waiting - 1
    bound, node = heap.bound[last], heap.node[last]
    i = 0
    while 2 * i + 1 < last:
        child = 2 * i + 1
        if child + 1 < last and heap.bound[child + 1] < heap.bound[child]:
            child += 1
        if heap.bound[child] >= bound:
            break
        heap.bound[i], heap.node[i] = heap.bound[child], heap.node[child]
        i = child
    heap.bound[i], heap.node[i] = bound, node
    return last
