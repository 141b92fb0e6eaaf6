"""Laws of the field of tight curls."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import unit_vectors
from hairkit.field.growth_prior import growth_potential, measure_scalp_distance
from hairkit.field.hanging_hair import (
    SAG,
    SEEN_STIFFER,
    STANDS_OFF,
    STIFFER,
    hang_curls,
    hanging_axes,
    stand_coils,
)
from hairkit.testing import ball_head, shell_hull
from hairkit.types.volume import ScalpDistance

HEAD = ball_head()


def test_curls_stand_off_the_skin_and_lie_down_with_distance() -> None:
    """Upright at the skin; along the head from `STANDS_OFF` metres on."""
    place = np.array([[0.08, 0.06, 0.0]], np.float32)
    outward = place[0] / np.linalg.norm(place[0])
    near, far = (
        hanging_axes(HEAD, place, np.array([height], np.float32))[0] @ outward
        for height in (0.0, STANDS_OFF)
    )
    assert near > 0.6
    assert abs(far) < 1e-6


def test_curls_hang_straight_down_below_the_middle_of_the_head() -> None:
    """Nothing turns hair inward under the chin; the whorl behind the middle shifts it a bit."""
    place = np.array([[0.1, -0.1, 0.0], [0.0, -0.1, -0.1]], np.float32)
    axes = hanging_axes(HEAD, place, np.full(2, 0.1, np.float32))
    np.testing.assert_allclose(axes, [[0, -1, 0], [0, -1, 0]], atol=0.15)


def test_left_and_right_mirror_each_other() -> None:
    """The mirrored place has the mirrored axis."""
    place = np.random.default_rng(0).normal(0, 0.1, (50, 3)).astype(np.float32)
    height = np.full(50, 0.02, np.float32)
    mirror = np.array([-1, 1, 1], np.float32)
    axes, mirrored = (hanging_axes(HEAD, p, height) for p in (place, place * mirror))
    np.testing.assert_allclose(axes * mirror, mirrored, atol=1e-6)


def test_the_field_is_signed_and_of_unit_length_in_the_loose_hull_only() -> None:
    """A tracker can follow it from root to tip."""
    hull = shell_hull()
    growth = growth_potential(hull, measure_scalp_distance(HEAD, hull))
    field = hang_curls(HEAD, hull, growth)
    assert field.direction is not None
    length = np.linalg.norm(field.direction, axis=3)
    np.testing.assert_allclose(length[hull.loose], 1, atol=1e-5)
    assert not length[~hull.loose].any()


@pytest.mark.parametrize("times", STIFFER)
def test_coils_stand_off_the_scalp_and_sag_as_the_photos_show(times: int) -> None:
    """Straight out at the scalp; photos that show all directions but those along axes tell the
    sag: as far down as out at a way of `SAG` metres and more."""
    hull = shell_hull()
    growth = growth_potential(hull, measure_scalp_distance(HEAD, hull))
    outward = unit_vectors(hull.grid.centres_of(hull.loose))
    for way, down in ((0.0, 0.0), (SAG, 1.0)):
        distance = ScalpDistance(np.full(hull.grid.shape, way, np.float32), SAG)
        x, y, z = unit_vectors(outward - [0, down / (SEEN_STIFFER * times), 0]).T
        across = np.stack([1 - x * x, 1 - y * y, 1 - z * z, -x * y, -x * z, -y * z], axis=1)
        field = stand_coils(hull, distance, growth, across, np.ones(len(x), np.float32))
        assert field.direction is not None
        wanted = unit_vectors(outward - [0, down / times, 0])
        np.testing.assert_allclose(field.direction[hull.loose], wanted, atol=1e-5)
        assert not field.direction[~hull.loose].any()
