"""Peers of functions on photos and strands: orientation, seeds, searches, resampling."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from hairkit_plugins import gabor
from hairkit_plugins.image_analogies.features import feature_weights, make_pair
from hairkit_plugins.image_analogies.search_tree import (
    Heap,
    Tree,
    build_tree,
    gather_features,
    new_heap,
    search_tree,
)
from peer_cases import Case, largest, share_differing
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Int32Array
from hairkit.evaluation.neighbour_search import FIRST_HIT_NONE, HashGrid, first_hits
from hairkit.imaging.geodesic import edge_costs, seed_distance
from hairkit.imaging.masked_filters import luminance
from hairkit.io.capture_reader import read_capture, sample_folder
from hairkit.parallel import compiled
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import angle_between
from hairkit.types.strands import Strands

Array = npt.NDArray[Any]
ONE_STEP = np.pi / 32
"""Radians between two filters."""
EDGE_PX = 5
"""Half a filter and a pixel: nearer to the outline the backdrop is filled, not filtered."""
SEARCHED = 64
"""Pixels of the edge of a picture whose features are searched, and as many queries as pixels."""
CLOSE, ANGLE = (0.001, 0.002, 0.004), (10.0, 20.0, 40.0)
"""Thresholds of a match: metres and degrees."""
SHAKES = (0.001, 0.1)
"""Metres, and parts of a unit vector, by which samples miss those that they match."""


def orientation(size: float) -> Iterator[Case]:
    """The direction of hair in a photo by 32 Gabor filters, without iterations."""
    view, mask = _front(size)
    picture, options = luminance(view.image), gabor.Options(iterations=0)
    inner = cv2.erode(mask.hair.astype(np.uint8), np.ones((2 * EDGE_PX + 1,) * 2)) > 0
    bank = gabor.gabor_kernels(options)[0].astype(np.float32)

    def strongest(kernels: Any) -> Array:
        best = np.abs(np.stack([cv2.filter2D(picture, cv2.CV_32F, k) for k in kernels])).argmax(0)
        return np.asarray(best * (np.pi / options.angles) + np.pi / 2)

    def by_skimage() -> Array:
        from skimage.filters import gabor_kernel

        shape = {"sigma_x": options.sigma_u, "sigma_y": options.sigma_v, "n_stds": 2}
        turns = np.pi * np.arange(options.angles) / options.angles
        waves = [gabor_kernel(1 / options.wavelength, theta=t, **shape) for t in turns]
        return strongest([np.real(wave - wave.mean()).astype(np.float32) for wave in waves])

    def apart(ours: Any, theirs: Array) -> float:
        found = angle_between(ours.angle[inner], theirs[inner])
        return 100 * float(np.mean(found > 1.01 * ONE_STEP))

    peers: dict[str, Callable[[], Any]] = {"32 times `cv2.filter2D`": lambda: strongest(bank)}
    peers["the same with scikit-image `gabor_kernel`"] = by_skimage
    yield Case(
        "`orient` of `gabor`",
        f"{view.width} x {view.height} pixels",
        lambda: gabor.orient(view=view, mask=mask, options=options),
        peers,
        apart,
        "% of hair off by more than a step",
        10.0,
    )


def seeds(size: float) -> Iterator[Case]:
    """Costs of ways over a photo from seeds."""
    view, mask = _front(size)
    lab = cv2.GaussianBlur(
        cv2.cvtColor(view.image, cv2.COLOR_RGB2LAB).astype(np.float32), (0, 0), 1
    )
    costs, start = edge_costs(lab / lab.std(axis=(0, 1)), 0.02, 0.25), mask.hair

    def dijkstra() -> Array:
        index = np.pad(np.arange(start.size).reshape(start.shape), 1, constant_values=-1)
        middle, pairs, weights = index[1:-1, 1:-1], [], []
        for k, (dy, dx) in enumerate(((0, -1), (-1, -1), (-1, 0), (-1, 1))):
            there = np.roll(index, (-dy, -dx), (0, 1))[1:-1, 1:-1]
            pairs.append(np.stack([middle[there >= 0], there[there >= 0]]))
            weights.append(costs[..., k][there >= 0])
        (a, b), w = np.concatenate(pairs, axis=1), np.concatenate(weights)
        graph = sparse.csr_matrix((w, (a, b)), shape=(start.size, start.size))
        first = np.flatnonzero(start)
        found = csgraph.dijkstra(graph, directed=False, indices=first, min_only=True)
        return np.asarray(found.reshape(start.shape))

    yield Case(
        "`seed_distance`",
        f"{view.width} x {view.height} pixels",
        lambda: seed_distance(costs, start),
        {"`scipy.sparse.csgraph.dijkstra`": dijkstra},
        lambda ours, theirs: 100 * float(np.mean(ours > 1.05 * theirs + 1e-3)),
        "% of pixels by more than 5 %",
        0.1,
    )


def matches(size: float) -> Iterator[Case]:
    """The first threshold of distance and angle at which directed samples find a partner."""
    ours = _samples(np.random.default_rng(0), int(200_000 * size))
    theirs = tuple(_shake(values, by) for values, by in zip(ours, SHAKES, strict=True))
    cosines = np.cos(np.radians(ANGLE))

    def compiled_search() -> Array:
        grid = HashGrid.build(*ours, CLOSE[0])
        return first_hits(grid, *theirs, np.array(CLOSE), cosines)[0]

    def by_tree() -> Array:
        result = np.full(len(theirs[0]), FIRST_HIT_NONE, np.uint8)
        tree, other = cKDTree(ours[0]), cKDTree(theirs[0])
        for rank in reversed(range(len(CLOSE))):
            near = tree.sparse_distance_matrix(other, CLOSE[rank], output_type="coo_matrix")
            along = np.abs(np.einsum("nc,nc->n", ours[1][near.row], theirs[1][near.col]))
            result[near.col[along >= cosines[rank]]] = rank
        return result

    yield Case(
        "`first_hits`",
        f"{len(theirs[0]):,} samples among as many",
        compiled_search,
        {"`cKDTree.sparse_distance_matrix`": by_tree},
        share_differing,
        "% of the samples",
        0.01,
    )


def _lengths_apart(first: Array, second: Array) -> float:
    """Return the largest difference of two vectors' lengths, percent of the mean length."""
    a, b = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    return 100 * float(np.abs(a - b).max() / b.mean())


def searches(size: float) -> Iterator[Case]:
    """Exact nearest features of pixels, as in textures by example."""
    rng, edge = np.random.default_rng(0), int(SEARCHED * size**0.5)
    image = cv2.GaussianBlur(rng.random((edge, edge)).astype(np.float32), (0, 0), 1.0)[..., None]
    pair, roots = make_pair(image, image, None, None), feature_weights(1, None, coarsest=True)
    places = np.argwhere(np.ones((edge, edge))).astype(np.int32)
    features = np.empty((len(places), len(roots)), np.float32)
    gather_features(pair, places, roots, features)
    queries = features + rng.normal(0, 0.003, features.shape).astype(np.float32)

    def ours() -> Array:
        tree, found = build_tree(pair, places, roots, 0, len(roots)), np.empty_like(places)
        search_all(tree, new_heap(len(places), (tree,)), queries, found)
        return (queries - tree.mean) @ tree.components - _reduced(found, tree)

    def _reduced(at: Array, tree: Tree) -> Array:
        return (features[at[:, 0] * edge + at[:, 1]] - tree.mean) @ tree.components

    given = build_tree(pair, places, roots, 0, len(roots))

    def by_tree(search: Callable[[cKDTree, Array], Array]) -> Array:
        points = (features - given.mean) @ given.components
        wanted = (queries - given.mean) @ given.components
        return wanted - points[search(cKDTree(points), wanted)]

    peers: dict[str, Callable[[], Any]] = {
        "`cKDTree.query`, one after another": lambda: by_tree(
            lambda tree, wanted: np.array([tree.query(one)[1] for one in wanted])
        ),
        "`cKDTree.query`, all at once": lambda: by_tree(lambda tree, all_: tree.query(all_)[1]),
    }
    yield Case(
        "`search_tree`",
        f"{len(queries):,} queries in as many points of {given.components.shape[1]} numbers",
        ours,
        peers,
        _lengths_apart,
        "% of the distance",
        0.1,
    )


@compiled
def search_all(tree: Tree, heap: Heap, queries: Float32Array, found: Int32Array) -> None:
    """Write the places (N, 2) of the nearest features of queries (N, D)."""
    for n in range(len(queries)):
        search_tree(tree, heap, queries[n], len(tree.points), np.inf, found[n])


def resampling(size: float) -> Iterator[Case]:
    """Strands of equal steps."""
    rng, count = np.random.default_rng(0), int(10_000 * size)
    paths = rng.normal(0, 0.005, (count, 40, 3)).cumsum(axis=1).astype(np.float32)
    strands = Strands.from_list(list(paths))

    def plain() -> Array:
        result = []
        for k in range(count):
            path = strands.points[strands.offsets[k] : strands.offsets[k + 1]]
            arc = np.concatenate([[0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()])
            wanted = np.linspace(0, arc[-1], 32)
            result.append(np.stack([np.interp(wanted, arc, path[:, c]) for c in range(3)], axis=1))
        return np.concatenate(result)

    yield Case(
        "`Strands.resampled`",
        f"{count:,} strands of 40 points",
        lambda: strands.resampled(32).points,
        {"`numpy.interp` and a loop": plain},
        lambda ours, theirs: 1e3 * largest(ours, theirs),
        "mm",
        0.01,
    )


def _front(size: float) -> tuple[View, Mask]:
    """Return the first photo of the sample and its mask."""
    view = read_capture(sample_folder(), int(1440 * size**0.5)).views[0]
    assert view.mask_path is not None
    labels: Any = cv2.imread(str(view.mask_path), cv2.IMREAD_GRAYSCALE)
    labels = cv2.resize(labels, (view.width, view.height), interpolation=cv2.INTER_NEAREST)
    return view, Mask(np.where(labels == HAIR, HAIR, 0).astype(np.uint8), False)


def _samples(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return points (N, 3) in a block whose edge is that of dense hair, and unit directions."""
    points = rng.uniform(0, 0.002 * count ** (1 / 3), (count, 3)).astype(np.float32)
    ways = rng.normal(size=(count, 3))
    return points, (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32)


def _shake(values: Array, by: float) -> Array:
    """Return values (N, 3) with noise of that deviation."""
    return (values + np.random.default_rng(1).normal(0, by, values.shape)).astype(np.float32)


CASES: list[Callable[[float], Iterator[Case]]] = [
    orientation,
    seeds,
    matches,
    searches,
    resampling,
]
"""Functions of the size of the input, 1 for the usual one."""
