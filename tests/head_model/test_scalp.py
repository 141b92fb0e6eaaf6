"""Laws of roots: as many as asked, evenly spread, on the scalp, and joined into one sheet."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.head_model import scalp
from hairkit.head_model.free_points import take_free
from hairkit.head_model.scalp import bind, evaluate, growth_mesh, sample_roots
from hairkit.head_model.template import default_head
from hairkit.types.head import Head


def _scalp_area(head: Head) -> float:
    corners = head.vertices.astype(np.float64)[head.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    chosen = head.scalp[head.faces].mean(axis=1) > 0.5
    return float(0.5 * np.linalg.norm(normal, axis=1)[chosen].sum())


def _turned_over(head: Head) -> Head:
    """Return the head with its faces in another order, so that it is not the template's mesh."""
    return replace(head, faces=head.faces[::-1])


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


def test_fewer_roots_are_the_beginning_of_more() -> None:
    """The first 300 of 2,000 roots are those of 300, and the other 1,700 follow them."""
    head = default_head()
    every, few = sample_roots(head, 2000), sample_roots(head, 300)
    rest = sample_roots(head, 1700, first=300)
    np.testing.assert_array_equal(every.triangle, np.concatenate([few.triangle, rest.triangle]))
    np.testing.assert_array_equal(every.positions, np.concatenate([few.positions, rest.positions]))


@pytest.mark.parametrize("own", [False, True])
def test_a_shape_that_differs_slightly_has_the_same_roots(own: bool) -> None:
    """Heads fitted 0.02 mm apart carry all roots at the same places, the template and others."""
    rest = _turned_over(default_head()) if own else default_head()
    rng = np.random.default_rng(0)
    fitted = replace(rest, vertices=1.04 * rest.vertices + rng.normal(0, 1e-3, rest.vertices.shape))
    again = replace(fitted, vertices=fitted.vertices + rng.normal(0, 2e-5, rest.vertices.shape))
    first, second = (
        sample_roots(head, 2000, rest=rest if own else None) for head in (fitted, again)
    )
    np.testing.assert_array_equal(first.triangle, second.triangle)
    np.testing.assert_array_equal(first.barycentric, second.barycentric)
    assert np.linalg.norm(first.positions - second.positions, axis=1).max() < 2e-4


def test_rounding_of_the_rest_shape_moves_no_root() -> None:
    """Vertices of the rest shape that were rounded the other way leave all roots in place."""
    head = _turned_over(default_head())
    vertices = head.vertices.copy()
    vertices[::1000] = np.nextafter(vertices[::1000], np.float32(1))
    first, second = sample_roots(head, 2000), sample_roots(replace(head, vertices=vertices), 2000)
    np.testing.assert_array_equal(first.triangle, second.triangle)
    np.testing.assert_array_equal(first.barycentric, second.barycentric)


def test_the_sequence_is_the_same_on_every_machine() -> None:
    """The first roots of seed 0 lie on known faces, whatever libraries compute them."""
    first = sample_roots(default_head(), 6).triangle
    np.testing.assert_array_equal(first, [14640, 302, 6464, 4162, 8102, 1648])


def test_a_thin_scalp_is_covered_in_one_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """How many roots of the sequence are kept is known before it is made: it is made once."""
    thin = replace(default_head(), density=np.full(len(default_head().vertices), 0.4, np.float32))
    asked, make = [], scalp._progressive_roots

    def note(head: Head, area: Float64Array, count: int, *rest: Any) -> Any:
        asked.append(count)
        return make(head, area, count, *rest)

    monkeypatch.setattr(scalp, "_progressive_roots", note)
    assert len(sample_roots(thin, 700)) == 700
    assert len(asked) == 1
    assert 700 / 0.4 < asked[0] < 1.1 * 700 / 0.4


def test_taking_free_points_equals_the_slow_rule() -> None:
    """It takes just those points that have none of the taken within the radius."""
    points = np.random.default_rng(3).random((400, 3))
    wanted: list[int] = []
    for radius in (0.3, 0.15):
        for i, point in enumerate(points):
            if i not in wanted and all(
                ((points[j] - point) ** 2).sum() >= radius**2 for j in wanted
            ):
                wanted.append(i)
    taken, apart, found = np.empty(400, np.int64), np.full(400, np.inf), 0
    for radius in (0.3, 0.15):
        found = take_free(points, apart, radius, taken, found)
    np.testing.assert_array_equal(taken[:found], wanted)


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
    for count, first in ((0, 0), (-3, 0), (10**9, 0), (1, -1), (1, 200_000)):
        with pytest.raises(InputError, match="expected 1 to"):
            sample_roots(head, count, first=first)
    with pytest.raises(InputError, match="at least 3 roots"):
        growth_mesh(sample_roots(head, 2), head)
