"""Laws of the comb that views see on the crown, drawn exactly on a ball of hair."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from hairkit.arrays import Float32Array, Float64Array
from hairkit.field.parting import comb_from_parting, crown_share, front_share
from hairkit.field.scalp_comb import Front, comb_beside_parting, comb_scalp, fringe_share, see_front
from hairkit.field.scalp_sight import see_scalp
from hairkit.types.parting import Parting
from tests.support import tied_ball as ball

BARE, COVERED = 0.0, -0.05
"""Heights below which the ball is skin, metres: its scalp's edge, and the chin of a fringe."""

UNSEEN = 0.094
"""Height on the ball above which level views see it at too grazing an angle, metres."""
WHORL = np.array([0.0, 0.0866, -0.05])
"""A place on the ball behind its top, metres."""


def outward(points: Float64Array) -> Float64Array:
    """Return the ball's normals (N, 3)."""
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


def rising(along: Float64Array) -> Float32Array:
    """Return a growth potential (X, Y, Z) that rises along a vector (3,)."""
    return (ball.GRID.centres() @ along).astype(np.float32)


def across(points: Float64Array) -> Float64Array:
    """Return unit tangents (N, 3) of hair combed over the head from its left to its right."""
    side = np.cross(outward(points), [0.0, 0.0, -1.0])
    return np.asarray(side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9))


def from_whorl(points: Float64Array) -> Float64Array:
    """Return unit tangents (N, 3) of hair that runs away from a place behind the middle."""
    way = points - WHORL
    way -= (way * outward(points)).sum(axis=1, keepdims=True) * outward(points)
    return np.asarray(way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9))


def find(
    comb: Callable[[Float64Array], Float64Array],
    bare: float = BARE,
    skin: Parting | None = None,
    growth: Float32Array | None = None,
) -> Parting:
    """Return how the views of a ball show its crown that is combed in a way."""
    cameras = ball.cameras()
    masks, maps = zip(*(ball.drawn(camera, comb, bare) for camera in cameras), strict=True)
    sight = see_scalp(masks, maps, cameras, ball.HEAD)
    potential = rising(np.array([0.0, -1.0, 0.0])) if growth is None else growth
    front = see_front(sight, masks, cameras, ball.HEAD)
    if skin is not None and skin.seen:
        return comb_beside_parting(skin, front)
    hull = ball.tied_hull(curtain=True)
    return comb_scalp(skin or Parting(), front, sight, ball.HEAD, hull, potential)


def combed(parting: Parting) -> Callable[[Float64Array], Float64Array]:
    """Return the comb of a parting on the ball."""
    return lambda points: comb_from_parting(parting, ball.HEAD, points, outward(points))


def crown(below: float = 0.04) -> Float64Array:
    """Return points (N, 3) on the scalp at most so far below its top."""
    points = ball.HEAD.vertices[ball.HEAD.scalp > 0.5].astype(np.float64)
    return np.asarray(points[points[:, 1] > ball.BALL - below])


def test_hair_combed_over_the_head_is_found_with_its_sign() -> None:
    """It rises on one side and falls on the other; only the way to the tips tells which."""
    points = crown()
    for sign in (1.0, -1.0):
        found = find(across, growth=rising(np.array([-sign, 0.0, 0.0])))
        assert found.places is not None
        assert found.sureness > 0.9
        seen = comb_from_parting(found, ball.HEAD, points, outward(points))
        np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 1, atol=1e-9)
        agreement = sign * (seen * across(points)).sum(axis=1)
        assert np.mean(agreement > np.cos(np.radians(15))) > 0.95


def test_hair_that_runs_from_a_whorl_is_found() -> None:
    """Away from it on all sides, below the cap on top that level views do not see."""
    points = crown(0.06)
    points = points[points[:, 1] < UNSEEN]
    far = np.linalg.norm(points - WHORL, axis=1) > 0.03
    away = np.linalg.norm(ball.GRID.centres() - WHORL, axis=-1).astype(np.float32)
    found = find(from_whorl, COVERED, growth=away)
    seen = comb_from_parting(found, ball.HEAD, points, outward(points))
    agreement = (seen * from_whorl(points)).sum(axis=1)[far]
    assert np.mean(agreement > np.cos(np.radians(25))) > 0.9


def test_a_small_fault_of_the_potential_does_not_count() -> None:
    """In a patch 4 cm wide the potential points the other way; the comb does not."""
    centres = ball.GRID.centres()
    patch = np.linalg.norm(centres - np.array([0.0, 0.1, 0.0]), axis=-1) < 0.02
    growth = rising(np.array([-1.0, 0.0, 0.0]))
    growth[patch] *= -1
    points = crown(0.02)
    seen = comb_from_parting(find(across, growth=growth), ball.HEAD, points, outward(points))
    assert ((seen * across(points)).sum(axis=1) > 0).all()


def test_neighbours_outvote_a_noisy_potential() -> None:
    """The potential alone turns more than 6 % of the directions round; after the vote none is."""
    noise = ndimage.gaussian_filter(np.random.default_rng(2).normal(size=ball.GRID.shape), 4)
    slope = rising(np.array([-1.0, 0.0, 0.0]))
    found = find(across, growth=slope + (0.02 / noise.std() * noise).astype(np.float32))
    assert found.places is not None
    assert found.directions is not None
    assert ((found.directions * across(found.places)).sum(axis=1) > 0).all()


def test_places_that_no_view_sees_follow_the_potential() -> None:
    """Directions are seen on the left half alone; the rest is combed along the potential."""
    cameras, points = ball.cameras(), crown(0.06)
    masks, maps = zip(*(ball.drawn(camera, across, BARE) for camera in cameras), strict=True)
    sight = see_scalp(masks, maps, cameras, ball.HEAD)
    half = sight.at(sight.places[:, 0] > 0.06)
    hull, back = ball.tied_hull(curtain=True), rising(np.array([0.0, 0.0, -1.0]))
    found = comb_scalp(Parting(), Front(0.0, 0.0), half, ball.HEAD, hull, back)
    right = points[points[:, 0] < -0.03]
    seen = comb_from_parting(found, ball.HEAD, right, outward(right))
    assert (seen[:, 2] < -0.5).mean() > 0.9


def test_a_head_without_scalp_on_its_crown_says_nothing() -> None:
    """There is no place to comb."""
    height = ball.HEAD.vertices[:, 1]
    low = ((height < 0) & (height > -0.03)).astype(np.float32)
    bald = replace(ball.HEAD, scalp=low)
    cameras = ball.cameras()
    masks, maps = zip(*(ball.drawn(camera, across, BARE) for camera in cameras), strict=True)
    sight = see_scalp(masks, maps, cameras, ball.HEAD)
    hull, growth = ball.tied_hull(curtain=True), rising(np.array([0.0, -1.0, 0.0]))
    skin = Parting()
    assert comb_scalp(skin, Front(0.0, 0.0), sight, bald, hull, growth) is skin


def test_directions_that_do_not_agree_leave_the_crown_as_it_was() -> None:
    """Orientation at random, as on tight curls, says nothing."""
    skin = Parting(skin_share=0.001)
    random = np.random.default_rng(0)

    def anywhere(points: Float64Array) -> Float64Array:
        way = random.normal(size=points.shape)
        way -= (way * outward(points)).sum(axis=1, keepdims=True) * outward(points)
        return np.asarray(way / np.linalg.norm(way, axis=1, keepdims=True))

    found = find(anywhere, skin=skin)
    assert not found.known
    assert found.skin_share == skin.skin_share


@pytest.mark.parametrize("x", [-0.02, 0.0, 0.03])
def test_skin_tells_a_parting_before_directions_do(x: float) -> None:
    """The line that skin shows is kept."""
    skin = Parting.at(x, 0.02)
    assert find(combed(skin), skin=skin) is skin


def test_hair_that_crosses_the_hairline_is_combed_back_where_the_forehead_is_bare() -> None:
    """Even where the bare hairline looks like the skin of a parting."""
    found = find(combed(Parting(swept_back=True)), skin=Parting.at(0.0))
    assert found.swept_back
    assert found.line is None


@pytest.mark.parametrize(("from_x", "forward"), [(1.0, -1.0), (0.015, 0.0), (-1.0, 1.0)])
def test_hair_over_a_part_of_the_forehead_is_combed_to_the_side(
    from_x: float, forward: float
) -> None:
    """Neither back, which bares the whole forehead, nor forward, which hides it."""
    camera = ball.cameras()[0]
    bare, _ = ball.drawn(camera, across, BARE)
    hidden, found = ball.drawn(camera, combed(Parting(swept_back=True)), COVERED)
    edge = camera.project(np.array([from_x, 0.0, 0.1]))[0]
    beside = np.arange(camera.width) > edge
    masks = (replace(bare, labels=np.where(beside, hidden.labels, bare.labels)),)
    sight = see_scalp(masks, (found,), (camera,), ball.HEAD)
    front = see_front(sight, masks, (camera,), ball.HEAD)
    assert front.forward == forward
    assert (front.sureness > 0) == (forward != 0)


@pytest.mark.parametrize("skin", [Parting.at(0.0), Parting()])
def test_hair_that_crosses_the_hairline_is_a_fringe_where_the_forehead_is_covered(
    skin: Parting,
) -> None:
    """With a parting behind it or not, hair in front runs forward, whatever the potential says."""
    drawn = combed(Parting(Parting.at(0.0).line, fringe=True))
    found = find(drawn, COVERED, skin, rising(np.array([0.0, 0.0, -1.0])))
    assert found.fringe
    assert found.x == skin.x
    points = crown(0.1)
    front = points[front_share(ball.HEAD, points) == 1]
    assert (comb_from_parting(found, ball.HEAD, front, outward(front))[:, 2] > 0).all()


def test_a_fringe_runs_forward_over_the_forehead() -> None:
    """In front all tangents point forward and down; behind, hair is combed as without a fringe."""
    points = ball.HEAD.vertices[ball.HEAD.scalp > 0.5].astype(np.float64)
    parted, fringed = (
        comb_from_parting(parting, ball.HEAD, points, outward(points))
        for parting in (Parting.at(0.0), Parting(Parting.at(0.0).line, fringe=True))
    )
    share = front_share(ball.HEAD, points)
    assert (fringed[share == 1] @ [0.0, -0.5, 1.0] > 0.3).all()
    np.testing.assert_allclose(fringed[share == 0], parted[share == 0])
    counted = crown_share(Parting(fringe=True), ball.HEAD, points)
    assert (counted >= share).all()


@pytest.mark.parametrize(("bare", "share"), [(BARE, 0.0), (COVERED, 1.0)])
def test_hair_on_the_forehead_is_a_fringe_of_any_length(bare: float, share: float) -> None:
    """Whatever its directions: short hair that covers the forehead lies on it."""
    camera = ball.cameras()[0]
    mask, _ = ball.drawn(camera, across, bare)
    assert fringe_share((mask,), (camera,), ball.HEAD) == pytest.approx(share, abs=0.3)
