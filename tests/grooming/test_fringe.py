"""Laws of loose hair beside tied hair."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.field.find_ties import find_fringe
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.grooming.fringe import hang_fringe
from hairkit.types.tie import LooseHair, TiedHair
from hairkit.types.volume import Hull
from tests.support import tied_ball as ball

LOW = float(ball.HEAD.vertices[ball.HEAD.scalp > 0.5, 1].min())
"""The hairline of the ball."""


@pytest.fixture(scope="module")
def fringed() -> Hull:
    """The tied ball with a curtain of hair over the face, from the hairline down to -9 cm."""
    hull = ball.tied_hull()
    x, y, z = np.moveaxis(ball.GRID.centres().astype(np.float64), -1, 0)
    curtain = (np.abs(x) < 0.03) & (y > -0.09) & (y < LOW + 0.02) & (z > 0)
    curtain &= (hull.head_distance > 0) & (hull.head_distance < 0.012)
    return Hull(hull.grid, hull.dense | curtain, hull.loose | curtain, hull.head_distance)


@pytest.fixture(scope="module")
def front(fringed: Hull) -> LooseHair:
    """The part of the loose hair that hangs over the face."""
    found = find_fringe(ball.HEAD, fringed, measure_scalp_distance(ball.HEAD, fringed), [])
    (curtain,) = (part for part in found if part.cells[:, 2].mean() > 0)
    return curtain


def test_hair_over_bare_skin_is_a_fringe(front: LooseHair) -> None:
    """Its cells lie in front, below the hairline; without the curtain there are none in front."""
    assert len(front.cells) > 100
    assert front.cells[:, 1].max() < LOW + 0.02
    plain = ball.tied_hull()
    bare = find_fringe(ball.HEAD, plain, measure_scalp_distance(ball.HEAD, plain), [])
    assert not any((part.cells[:, 2] > 0.05).any() for part in bare)


def test_the_fringe_hangs_to_its_end(front: LooseHair) -> None:
    """Strands from the roots nearest to the fringe run through its cells down to the lowest."""
    roots = ball.HEAD.vertices[ball.HEAD.scalp > 0.5].astype(np.float64)
    hair = TiedHair((), (LooseHair(front.cells, 0.05),))
    chosen, strands = hang_fringe(roots, hair, 20)
    assert 3 < len(chosen) <= np.ceil(0.05 * len(roots))
    assert len(set(chosen)) == len(chosen)
    assert (roots[chosen, 2] > 0).all()
    assert strands[:, 0] == pytest.approx(roots[chosen], abs=1e-6)
    assert np.median(strands[:, -1, 1]) < -0.05
    assert (np.abs(strands[:, 10:, 0]) < 0.05).all()


def test_a_lock_forks_to_all_its_ends() -> None:
    """Strands of a lock that hangs to both sides from its middle end on both sides, on its way."""
    turn = np.linspace(-1.2, 1.2, 81)
    course = 0.12 * np.stack([np.sin(turn), np.cos(turn), 0 * turn], axis=1)
    cells = np.column_stack([course, 0.12 * np.abs(turn)]).astype(np.float32)
    roots = np.stack([np.linspace(-0.02, 0.02, 40), np.full(40, 0.11), np.zeros(40)], axis=1)
    chosen, strands = hang_fringe(roots, TiedHair((), (LooseHair(cells, 0.25),)), 30)
    assert len(chosen) == 10
    assert 3 <= (strands[:, -1, 0] > 0.1).sum() <= 7
    assert (np.abs(strands[:, -1, 0]) > 0.1).all()
    assert np.linalg.norm(strands[:, 15:], axis=2) == pytest.approx(0.12, abs=0.006)


def test_no_fringe_leaves_all_hair_tied() -> None:
    """Without loose cells no root is chosen."""
    chosen, strands = hang_fringe(np.ones((4, 3)), TiedHair(), 20)
    assert len(chosen) == 0
    assert strands.shape == (0, 20, 3)
