"""Laws of the strands that are led through hair which no other reaches, on the ball head."""

from __future__ import annotations

from functools import cache

import numpy as np

from hairkit.grooming.cover_hair import ROOT_REACH, find_bare_cells, lead_to_roots
from hairkit.testing import ball_head, ball_mask, scalp_roots, shell_hull
from hairkit.types.camera import Camera
from hairkit.types.mask import Mask
from hairkit.types.strands import Strands

CELL = 0.005
HULL = shell_hull(CELL)
CLOSE = [
    Camera.on_turn(azimuth, distance=1.2, focal=600.0, width=240, height=240)
    for azimuth in (0.0, 90.0, 180.0, 270.0)
]
"""Sharper than the turn of `hairkit.testing`: a strand's reach is several pixels wide."""


@cache
def masks() -> tuple[Mask, ...]:
    return tuple(ball_mask(camera) for camera in CLOSE)


def bristles() -> Strands:
    """Strands through every dense cell on the subject's left, x > 0."""
    cells = HULL.grid.centres_of(HULL.dense)
    left = cells[cells[:, 0] > 0]
    ends = left + np.array([0.0, 0.1 * CELL, 0.0], np.float32)
    points = np.stack([left, ends], axis=1).reshape(-1, 3)
    return Strands(points.astype(np.float32), np.arange(len(left) + 1) * 2)


def test_bare_cells_lie_where_photos_show_hair_and_no_strand_passes() -> None:
    """Strands fill the left half, so all bare cells are on the right, and most of it is found."""
    found = find_bare_cells(bristles(), HULL, masks(), CLOSE, ball_head())
    cells = HULL.grid.centres_of(HULL.dense)
    assert found[:, 0].max() < 0
    assert len(found) > 0.4 * (cells[:, 0] < 0).sum()


def test_no_cell_is_bare_where_strands_are_drawn_before_it_or_the_head_hides_it() -> None:
    """Hair all around leaves none; nor is any seen by one view from the left, behind the ball."""
    cells = HULL.grid.centres_of(HULL.dense)
    points = np.repeat(cells, 2, axis=0).astype(np.float32)
    points[1::2, 1] += 0.1 * CELL
    everywhere = Strands(points, np.arange(len(cells) + 1) * 2)
    assert not len(find_bare_cells(everywhere, HULL, masks(), CLOSE, ball_head()))
    side = find_bare_cells(bristles(), HULL, masks()[1:2], CLOSE[1:2], ball_head())
    low = side[np.abs(side[:, 1]) < 0.05]
    assert not len(low)


def test_few_guides_stand_for_the_hair_between_them() -> None:
    """Every ninth strand of hair all around leaves next to no bare cell."""
    cells = HULL.grid.centres_of(HULL.dense)[::9]
    points = np.repeat(cells, 2, axis=0).astype(np.float32)
    points[1::2, 1] += 0.1 * CELL
    few = Strands(points, np.arange(len(cells) + 1) * 2)
    bare = find_bare_cells(few, HULL, masks(), CLOSE, ball_head())
    assert len(bare) < 0.01 * HULL.dense.sum()


def test_ways_join_the_nearest_free_roots() -> None:
    """Two ways from one place join two roots; a third, from far away, none. The rest stays."""
    roots = scalp_roots(ball_head()).positions
    up = np.linspace(0, 0.02, 21, dtype=np.float32)
    grown = roots[:, None] + up[:, None] * np.array([0, 1, 0], np.float32)
    strands = Strands(grown.reshape(-1, 3), np.arange(len(roots) + 1) * 21)
    place = roots[7] + np.array([0.0, 0.0, 0.03], np.float32)
    far = place + np.array([0.0, 0.0, 3 * ROOT_REACH], np.float32)
    seeds = np.stack([place, place, far])
    near_root = np.stack([roots[7], roots[7], far])
    shares = np.linspace(0, 1, 6, dtype=np.float32)[None, :, None]
    back = seeds[:, None] * (1 - shares) + near_root[:, None] * shares
    ahead = seeds[:, None] - shares * np.array([0, 0.05, 0], np.float32)
    led = lead_to_roots(strands, roots, back, ahead)
    changed = np.flatnonzero(np.abs(led.points - strands.points).reshape(len(roots), -1).max(1))
    assert len(changed) == 2
    assert 7 in changed
    np.testing.assert_array_equal(led.roots, roots)
    np.testing.assert_allclose(led.tips[changed], np.stack([ahead[0, -1]] * 2), atol=1e-6)
    np.testing.assert_allclose(led.lengths()[7], 0.03 + 0.05, rtol=0.03)


def test_a_way_beside_its_root_bends_towards_it() -> None:
    """A way runs on past its root, 1 cm beside it: the strand leaves the root at half a right
    angle, not square to the way; the place that it was led to is still covered."""
    roots = scalp_roots(ball_head()).positions[:1]
    shares = np.linspace(0, 1, 41, dtype=np.float32)[:, None]
    beside, along = np.array([0.01, 0, 0], np.float32), np.array([0, 0.04, 0], np.float32)
    back = (roots + beside + along * (1 - shares))[None]
    ahead = (roots + beside + along * (1 + shares))[None]
    strands = Strands(np.repeat(roots, 41, axis=0), np.array([0, 41]))
    led = lead_to_roots(strands, roots, back, ahead).points
    steps = np.diff(led, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    assert (steps[1:] * steps[:-1]).sum(axis=1).min() > np.cos(np.radians(50))
    assert np.linalg.norm(led - back[0, 0], axis=1).min() < 0.002
