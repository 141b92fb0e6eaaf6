"""Laws of roots: as many as asked, evenly spread, on the scalp, and joined into one sheet."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from hairkit.errors import InputError
from hairkit.head_model.scalp import bind, evaluate, growth_mesh, sample_roots, scattered
from hairkit.head_model.template import default_head
from hairkit.types.head import Head


def _scalp_area(head: Head) -> float:
    corners = head.vertices.astype(np.float64)[head.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    chosen = head.scalp[head.faces].mean(axis=1) > 0.5
    return float(0.5 * np.linalg.norm(normal, axis=1)[chosen].sum())


@pytest.mark.parametrize("count", [1, 2, 3, 17, 600, 5000])
def test_there_are_exactly_as_many_roots_as_asked(count: int) -> None:
    """Every count is met, each root once, on the scalp; normals are unit, weights sum to 1."""
    head = default_head()
    roots = sample_roots(head, count)
    assert len(roots) == count
    assert len(np.unique(roots.positions, axis=0)) == count
    scalp = (head.scalp[head.faces[roots.triangle]] * roots.barycentric).sum(axis=1)
    assert scalp.min() > 0.5 - 1e-5
    np.testing.assert_allclose(np.linalg.norm(roots.normals, axis=1), 1, atol=1e-5)
    np.testing.assert_allclose(roots.barycentric.sum(axis=1), 1, atol=1e-5)


def test_roots_are_evenly_spread() -> None:
    """Nearest neighbours are nearly equally far apart, near what a honeycomb would allow."""
    head = default_head()
    for count in (600, 4000):
        points = sample_roots(head, count).positions
        apart = cKDTree(points).query(points, k=2)[0][:, 1]
        honeycomb = np.sqrt(2 * _scalp_area(head) / (np.sqrt(3) * count))
        assert apart.min() > 0.55 * honeycomb
        assert apart.std() / apart.mean() < 0.15


def test_roots_leave_no_part_of_the_scalp_bare() -> None:
    """From any point of a dense sample the nearest of the roots is at most 1.6 spacings away."""
    head = default_head()
    count = 800
    gap = cKDTree(sample_roots(head, count).positions).query(sample_roots(head, 6000, 1).positions)
    assert gap[0].max() < 1.6 * np.sqrt(_scalp_area(head) / count)


def test_equal_input_gives_equal_roots_and_another_seed_others() -> None:
    """The spread is a function of head, count and seed."""
    head = default_head()
    first, second = sample_roots(head, 300, seed=4), sample_roots(head, 300, seed=4)
    np.testing.assert_array_equal(first.positions, second.positions)
    assert not np.array_equal(first.positions, sample_roots(head, 300, seed=5).positions)


def test_scattered_points_equal_the_slow_rule() -> None:
    """The compiled kernel takes just those points that have none of the taken within the radius."""
    points = np.random.default_rng(3).random((400, 3))
    taken: list[int] = []
    for i, point in enumerate(points):
        if all(((points[j] - point) ** 2).sum() >= 0.15**2 for j in taken):
            taken.append(i)
    np.testing.assert_array_equal(scattered(points, 0.15), taken)


def test_roots_follow_a_moved_head() -> None:
    """Evaluated on the turned head, the same bindings give the turned roots."""
    head = default_head()
    roots = sample_roots(head, 200)
    angle = 0.7
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    moved = Head(
        head.vertices @ turn.T.astype(np.float32) + 0.1, head.faces, head.uv, head.scalp,
        None, head.joints, head.capsules,
    )  # fmt: skip
    np.testing.assert_allclose(
        evaluate(moved, roots.triangle, roots.barycentric),
        roots.positions @ turn.T + 0.1,
        atol=1e-6,
    )


def test_binding_undoes_evaluating() -> None:
    """Points of the surface are bound where they are; points above it to the surface below them."""
    head = default_head()
    roots = sample_roots(head, 500)
    for lift in (0.0, 0.002):
        triangle, weights = bind(roots.positions + lift * roots.normals, head)
        apart = np.linalg.norm(evaluate(head, triangle, weights) - roots.positions, axis=1)
        assert apart.max() < 1e-6 + 0.2 * lift


@pytest.mark.parametrize("count", [3, 60, 600, 3000])
def test_growth_mesh_is_one_sheet_over_all_roots(count: int) -> None:
    """Every root is used, no edge has three faces, faces look outward, nothing bridges the face."""
    head = default_head()
    roots = sample_roots(head, count)
    faces = growth_mesh(roots, head)
    assert faces.dtype == np.int32
    np.testing.assert_array_equal(np.unique(faces), np.arange(count))
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    assert uses.max() <= 2
    assert count - len(edges) + len(faces) == 1
    corners = roots.positions.astype(np.float64)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((normal * roots.normals[faces].sum(axis=1)).sum(axis=1) > 0).all()
    if count >= 600:
        length = np.linalg.norm(roots.positions[edges[:, 0]] - roots.positions[edges[:, 1]], axis=1)
        assert length.max() < 4 * np.sqrt(_scalp_area(head) / count)


def test_impossible_roots_are_refused() -> None:
    """No roots, far too many, or a growth mesh of two give one line each."""
    head = default_head()
    for count in (0, -3, 10**9):
        with pytest.raises(InputError, match="expected 1 to"):
            sample_roots(head, count)
    with pytest.raises(InputError, match="at least 3 roots"):
        growth_mesh(sample_roots(head, 2), head)
