"""Laws of the distance that counts edges crossed."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.imaging.geodesic import FAR, edge_costs, seed_distance

BACKWARD_STEPS = ((0, -1), (-1, -1), (-1, 0), (-1, 1))
"""(rows, columns) to the neighbours left, up left, up and up right, in the order of the costs."""


def scene(seed: int, height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    colour = rng.normal(0, 10, (height, width, 3)).astype(np.float32)
    seeds = np.zeros((height, width), bool)
    seeds[rng.integers(height), rng.integers(width)] = True
    return colour, seeds


def seed_distance_exact(costs: Float32Array, seeds: BoolArray) -> Float64Array:
    """Return the limit of `seed_distance` by Dijkstra's algorithm: the readable reference."""
    height, width = seeds.shape
    number = np.arange(height * width).reshape(height, width)
    rows, columns, values = [], [], []
    for index, (dy, dx) in enumerate(BACKWARD_STEPS):
        y, x = np.nonzero(costs[..., index] < FAR)
        rows.append(number[y, x])
        columns.append(number[y + dy, x + dx])
        values.append(costs[y, x, index])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    graph = coo_matrix(entries, (number.size, number.size)).tocsr()
    start = np.flatnonzero(seeds)
    if not len(start):
        return np.full(seeds.shape, float(FAR))
    reached = dijkstra(graph, directed=False, indices=start, min_only=True)
    result: Float64Array = np.minimum(reached, float(FAR)).reshape(height, width)
    return result


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 12), st.integers(1, 12))
def test_sweeps_converge_to_dijkstra(seed: int, height: int, width: int) -> None:
    """The fast kernel and its slow twin agree when it may sweep as often as it likes."""
    colour, seeds = scene(seed, height, width)
    costs = edge_costs(colour, 0.1, 1.0)
    fast = seed_distance(costs, seeds, sweeps=200)
    assert np.allclose(fast, seed_distance_exact(costs, seeds), rtol=1e-5)


def test_few_sweeps_never_fall_short() -> None:
    """Stopping early can only overrate a distance."""
    colour, seeds = scene(3, 30, 40)
    costs = edge_costs(colour, 0.1, 1.0)
    exact = seed_distance_exact(costs, seeds)
    once = seed_distance(costs, seeds, sweeps=1)
    assert (once >= exact - 1e-3).all()
    assert (seed_distance(costs, seeds, sweeps=4) <= once).all()


def test_an_even_picture_gives_chamfer_distance() -> None:
    """Without edges only the length of the way counts."""
    seeds = np.zeros((9, 9), bool)
    seeds[4, 4] = True
    distance = seed_distance(edge_costs(np.zeros((9, 9, 3), np.float32), 1.0, 1.0), seeds)
    assert np.isclose(distance[4, 8], 4)
    assert np.isclose(distance[0, 0], 4 * np.sqrt(2))


def test_an_edge_costs_its_contrast() -> None:
    """Across a step of ten the distance grows by ten times the price of contrast."""
    colour = np.zeros((5, 8, 3), np.float32)
    colour[:, 4:, 0] = 10
    seeds = np.zeros((5, 8), bool)
    seeds[:, 0] = True
    distance = seed_distance(edge_costs(colour, 0.01, 0.5), seeds)
    assert np.allclose(distance[:, 4] - distance[:, 3], 5.01, atol=1e-5)


def test_distance_turns_with_the_picture() -> None:
    """Mirrored and transposed pictures have mirrored and transposed distances."""
    colour, seeds = scene(8, 14, 14)

    def run(c: np.ndarray, s: np.ndarray) -> np.ndarray:
        return seed_distance(edge_costs(np.ascontiguousarray(c), 0.1, 1.0), s, sweeps=100)

    plain = run(colour, seeds)
    assert np.allclose(run(colour[:, ::-1], seeds[:, ::-1])[:, ::-1], plain, rtol=1e-5)
    assert np.allclose(run(colour.transpose(1, 0, 2), seeds.T).T, plain, rtol=1e-5)


def test_no_seed_is_far() -> None:
    """Without seeds every pixel is at `FAR`."""
    costs = edge_costs(np.zeros((3, 3, 3), np.float32), 1.0, 1.0)
    none = np.zeros((3, 3), bool)
    assert (seed_distance(costs, none) == FAR).all()
    assert (seed_distance_exact(costs, none) == FAR).all()
