"""Laws of the families in which a crown is combed, drawn exactly on a ball of hair."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import Float64Array
from hairkit.field.crown_family import choose_family
from hairkit.field.parting import comb_from_parting, crown_share, front_share
from hairkit.field.scalp_sight import see_scalp
from hairkit.types.parting import Parting
from tests.support import tied_ball as ball

BARE, COVERED = 0.0, -0.05
"""Heights below which the ball is skin, metres: its scalp's edge, and the chin of a fringe."""


def outward(points: Float64Array) -> Float64Array:
    """Return the ball's normals (N, 3)."""
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


def find(combed: Parting, bare: float, skin: Parting | None = None) -> Parting:
    """Return the family that the views of a ball show that is combed in a way."""

    def comb(points: Float64Array) -> Float64Array:
        return comb_from_parting(combed, ball.HEAD, points, outward(points))

    cameras = ball.cameras()
    masks, maps = zip(*(ball.drawn(camera, comb, bare) for camera in cameras), strict=True)
    sight = see_scalp(masks, maps, cameras, ball.HEAD)
    return choose_family(skin or Parting(), sight, masks, cameras, ball.HEAD)


@pytest.mark.parametrize("x", [-0.02, 0.0, 0.03])
def test_directions_tell_a_parting_without_skin(x: float) -> None:
    """The line's place is the one whose comb agrees best; nothing is combed forward or back."""
    found = find(Parting.at(x), BARE)
    assert found.x == pytest.approx(x, abs=0.01)
    assert not found.fringe
    assert not found.swept_back
    assert found.sureness > 0.8


def test_hair_that_crosses_the_hairline_is_combed_back_where_the_forehead_is_bare() -> None:
    """Even where the bare hairline looks like the skin of a parting."""
    found = find(Parting(swept_back=True), BARE, skin=Parting.at(0.0))
    assert found.swept_back
    assert found.line is None


def test_hair_that_crosses_the_hairline_is_a_fringe_where_the_forehead_is_covered() -> None:
    """The parting behind the fringe is found as without it."""
    found = find(Parting(np.array([[0.0, 0.09], [0.0, -0.06]]), fringe=True), COVERED)
    assert found.fringe
    assert found.x == pytest.approx(0.0, abs=0.01)


def test_a_whorl_is_found_where_hair_runs_away_from_it() -> None:
    """To the spacing of the places that are compared."""
    found = find(Parting(whorl=np.array([0.01, -0.04])), BARE)
    assert found.line is None
    np.testing.assert_allclose(found.whorl, [0.01, -0.04], atol=0.015)


def test_directions_that_agree_with_no_family_leave_the_crown_as_it_was() -> None:
    """Hair that runs around the head is neither parted nor combed back nor a whorl."""
    skin = Parting(skin_share=0.001)
    cameras = ball.cameras()

    def around(points: Float64Array) -> Float64Array:
        side = np.cross(outward(points), [0.0, 1.0, 0.0])
        return np.asarray(side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9))

    masks, maps = zip(*(ball.drawn(camera, around, BARE) for camera in cameras), strict=True)
    sight = see_scalp(masks, maps, cameras, ball.HEAD)
    found = choose_family(skin, sight, masks, cameras, ball.HEAD)
    assert not found.known
    assert found.skin_share == skin.skin_share


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
