"""Laws of the wrap: roots on the other head, strands outside it, lengths, scalp and uv kept."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from foreign_heads import FOREIGN_HEADS, make_child_head

from hairkit.errors import HairkitError, InputError
from hairkit.grooming.wrap import wrap_groom
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.head_model.identity import blend_head
from hairkit.head_model.register_head import SURE, Surface, place_on
from hairkit.head_model.scalp import evaluate, roots_at
from hairkit.head_model.signed_distance import distance_to
from hairkit.head_model.template import default_head
from hairkit.io.head_reader import BareHead, read_bare_head
from hairkit.synth import grow
from hairkit.types.groom import Groom
from hairkit.types.tie import Tie

ROOTS_OFF, DEEPEST, LENGTH = 5e-4, 1e-3, 0.02
"""Metres from roots to surface, metres inside, share of the mean length."""
BINDING = 2e-6
"""Metres between a root and its face's point: float32 at 1.6 m."""


@cache
def groom() -> Groom:
    """Return a wavy groom with a tie on the default head."""
    tie = Tie(np.array([0, 0, -0.1]), np.array([0, 0, -1.0]), 0.02, "tail")
    return replace(grow("wavy", default_head(), 150, 0), ties=(tie,))


@cache
def wrapped(name: str) -> tuple[BareHead, Groom]:
    """Return a foreign head and the groom on it."""
    head = FOREIGN_HEADS[name]()
    return head, wrap_groom(groom(), head)


def _check(head: BareHead, before: Groom, after: Groom) -> None:
    off = nearest_on_surface(build_tree(head.vertices, head.faces), after.strands.roots)[2]
    assert off.max() < ROOTS_OFF
    assert distance_to(after.head, after.strands.points).min() > -DEEPEST
    assert abs(after.strands.lengths().mean() / before.strands.lengths().mean() - 1) < LENGTH


@pytest.mark.parametrize("name", FOREIGN_HEADS)
def test_roots_are_on_the_head_and_strands_outside_at_their_lengths(name: str) -> None:
    """Whatever its mesh, size and place; each strand keeps its length and its points."""
    head, after = wrapped(name)
    _check(head, groom(), after)
    np.testing.assert_array_equal(after.strands.offsets, groom().strands.offsets)
    np.testing.assert_allclose(after.strands.lengths(), groom().strands.lengths(), rtol=1e-4)
    bound = evaluate(after.head, after.root_triangle, after.root_barycentric)
    np.testing.assert_allclose(bound, after.strands.roots, atol=BINDING)


def test_slick_hair_stays_outside() -> None:
    """Strands that lie on the skin from root to tip slide along the other head."""
    loose, head = groom().strands, default_head()
    above = np.flatnonzero(loose.points[loose.offsets[1:] - 1, 2] < 0)[:60]
    some = loose.select(above).resampled(40)
    tree = build_tree(head.vertices, head.faces)
    face, weights, _ = nearest_on_surface(tree, some.points)
    skin = roots_at(head, face, weights)
    slick = replace(some, points=skin.positions + np.float32(3e-4) * skin.normals)
    bound = groom().root_triangle[above], groom().root_barycentric[above]
    flat = Groom(slick, head, *bound)
    other = FOREIGN_HEADS["coarse"]()
    _check(other, flat, wrap_groom(flat, other))


@pytest.mark.parametrize("name", FOREIGN_HEADS)
def test_the_mesh_stays_and_the_scalp_comes_along(name: str) -> None:
    """Vertices stay where the file has them; the unmarked scalp is the groom's, under all roots."""
    head, after = wrapped(name)
    np.testing.assert_allclose(after.head.vertices, head.vertices, atol=1e-6)
    assert (after.head.scalp[after.head.faces[after.root_triangle]] > 0.5).all()
    scalp = after.head.vertices[after.head.scalp > 0.5]
    low, high = head.vertices.min(axis=0), head.vertices.max(axis=0)
    assert scalp[:, 1].max() > high[1] - 0.01
    assert scalp[:, 1].min() > high[1] - 0.25
    assert (scalp[:, 2] < high[2] - 0.02).all(), "the face is no scalp"
    assert low[1] < scalp[:, 1].min()


def test_a_head_of_the_same_mesh_shows_that_roots_find_their_places() -> None:
    """Roots come within a few millimetres of where the child's own scalp has them."""
    head, after = wrapped("child")
    there = np.einsum(
        "nk,nkd->nd",
        groom().root_barycentric,
        head.vertices[groom().head.faces[groom().root_triangle]],
    )
    apart = np.linalg.norm(after.strands.roots - there, axis=1)
    assert apart.mean() < 0.004
    assert apart.max() < 0.012


def test_the_skeleton_and_the_ties_come_along() -> None:
    """Joints, capsules and ties move to where they are on the other head."""
    _, after = wrapped("child")
    wanted = blend_head({"child": 1.0}).joints + np.array([0, 1.1, 0.02])
    assert np.abs(after.head.joints[2] - wanted[2]).max() < 0.012
    assert np.abs(after.ties[0].centre - [0, 1.1, -0.07]).max() < 0.025
    assert after.ties[0].axis[2] < -0.95
    assert after.head.capsules.radius[0, 0] < groom().head.capsules.radius[0, 0]


def test_a_body_does_not_count() -> None:
    """A head on a whole body is found as near as heads alone are, and at its size."""
    body = FOREIGN_HEADS["body"]()
    found = place_on(default_head(), Surface(body.vertices, body.faces))
    assert found.distance < SURE
    assert 0.9 < found.similarity.scale < 1.1


def test_root_uv_are_those_of_the_other_head() -> None:
    """Its texture coordinates at the roots."""
    head, one = wrapped("child")
    assert head.uv is not None
    corners = head.uv[one.head.faces[one.root_triangle]]
    mixed = np.einsum("nk,nkd->nd", one.root_barycentric, corners)
    np.testing.assert_allclose(one.strands.root_uv, mixed, atol=1e-5)


def test_the_own_head_gives_the_groom_back() -> None:
    """A wrap onto the head that the groom stands on moves nothing by more than a millimetre.

    The roots' texture coordinates are the old ones on demand.
    """
    back = wrap_groom(groom(), BareHead.of(default_head()), keep_root_uv=True)
    apart = np.linalg.norm(back.strands.points - groom().strands.points, axis=1)
    assert apart.mean() < 5e-4
    np.testing.assert_array_equal(back.head.scalp, default_head().scalp)
    np.testing.assert_array_equal(back.strands.root_uv, groom().strands.root_uv)


@pytest.mark.parametrize(
    ("turn", "said"),
    [
        (((1, 0, 0), (0, 0, -1), (0, 1, 0)), "up: z"),
        (((100, 0, 0), (0, 100, 0), (0, 0, 100)), "give its unit"),
    ],
)
def test_heads_in_other_axes_or_units_are_refused(
    turn: tuple[tuple[float, ...], ...], said: str
) -> None:
    """One line says what is wrong, since the hair would grow from the face."""
    head = make_child_head()
    with pytest.raises(InputError, match=said):
        wrap_groom(groom(), replace(head, vertices=head.vertices @ np.array(turn, float).T))


def test_heads_among_the_reference_files_are_wrapped_or_refused() -> None:
    """Every .obj, .ply and .glb of `HAIRKIT_REFERENCE_FILES`."""
    folder = os.environ.get("HAIRKIT_REFERENCE_FILES")
    if not folder:
        pytest.skip("HAIRKIT_REFERENCE_FILES names no folder of real files")
    files = [p for p in Path(folder).rglob("*") if p.suffix.lower() in (".obj", ".ply", ".glb")]
    for file in files:
        try:
            head = read_bare_head(file)
            after = wrap_groom(groom(), head)
        except HairkitError:
            continue
        _check(head, groom(), after)
