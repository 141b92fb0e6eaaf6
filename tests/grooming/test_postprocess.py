"""Laws of the last steps that trackers share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.grooming.head_collision import FULL_AFTER
from hairkit.grooming.postprocess import FinishOptions, finish
from hairkit.testing import ball_head, combed_field, scalp_roots, shell_hull
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.waves import Waves

PLAIN = FinishOptions(waves=False, clearance=0.0)
FIELD = combed_field(shell_hull().grid)


def bristles() -> Strands:
    """Straight strands out of the ball, 5 cm long, with root coordinates."""
    roots = scalp_roots(ball_head())
    course = np.linspace(0, 0.05, 30)[None, :, None]
    points = roots.positions[:, None] + course * roots.normals[:, None]
    count = len(roots)
    flat = points.reshape(-1, 3).astype(np.float32)
    return Strands(flat, np.arange(count + 1) * 30, root_uv=roots.uv)


def test_strands_that_need_nothing_stay_as_they_are() -> None:
    """Outside of the head, without waves and smoothing: the same points and coordinates."""
    strands = bristles()
    result = finish(strands, Waves(), TiedHair(), shell_hull(), FIELD, PLAIN)
    np.testing.assert_allclose(result.points, strands.points, atol=1e-7)
    np.testing.assert_array_equal(result.root_uv, strands.root_uv)


def test_wound_strands_keep_the_clearance_too() -> None:
    """Waves are wound before strands are pushed out of the head, so none dips into it."""
    strands, hull = bristles(), shell_hull()
    options = replace(PLAIN, waves=True, clearance=0.003)
    result = finish(strands, Waves(0.01, 0.03, 0.3), TiedHair(), hull, FIELD, options)
    assert result.lengths().mean() > 1.2 * strands.lengths().mean()
    grown = result.points[result.arc_lengths() > 2 * FULL_AFTER]
    assert hull.grid.sample(hull.head_distance, grown).min() > 0.003 - 1e-4
