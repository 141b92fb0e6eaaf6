"""Laws of the brushes that add and remove guides, over random strokes on a ball."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit import Brush, Edit, Edits, Groom, Head, Strands
from hairkit.grooming.brushed_hair import CLEARANCE, HeadRoom
from hairkit.grooming.brushes import edit_groom
from hairkit.grooming.densify import roots_between
from hairkit.head_model.scalp import bind, evaluate
from hairkit.head_model.signed_distance import distance_to
from hairkit.storage import to_arrays
from hairkit.testing import ball_head, bristle_groom

GROOM = bristle_groom()
EVERYWHERE = np.zeros((0, 3))


@st.composite
def paths(draw: st.DrawFn) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """A path near the upper half of the ball, whose radius is 10 cm."""
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    ways = generator.normal(size=(draw(st.integers(1, 5)), 3)) * [0.4, 0.1, 0.4] + [0, 1, 0]
    away = draw(st.floats(0.1, 0.14))
    return np.asarray(away * ways / np.linalg.norm(ways, axis=1, keepdims=True))


RADII, AMOUNTS = st.floats(0.015, 0.06), st.floats(0.1, 1.0)


def edited(groom: Groom, *edits: Edit) -> Groom:
    """Return a groom after strokes."""
    return edit_groom(groom, Edits(edits))


def reached(path: np.ndarray[tuple[int, int], np.dtype[np.float64]], groom: Groom) -> float:
    """Return the largest distance of a groom's new roots from a path on the skin, metres."""
    on_skin = HeadRoom.around(GROOM.head).on_skin(dense(path))
    new = groom.strands.roots[len(GROOM.strands) :]
    return float(np.linalg.norm(new[:, None] - on_skin, axis=2).min(axis=1).max())


def dense(
    path: np.ndarray[tuple[int, int], np.dtype[np.float64]],
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return a path of at least 500 places."""
    at = np.linspace(0, len(path) - 1, 500)
    return np.stack([np.interp(at, np.arange(len(path)), axis) for axis in path.T], axis=1)


@settings(max_examples=30, deadline=None)
@given(paths(), RADII, AMOUNTS)
def test_added_guides_grow_on_the_scalp_among_the_others(
    path: np.ndarray[tuple[int, int], np.dtype[np.float64]], radius: float, amount: float
) -> None:
    """All guides stay to the last bit, new ones are bound to the scalp below the brush, lie as
    those around them and not in the head; the same stroke gives the same guides."""
    edit, before = Edit(path, Brush("add", radius, amount)), len(GROOM.strands)
    made = edited(GROOM, edit)
    strands, count = made.strands, len(made.strands)
    assert count > before
    np.testing.assert_array_equal(strands.points[: len(GROOM.strands.points)], GROOM.strands.points)
    roots = evaluate(made.head, made.root_triangle, made.root_barycentric)
    np.testing.assert_allclose(strands.roots, roots, atol=1e-6)
    assert (roots[before:, 1] > -0.01).all()
    assert reached(path, made) < radius + 0.002
    ways = strands.tips[before:] - strands.roots[before:]
    along = (ways * roots[before:]).sum(axis=1) / np.linalg.norm(roots[before:], axis=1)
    assert (along > 0.026).all()  # of bristles of 3 cm along the normals
    np.testing.assert_allclose(strands.lengths()[before:], 0.03, rtol=0.02)
    free = np.delete(strands.points, strands.offsets[:-1], axis=0)
    assert distance_to(made.head, free).min() > -CLEARANCE / 2
    again = to_arrays(edited(GROOM, edit))
    for name, array in to_arrays(made).items():
        np.testing.assert_array_equal(array, again[name], name)


@settings(max_examples=30, deadline=None)
@given(paths(), RADII, AMOUNTS, AMOUNTS)
def test_more_thinning_removes_the_same_guides_and_others(
    path: np.ndarray[tuple[int, int], np.dtype[np.float64]], radius: float, one: float, two: float
) -> None:
    """What is left keeps its order and every bit; what a stroke leaves, a weaker one leaves, too.
    Guides whose roots the brush does not reach stay, and the density falls below it alone."""
    less, more = (
        edited(GROOM, Edit(path, Brush("thin", radius, amount)))
        for amount in (min(one, two), max(one, two))
    )
    left = [{row.tobytes() for row in each.strands.roots} for each in (GROOM, less, more)]
    assert left[2] <= left[1] <= left[0]
    kept = [row.tobytes() in left[2] for row in GROOM.strands.roots]
    np.testing.assert_array_equal(more.strands.points, GROOM.strands.select(kept).points)
    on_skin = HeadRoom.around(GROOM.head).on_skin(dense(path))
    far = np.linalg.norm(GROOM.strands.roots[:, None] - on_skin, axis=2).min(axis=1) > radius
    assert np.asarray(kept)[far].all()
    away = np.linalg.norm(GROOM.head.vertices[:, None] - on_skin, axis=2).min(axis=1)
    assert more.head.density is not None
    assert (more.head.density[away > radius] == 1).all()
    assert (more.head.density[away < 0.3 * radius] < 1).all()


@pytest.mark.parametrize(("brush", "share"), [("thin", 0.5), ("add", 1.5)])
def test_the_amount_is_a_share_of_all_guides(brush: str, share: float) -> None:
    """Half as much everywhere takes half of the guides away, or adds half as many, evenly."""
    count = len(GROOM.strands)
    made = edited(GROOM, Edit(EVERYWHERE, Brush(brush, amount=0.5)))
    assert len(made.strands) == pytest.approx(share * count, abs=0.03 * count)
    front = made.strands.roots[:, 2] > 0
    assert 0.4 < front.mean() < 0.6


def test_a_bald_place_grows_hair_again_and_a_head_keeps_some() -> None:
    """Guides are added where all were removed; no stroke removes the last hair of a head."""
    ball = np.array([[0, 0.1, 0.0]])
    bare = edited(GROOM, *6 * [Edit(ball, Brush("thin", 0.05, 1.0))])
    near = np.linalg.norm(bare.strands.roots - ball, axis=1) < 0.02
    assert not near.any()
    full = edited(bare, Edit(ball, Brush("add", 0.05, 1.0)))
    assert (np.linalg.norm(full.strands.roots - ball, axis=1) < 0.02).sum() >= 3
    assert full.head.density is not None
    assert full.head.density.min() > bare.head.density.min()  # type: ignore[union-attr]
    assert len(edited(GROOM, Edit(EVERYWHERE, Brush("thin", amount=1.0))).strands)


def test_full_hair_is_as_dense_as_it_was_painted() -> None:
    """Of full hair a half-thinned place has half as many roots, one nearly bald nearly none."""
    ball = np.array([[0, 0.1, 0.0]])
    for times, amount, low, high in ((1, 0.5, 0.35, 0.65), (3, 0.9, 0.0, 0.05)):
        thin = edited(GROOM, *times * [Edit(ball, Brush("thin", 0.06, amount))])
        near = [
            np.mean(np.linalg.norm(roots_between(each, 4000).positions - ball, axis=1) < 0.015)
            for each in (GROOM, thin)
        ]
        assert low <= near[1] / near[0] <= high


@settings(max_examples=15, deadline=None)
@given(paths(), RADII, st.sampled_from(["add", "thin"]), st.sampled_from(["hair", "beard"]))
def test_density_is_mirrored(
    path: np.ndarray[tuple[int, int], np.dtype[np.float64]], radius: float, brush: str, group: str
) -> None:
    """What a stroke does its mirror image does on the mirrored head; `mirror` does both."""
    groom, edit = bristles(1.0), Edit(path, Brush(brush, radius, 0.7, group=group))
    other = Edit(path * [-1, 1, 1], edit.setting)
    expected = edited(groom, edit).strands.points * [-1, 1, 1]
    found = edited(bristles(-1.0), other).strands.points
    np.testing.assert_allclose(found, expected, atol=5e-3)  # cells of distances are not mirrored
    gaps = np.abs(found - expected).max(axis=1)
    assert np.mean(gaps < 1e-3) > 0.95  # a root between two places of a path may follow either
    both = edited(groom, Edit(path, replace(edit.setting, mirror=True)))
    each = [{*map(bytes, edited(groom, one).strands.roots)} for one in (edit, other)]
    wanted = each[0] | each[1] if brush == "add" else each[0] & each[1]
    assert {*map(bytes, both.strands.roots)} == wanted


def bristles(side: float) -> Groom:
    """Return bristles at random on a ball whose mesh is symmetric, or for -1 their mirror image."""
    head, ways = mirror_head(), np.random.default_rng(2).normal([0, 0.8, 0], size=(120, 3))
    ways *= [side, 1, 1] / np.linalg.norm(ways, axis=1, keepdims=True)
    triangle, weights = bind(0.1 * ways, head)
    roots = evaluate(head, triangle, weights)
    points = roots[:, None] + np.linspace(0, 0.03, 8)[:, None] * ways[:, None]
    return Groom(Strands.from_list([*points]), head, triangle, weights)


def mirror_head() -> Head:
    """Return the ball as a mesh that is its own mirror image."""
    mesh, ball = trimesh.creation.icosphere(subdivisions=3, radius=0.1), ball_head()
    vertices = np.asarray(mesh.vertices, np.float32)
    return replace(
        ball,
        vertices=vertices,
        faces=np.asarray(mesh.faces, np.int32),
        uv=(0.5 + 5 * vertices[:, [0, 2]]).astype(np.float32),
        scalp=(vertices[:, 1] > 0).astype(np.float32),
    )


def test_without_hair_nothing_is_added(caplog: pytest.LogCaptureFixture) -> None:
    """Guides cannot be mixed from none; a line says so."""
    beard = edited(GROOM, Edit(np.array([[0, -0.1, 0.02]]), Brush("add", 0.03, group="beard")))
    planted = beard.strands.planted
    alone = Groom(
        beard.strands.select(planted),
        beard.head,
        beard.root_triangle[planted],
        beard.root_barycentric[planted],
    )
    same = edited(alone, Edit(EVERYWHERE, Brush("add")))
    np.testing.assert_array_equal(same.strands.points, alone.strands.points)
    assert "stroke 1 (add) reaches no hair" in caplog.text
