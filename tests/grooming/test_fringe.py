"""Laws of loose hair beside tied hair."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.field.ties import find_fringe
from hairkit.grooming.fringe import hang_fringe
from hairkit.types.tie import TiedHair
from hairkit.types.volume import Hull, OrientationField, outer_products
from tests.support import tied_ball as ball

LOW = float(ball.HEAD.vertices[ball.HEAD.scalp > 0.5, 1].min())
"""The hairline of the ball."""


def fringed() -> Hull:
    """The tied ball with a curtain of hair over the face, from the hairline down to -9 cm."""
    hull = ball.tied_hull()
    x, y, z = np.moveaxis(ball.GRID.centres().astype(np.float64), -1, 0)
    curtain = (np.abs(x) < 0.03) & (y > -0.09) & (y < LOW + 0.02) & (z > 0)
    curtain &= (hull.head_distance > 0) & (hull.head_distance < 0.012)
    return Hull(hull.grid, hull.dense | curtain, hull.loose | curtain, hull.head_distance)


def test_hair_over_bare_skin_is_a_fringe() -> None:
    """Its cells lie in front, below the hairline; without the curtain there are none in front."""
    hull = fringed()
    fringe = find_fringe(ball.HEAD, hull, measure_scalp_distance(ball.HEAD, hull), [])
    front = fringe[fringe[:, 2] > 0]
    assert len(front) > 100
    assert front[:, 1].max() < LOW + 0.02
    plain = ball.tied_hull()
    bare = find_fringe(ball.HEAD, plain, measure_scalp_distance(ball.HEAD, plain), [])
    assert not (bare[:, 2] > 0.05).any()


def test_the_fringe_hangs_to_its_end() -> None:
    """Strands from the roots nearest to the fringe run through its cells down to the lowest."""
    hull = fringed()
    fringe = find_fringe(ball.HEAD, hull, measure_scalp_distance(ball.HEAD, hull), [])
    fringe = fringe[(fringe[:, 2] > 0) & (np.abs(fringe[:, 0]) < 0.04)]
    down = np.broadcast_to([0.0, -1.0, 0.0], (*ball.GRID.shape, 3))
    zero = np.zeros(ball.GRID.shape, np.float32)
    field = OrientationField(ball.GRID, outer_products(down).astype(np.float32), zero, zero)
    roots = ball.HEAD.vertices[ball.HEAD.scalp > 0.5].astype(np.float64)
    chosen, strands = hang_fringe(roots, TiedHair((), fringe, 0.05), field, 20)
    assert 3 < len(chosen) <= np.ceil(0.05 * len(roots))
    assert (roots[chosen, 2] > 0).all()
    assert strands[:, 0] == pytest.approx(roots[chosen], abs=1e-6)
    assert np.median(strands[:, -1, 1]) < -0.05
    assert (np.abs(strands[:, 10:, 0]) < 0.05).all()


def test_no_fringe_leaves_all_hair_tied() -> None:
    """Without loose cells no root is chosen."""
    chosen, strands = hang_fringe(np.ones((4, 3)), TiedHair(), ball.tied_field(), 20)
    assert len(chosen) == 0
    assert strands.shape == (0, 20, 3)
