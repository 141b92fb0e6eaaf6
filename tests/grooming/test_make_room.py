"""Laws of the room that waves take in the hair: wound strands stay in the hull."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import Float32Array
from hairkit.grooming.postprocess import make_room
from hairkit.grooming.wind_waves import LARGEST_RADIUS, RAMP, add_waves
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull, VoxelGrid
from hairkit.types.waves import Waves

GRID = VoxelGrid.around(np.full(3, -0.15), np.full(3, 0.15), 0.005)
HALF = 0.05
"""Half the thickness of a slab of hair across x, metres."""
WAVES = Waves(0.008, 0.06)


def slab(head: float = -0.2) -> Hull:
    """Hair between x = -HALF and HALF, and a head that ends at x = `head`."""
    across = GRID.centres()[..., 0]
    hair = (np.abs(across) < HALF) & (across > head)
    return Hull(GRID, hair, hair, (across - head).astype(np.float32))


def hanging(x: float, lean: float = 0.0) -> Strands:
    """Ten strands of 20 cm that hang from y = 0.1 at x, leaning outwards by `lean`."""
    down = np.linspace(0, 0.2, 64)
    rows = [
        np.stack([x + lean * down, 0.1 - down, 0 * down + z], 1) for z in np.linspace(0, 0.02, 10)
    ]
    return Strands.from_list([row.astype(np.float32) for row in rows])


def beyond_ramp(strands: Strands) -> Float32Array:
    """Points of the strands where the radius is whole."""
    return strands.points[strands.arc_lengths() > 1.5 * RAMP]


@pytest.mark.parametrize("x", [0.03, 0.045, 0.052])
def test_axes_lie_a_radius_under_the_surface(x: float) -> None:
    """Strands near the surface, and outside of it, move in by what they lack; roots stay."""
    strands = hanging(x)
    moved = make_room(strands, WAVES, slab())
    wanted = min(HALF - LARGEST_RADIUS * WAVES.radius, x)
    np.testing.assert_allclose(beyond_ramp(moved)[:, 0], wanted, atol=0.003)
    np.testing.assert_array_equal(moved.roots, strands.roots)


def test_wound_strands_stay_in_the_hair() -> None:
    """Helices about the moved axes leave the hull nowhere; about the tracked ones they do."""
    strands = hanging(0.047)
    before, after = (
        beyond_ramp(add_waves(axes, WAVES))[:, 0].max()
        for axes in (strands, make_room(strands, WAVES, slab()))
    )
    assert before > HALF + 0.003
    assert after < HALF + 0.002


def test_thin_hair_is_wound_about_its_middle() -> None:
    """Between a head and a surface 10 mm apart, axes of waves of 8 mm lie half way."""
    moved = make_room(hanging(0.049), WAVES, slab(head=0.04))
    np.testing.assert_allclose(beyond_ramp(moved)[:, 0], 0.045, atol=0.003)


def test_no_strand_becomes_shorter() -> None:
    """Strands that run straight out of the hair, as tips do, keep every point."""
    out = np.linspace(0, 0.12, 64)
    strands = Strands.from_list([np.stack([out, 0 * out, 0 * out], 1).astype(np.float32)])
    np.testing.assert_allclose(make_room(strands, WAVES, slab()).points, strands.points, atol=1e-5)


def test_straight_hair_stays_where_it_is() -> None:
    """Without waves nothing moves, not even outside of the hull."""
    strands = hanging(0.06)
    assert make_room(strands, Waves(), slab()) is strands
