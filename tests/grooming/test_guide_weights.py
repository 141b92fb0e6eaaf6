"""Laws of hair that follows guides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rich_groom import rich_groom

from hairkit.errors import InputError
from hairkit.grooming.guide_weights import CLOSEST, closest_guides, follow, guide_mask
from hairkit.types.strands import Strands


def test_weights_share_out_one() -> None:
    """Weights are not negative, sum to one, and name guides only."""
    strands = rich_groom().strands
    mix, guide = closest_guides(strands), guide_mask(strands)
    assert mix.guides.shape == mix.weights.shape == (len(strands), CLOSEST)
    assert guide[mix.guides].all()
    assert (mix.weights >= 0).all()
    assert np.allclose(mix.weights.sum(axis=1), 1, atol=1e-6)


def test_guides_follow_themselves() -> None:
    """A guide is its own nearest, alone, even where two share a root."""
    strands = rich_groom().strands
    points = strands.points.copy()
    points[strands.offsets[2]] = points[0]
    strands = replace(strands, points=points)
    mix, own = closest_guides(strands), np.flatnonzero(guide_mask(strands))
    assert np.array_equal(mix.guides[own, 0], own)
    assert np.array_equal(mix.weights[own], np.tile([1, 0, 0], (len(own), 1)))


def test_the_first_guide_is_the_nearest() -> None:
    """No guide's root is nearer than that of the first; weights fall with distance."""
    strands = rich_groom().strands
    mix, guides = closest_guides(strands), np.flatnonzero(guide_mask(strands))
    away = np.linalg.norm(strands.roots[:, None] - strands.roots[guides], axis=2)
    first = np.linalg.norm(strands.roots - strands.roots[mix.guides[:, 0]], axis=1)
    assert np.allclose(first, away.min(axis=1), atol=1e-7)
    assert (np.diff(mix.weights, axis=1) <= 1e-6).all()


@pytest.mark.parametrize("count", [1, 2])
def test_few_guides_are_enough(count: int) -> None:
    """With fewer than three guides the rest of the list repeats, without weight."""
    strands = rich_groom().strands
    mix = closest_guides(replace(strands, guide=np.arange(len(strands)) < count))
    assert (mix.guides < count).all()
    assert np.allclose(mix.weights.sum(axis=1), 1, atol=1e-6)


def test_no_guides_are_refused() -> None:
    """Hair alone has nothing to follow."""
    strands = rich_groom().strands
    with pytest.raises(InputError, match="no guides"):
        closest_guides(replace(strands, guide=np.zeros(len(strands), bool)))


def moved(strands: Strands, matrix: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Return all strands after their guides moved as one body, one frame."""
    rows = guide_mask(strands)[strands.strand_of_point]
    frames = (strands.points[rows] @ matrix.T + shift)[None].astype(np.float32)
    return follow(strands, frames)


def test_hair_rests_where_guides_rest() -> None:
    """Guides that do not move leave hair where it is; guides that shift take it along."""
    strands = rich_groom().strands
    assert np.allclose(moved(strands, np.eye(3), np.zeros(3))[0], strands.points, atol=1e-7)
    shift = np.array([0.1, -0.2, 0.3])
    assert np.allclose(moved(strands, np.eye(3), shift)[0], strands.points + shift, atol=1e-6)


def test_guides_take_their_own_points() -> None:
    """A guide's points are those of the cache, whatever they are."""
    strands = rich_groom().strands
    rows = guide_mask(strands)[strands.strand_of_point]
    turn = np.diag([1.0, -1.0, -1.0])
    frames = moved(strands, turn, np.zeros(3))
    assert np.allclose(frames[0][rows], strands.points[rows] @ turn.T, atol=1e-7)


def test_a_cache_of_another_groom_is_refused() -> None:
    """The number of points must be that of the guides."""
    strands = rich_groom().strands
    with pytest.raises(InputError, match="the guides have"):
        follow(strands, np.zeros((1, 3, 3), np.float32))


def test_hair_stays_on_a_head_that_turns() -> None:
    """Where head and guides move as one body, the hair between them moves with them."""
    strands = rich_groom().strands
    rows = guide_mask(strands)[strands.strand_of_point]
    motion = np.eye(4)
    motion[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    motion[:3, 3] = 0.1, -0.2, 0.3
    wanted = strands.points @ motion[:3, :3].T + motion[:3, 3]
    frames = wanted[rows][None].astype(np.float32)
    assert np.allclose(follow(strands, frames, motion[None])[0], wanted, atol=1e-6)


def test_short_hair_goes_with_the_near_part_of_long_guides() -> None:
    """Beside guides of 30 cm that turn about their roots, hair of 3 cm moves as theirs does there:
    its tip does not go where their tips go."""
    along = np.linspace(0, 1, 11, dtype=np.float32)[:, None]
    guides = [np.float32([x, 0, 0]) + 0.3 * along * np.float32([0, -1, 0]) for x in (-0.01, 0.01)]
    short = 0.03 * along * np.float32([0, -1, 0])
    points = np.concatenate([*guides, short])
    strands = Strands(points, np.array([0, 11, 22, 33]), guide=np.array([True, True, False]))
    raised = points[:22].copy()
    raised[:, 1] *= -1
    found = follow(strands, raised[None])[0][22:]
    assert np.allclose(found, -short, atol=1e-6)
