"""Laws of the wind behind hair and head."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import Float64Array
from hairkit.manager import Manager
from hairkit.simulation import Surroundings
from hairkit.simulation.hair_grid import SPACING, HairGrid, make_hair_grid
from hairkit.simulation.obstacles import NO_BODIES, Bodies, head_obstacles
from hairkit.simulation.vectors import Floats
from hairkit.simulation.wind import air_velocity
from hairkit.simulation.wind_shadow import AIR, HAIRS, passing_wind, wind_losses
from hairkit.testing import ball_head, bristle_groom

DRAG, SHAPE = 2.0, (12, 14, 16)
STILL = np.eye(4)


INNER = (slice(1, -1),) * 3
"""The last corner is looked up a thousandth of a cell before it."""
Shadow = tuple[Floats, Float64Array]
"""Losses of wind in cells, and where the first one is."""


def shadow_of(density: Float64Array, strands: int = 600) -> Shadow:
    """Return the shadow of hair with so much mass in each cell, kilograms, without a head."""
    grid = HairGrid(np.zeros(3), density)
    return wind_losses(grid, strands, 0.0, NO_BODIES), grid.origin


def passing(shadow: Shadow, places: Float64Array, wind: Float64Array) -> Float64Array:
    """Return the shares (...) of the wind at places (..., 3)."""
    found = passing_wind(*shadow, places.reshape(-1, 3), wind, DRAG)
    return found.reshape(places.shape[:-1]).astype(np.float64)


def corners() -> Float64Array:
    """Return the places (X, Y, Z, 3) of the corners of a grid of `SHAPE`."""
    return SPACING * np.stack(np.indices(SHAPE), axis=-1).astype(np.float64)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("sign", "slant"), [(1, 0.0), (-1, 0.5), (1, -1.0)])
def test_air_loses_the_momentum_that_hair_gains(axis: int, sign: int, slant: float) -> None:
    """Across even hair of density rho at a drag c, wind loses c rho x / rho_air of its speed.

    On a slant its way is longer.
    """
    wind = np.full(3, slant)
    wind[axis] = 6.0 * sign
    strands, density = 500, 10.0
    cell = np.full(SHAPE, density * SPACING**3 * strands / HAIRS)
    found = passing(shadow_of(cell, strands), corners(), wind)
    depth, speed = SPACING * np.arange(SHAPE[axis])[::sign], np.linalg.norm(wind)
    lost = DRAG * density / AIR / speed
    left = np.maximum(1 - lost * depth * speed / 6.0, 0.0)
    inner = np.moveaxis(found, axis, 0)[1:-1, 5:-5, 5:-5]
    assert (left > 0).sum() > 8
    np.testing.assert_allclose(
        inner, np.ones_like(inner) * left[1:-1, None, None], atol=0.01 if slant else 1e-5
    )


def test_a_shadow_never_strengthens_wind(rng: np.random.Generator) -> None:
    """Shares are from 0 to 1, no more where there is more hair, and equal for equal input."""
    cell = 1e-5 * rng.random(SHAPE)
    places = rng.uniform(-0.1, 0.5, (500, 3))
    for wind in rng.normal(0, 4, (20, 3)):
        found = passing(shadow_of(cell), places, wind)
        assert found.min() >= 0.0
        assert found.max() <= 1.0 + 1e-6
        denser = passing(shadow_of(2 * cell), places, wind)
        assert (denser <= found + 1e-6).all()
        np.testing.assert_array_equal(found, passing(shadow_of(cell), places, wind))


def test_turned_hair_has_the_turned_shadow(rng: np.random.Generator) -> None:
    """Axes may be named anew, and one turned round, by which nothing else changes."""
    cell, wind, places = 1e-5 * rng.random(SHAPE), np.array([2.0, -5.0, 3.0]), corners()
    found = passing(shadow_of(cell), places, wind)
    named = passing(
        shadow_of(cell.transpose(1, 2, 0)),
        places.transpose(1, 2, 0, 3)[..., [1, 2, 0]],
        wind[[1, 2, 0]],
    )
    np.testing.assert_allclose(named, found.transpose(1, 2, 0), atol=1e-6)
    back = passing(shadow_of(cell[::-1]), places, wind * [-1, 1, 1])
    np.testing.assert_allclose(back[::-1][INNER], found[INNER], atol=1e-6)


def test_a_lone_strand_stands_in_the_wind() -> None:
    """It casts no shadow on itself, across the wind or along it."""
    nodes = np.zeros((1, 16, 3))
    nodes[0, :, 1] = -0.02 * np.arange(16)
    strand = 1e-6
    mass = np.full((1, 16), strand)
    grid = make_hair_grid(nodes, mass)
    shadow = wind_losses(grid, 1, strand, NO_BODIES), grid.origin
    for wind in ([6.0, 0, 0], [0, -6.0, 0], [1.0, 2, 3]):
        np.testing.assert_allclose(passing(shadow, nodes, np.array(wind)), 1.0)


def test_behind_a_head_air_is_still() -> None:
    """Behind a ball, seen along the wind, nothing is left; beside and before it, all is."""
    bodies = Bodies(head_obstacles(ball_head()))
    ends = np.array([[[-0.25] * 3, [0.25] * 3]])
    grid = make_hair_grid(ends, np.zeros((1, 2)))
    shadow = wind_losses(grid, 1, 0.0, bodies), grid.origin
    places = np.array([[0.2, 0, 0], [0.2, 0.03, -0.03], [-0.2, 0, 0], [0.0, 0.2, 0]])
    found = passing(shadow, places, np.array([4.0, 0.0, 0.0]))
    np.testing.assert_allclose(found, [0, 0, 1, 1], atol=1e-6)
    found = passing(shadow, places, np.array([-4.0, 0.0, 0.0]))
    np.testing.assert_allclose(found, [1, 1, 0, 1], atol=1e-6)


@pytest.mark.parametrize("name", ["rods", "pbd", "super_helix"])
def test_gusts_pass_the_head(name: str, manager: Manager) -> None:
    """What is held back of the air at the nodes is a share of the mean wind, and no gust."""
    simulator = manager.call("make_simulator", name, groom=bristle_groom())
    wind, tail = np.array([3.0, 0.0, 1.0]), () if name == "super_helix" else (STILL,)
    rest = simulator._at_rest[:, 1:2] if name == "super_helix" else simulator._nodes[:, ::15]
    held = [
        simulator._air(Surroundings(wind=wind, turbulence=gusts), *tail)[:, ::15]
        - air_velocity(rest, 0.0, wind, gusts)
        for gusts in (0.0, 0.5)
    ]
    np.testing.assert_allclose(*held, atol=1e-5)
    share = held[0] @ wind / -(wind @ wind)
    np.testing.assert_allclose(held[0], -share[..., None] * wind, atol=1e-6)
    assert share.min() >= -1e-6
    assert share.max() > 0.9
    assert not simulator._air(Surroundings(turbulence=0.5), *tail).any()


def test_guides_of_more_strands_have_the_same_shadow() -> None:
    """A groom of twice as many guides stands for as much hair."""
    cell = np.full(SHAPE, 1e-5)
    few, many = shadow_of(cell, 300), shadow_of(2 * cell, 600)
    np.testing.assert_allclose(few[0], many[0], rtol=1e-6)
