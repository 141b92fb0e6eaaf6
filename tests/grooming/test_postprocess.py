"""Laws of the last steps that trackers share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import unit_vectors
from hairkit.grooming import postprocess
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


def elbows() -> Strands:
    """Four strands, 4 cm out of the ball and then 4 cm along it, with a right angle between."""
    t = np.linspace(-1, 1, 41)[:, None]
    way = np.minimum(t, 0) * [0, -0.04, 0] + np.maximum(t, 0) * [0.04, 0, 0] + [0.0, 0.24, 0.0]
    return Strands(np.tile(way, (4, 1)).astype(np.float32), np.arange(5) * 41)


def sharpest(strands: Strands) -> np.ndarray:
    """Largest angle (S,) between the segments of each strand, degrees."""
    along = unit_vectors(np.diff(strands.points.reshape(len(strands), -1, 3), axis=1))
    cosine = np.einsum("smc,smc->sm", along[:, 1:], along[:, :-1])
    return np.degrees(np.arccos(np.clip(cosine.min(axis=1), -1, 1)))


def test_stiff_strands_bend_over_some_millimetres() -> None:
    """A right angle becomes an arc, roots and tips stay."""
    strands = elbows()
    result = finish(strands, Waves(), TiedHair(), shell_hull(), FIELD, PLAIN)
    assert sharpest(strands).min() > 85
    assert sharpest(result).max() < 25
    np.testing.assert_allclose(result.roots, strands.roots, atol=1e-6)
    np.testing.assert_allclose(result.tips, strands.tips, atol=1e-6)
    limp = finish(strands, Waves(), TiedHair(), shell_hull(), FIELD, replace(PLAIN, stiffness=0.0))
    np.testing.assert_array_equal(limp.points, strands.points)


def hairpins() -> Strands:
    """Four strands that rise 2 cm out of the ball, turn back at once and run 16 cm along it."""
    t = np.linspace(0, 0.2, 101)[:, None]
    rise = np.minimum(t, 0.02) - np.clip(t - 0.02, 0, 0.02)
    way = rise * [0, 1, 0] + np.maximum(t - 0.02, 0) * [0.15, 0, 0] + [0.0, 0.2, 0.0]
    way += np.maximum(t - 0.04, 0) * [0.85, 0, 0]
    return Strands(np.tile(way, (4, 1)).astype(np.float32), np.arange(5) * 101)


def test_strands_that_rise_and_turn_back_bend_no_sharper_than_hair() -> None:
    """A hairpin becomes an arc of the least radius that stands less far off; other strands keep
    what one smoothing made of them."""
    pins, radius = hairpins(), postprocess.SHARPEST
    result = finish(pins, Waves(), TiedHair(), shell_hull(), FIELD, PLAIN)
    even = result.resampled(101)
    step = even.lengths() / 100
    assert np.radians(sharpest(even)).max() < 1.1 * (step / radius).max()
    assert result.points[:, 1].max() < pins.points[:, 1].max() - 0.008
    np.testing.assert_allclose(result.tips, pins.tips, atol=1e-6)
    others = bristles().resampled(101)
    both = Strands(np.concatenate([pins.points, others.points]), np.arange(len(others) + 5) * 101)
    alone, beside = (
        finish(each, Waves(), TiedHair(), shell_hull(), FIELD, PLAIN) for each in (others, both)
    )
    np.testing.assert_array_equal(beside.select(np.arange(4, len(both))).points, alone.points)
