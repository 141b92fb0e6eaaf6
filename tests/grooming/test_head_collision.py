"""Laws of keeping strands out of the head."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hairkit.field.growth_prior import gradient
from hairkit.grooming.head_collision import FULL_AFTER, ROUNDS, push_out_of_head
from hairkit.testing import shell_hull
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull

HULL = shell_hull(0.01)
ROOM = (HULL.grid, HULL.head_distance)


def twin(strands: Strands, hull: Hull, clearance: float) -> np.ndarray[tuple[int, int], np.dtype]:
    """The readable twin of the compiled kernel."""
    points = strands.points.astype(np.float64)
    apart = clearance * np.minimum(strands.arc_lengths() / FULL_AFTER, 1)
    free = np.ones(len(points), bool)
    free[strands.offsets[:-1]] = False
    for _ in range(ROUNDS):
        lack = apart - hull.grid.sample(hull.head_distance, points)
        near = np.flatnonzero((lack > 0) & free)
        points[near] += lack[near, None] * gradient(hull.grid, hull.head_distance, points[near])
    return points


@given(st.integers(0, 1000), st.floats(0.0, 0.01))
def test_the_kernel_does_what_its_twin_does(seed: int, clearance: float) -> None:
    """Random strands through the ball, some points outside of the grid too."""
    points = np.random.default_rng(seed).uniform(-0.17, 0.17, (40, 3)).astype(np.float32)
    strands = Strands(points, np.arange(9) * 5)
    found = push_out_of_head(strands, *ROOM, clearance)
    np.testing.assert_allclose(found.points, twin(strands, HULL, clearance), atol=2e-6)


def test_points_keep_the_clearance_and_roots_stay(rng: np.random.Generator) -> None:
    """Every point but the first of each strand ends outside; free points do not move."""
    points = rng.uniform(-0.11, 0.11, (600, 3)).astype(np.float32)
    strands = Strands(points, np.arange(121) * 5)
    found = push_out_of_head(strands, *ROOM, 0.002)
    np.testing.assert_array_equal(found.roots, strands.roots)
    rest = np.setdiff1d(np.arange(600), strands.offsets[:-1])
    away = np.linalg.norm(found.points[rest], axis=1)
    deep = np.linalg.norm(points[rest], axis=1) < 0.04  # the distance has a kink at the middle
    assert (away[~deep] > 0.1 + 0.001).all()
    outside = np.linalg.norm(points[rest], axis=1) > 0.104
    np.testing.assert_array_equal(found.points[rest][outside], points[rest][outside])


def test_hair_leaves_the_skin_as_it_was_combed() -> None:
    """Strands that run flat over the ball turn up by no more than the clearance over its way."""
    angle = np.linspace(0, 0.3, 64)
    arc = 0.1 * np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    found = push_out_of_head(Strands.from_list([arc.astype(np.float32)]), *ROOM, 0.001)
    first = np.diff(found.points, axis=0)[0]
    assert first[1] / np.linalg.norm(first) < 0.35
