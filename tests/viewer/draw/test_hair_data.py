"""Laws of hair that follows guides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands
from hairkit.viewer.draw.hair_data import (
    COUNTS,
    HairBody,
    choose_shares,
    split_guides,
)


def test_hair_lies_at_rest_where_it_was_made() -> None:
    """The mean of the guides' roots with the edges gives a hair of about the guides' length."""
    groom = bristle_groom()
    body = HairBody.of(groom, 500)
    roots = np.einsum("sk,skc->sc", body.weights, body.guide_rest[:, 0][body.followed])
    hair = roots[:, None] + np.cumsum(body.edges, axis=1)
    radius = np.linalg.norm(hair[:, 0], axis=1)
    assert (np.abs(radius - 0.1) < 0.004).all()  # the roots, on the ball of 10 cm
    length = np.linalg.norm(np.diff(hair, axis=1), axis=2).sum(axis=1)
    assert abs(np.median(length) - 0.03) < 0.003
    assert (np.abs(length - 0.03) < 0.016).all()  # ends are uneven, and some hairs stray


def test_the_guides_come_first_and_follow_themselves() -> None:
    """A guide's own hair is the guide."""
    groom = bristle_groom()
    body = HairBody.of(groom, 400)
    count = len(groom.strands)
    assert (body.followed[:count, 0] == np.arange(count)).all()
    assert (body.weights[:count, 0] == 1).all()
    assert not body.edges[:count, 0].any()
    np.testing.assert_allclose(body.edges[:count, 1:], np.diff(body.guide_rest, axis=1))
    assert len(body) == 400


def test_fewer_hairs_are_a_first_part_of_more_hairs_of_the_same_spread() -> None:
    """The hairs after the guides are in random order: a tenth of them covers the head like all."""
    groom = bristle_groom()
    body = HairBody.of(groom, 3000)
    course = np.einsum("sk,skc->sc", body.weights, body.guide_rest[body.followed][:, :, 0])
    roots = (course + body.edges[:, 0])[len(groom.strands) :]
    some = roots[: len(roots) // 10]
    np.testing.assert_allclose(some.mean(axis=0), roots.mean(axis=0), atol=0.03)
    np.testing.assert_allclose(some.std(axis=0), roots.std(axis=0), atol=0.03)


def test_sampled_guides_keep_roots_tips_and_widths() -> None:
    """Whatever the number of points, ends stay, and a point's width goes with its place."""
    bristles = bristle_groom().strands
    strands = replace(bristles, widths=bristles.arc_lengths().astype(np.float32))
    shares = np.linspace(0, 1, 9) ** 1.5
    sampled = strands.resampled_at(shares)
    assert (sampled.counts == 9).all()
    np.testing.assert_allclose(sampled.roots, strands.roots, atol=1e-7)
    np.testing.assert_allclose(sampled.tips, strands.tips, atol=1e-7)
    assert sampled.widths is not None
    wanted = shares * strands.lengths()[:, None]
    np.testing.assert_allclose(sampled.widths.reshape(-1, 9), wanted, atol=1e-6)


def test_straight_hair_needs_the_fewest_points_and_curls_more() -> None:
    """The number of points goes with the bends."""
    t = np.linspace(0, 1, 200)
    straight = Strands.from_list([np.stack([0 * t, -0.3 * t, 0 * t], axis=1)])
    angle = 2 * np.pi * 6 * t
    curl = np.stack([0.01 * np.cos(angle), -0.3 * t, 0.01 * np.sin(angle)], axis=1)
    assert len(choose_shares(straight)) == COUNTS[0]
    assert len(choose_shares(Strands.from_list([curl]))) > 4 * COUNTS[0]


def test_marked_guides_are_the_guides_and_the_rest_follows() -> None:
    """A groom with hair of its own is drawn with that hair."""
    groom = bristle_groom()
    strands = groom.strands
    guide = np.arange(len(strands)) % 5 == 0
    marked = Strands(strands.points, strands.offsets, guide=guide)
    whole = Groom(marked, groom.head, groom.root_triangle, groom.root_barycentric)
    alone, own = split_guides(whole)
    assert own is not None
    assert len(alone.strands) == guide.sum()
    assert len(own) == (~guide).sum()
    body = HairBody.of(alone, 10_000, own)
    assert len(body) == len(strands)


def test_many_unmarked_strands_give_some_guides() -> None:
    """A file of hair without guides is simulated by a part of it."""
    alone, own = split_guides(bristle_groom(), most=20)
    assert len(alone.strands) == 20
    assert own is not None
    assert len(own) + 20 == len(bristle_groom().strands)


def test_a_groom_without_strands_is_refused() -> None:
    """One line says what is missing."""
    groom = bristle_groom()
    nothing = groom.select(np.zeros(len(groom.strands), bool))
    with pytest.raises(InputError, match="0 guides"):
        HairBody.of(nothing, 10)
