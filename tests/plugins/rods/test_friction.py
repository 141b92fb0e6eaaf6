"""The plugin's rods on obstacles against physics: a slope, a rope around a bollard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods.backend import Engine
from hairkit_plugins.rods.block import Contact, acting
from hairkit_plugins.rods.rods import rest_state
from rods_bench import DENSITY, LENGTH, NOTHING, G, load_of, rods_of, steps_of, straight, system_of
from rods_reference import TwinEngine, resolve_contacts, solve_substep, substep

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.obstacles import Bodies, Obstacles
from hairkit.types.volume import VoxelGrid

RADIUS, LEAD = 0.02, 0.04
"""Of the bollard; length of the rope from its root to where it touches, metres."""


@pytest.mark.parametrize("rounds", [0, 4])
def test_hair_on_a_slope_slides_when_the_slope_beats_friction(rounds: int) -> None:
    """tan(alpha) = mu: a strand across the slope stays at mu above it and goes at mu below it."""
    alpha, moved = np.radians(30.0), []
    gravity = G * np.array([0.0, -np.cos(alpha), -np.sin(alpha)])
    grid = VoxelGrid.around(np.full(3, -0.2), np.full(3, 0.2), 0.02)
    plane = Obstacles(grid, grid.centres()[..., 1])
    rods = rods_of(straight(1, 12), DENSITY, 1e-16, straight=True)
    for share in (1.1, 0.9):
        contact = Contact(
            Bodies(plane), np.zeros_like(rods.mass), share * np.tan(alpha), 0.5, rounds
        )
        system, state = system_of(rods, 1 / 240), rest_state(rods)
        for _ in range(48):
            state = substep(rods, system, state, load_of(gravity), contact)
        moved.append(-state.position[0, -1, 2])
    free_fall = 0.5 * 0.1 * G * np.sin(alpha) * 0.2**2
    assert moved[0] < 2e-5
    assert moved[1] == pytest.approx(free_fall, rel=0.15)


@pytest.mark.parametrize(("rounds", "off"), [(2, 0.2), (4, 0.1)])
@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_a_rope_around_a_bollard_holds_by_the_exponential_of_its_wrap(
    friction: float, rounds: int, off: float
) -> None:
    """Capstan: T2 = T1 exp(mu theta), drawn and let go; log(T2 / T1) = mu theta to 10 %.

    With the simulator's own rounds of friction to 20 %.

    dT = mu T dtheta where the rope slips. Wraps of 0.5, 1 and 2 rad; a force at the tip, the root
    slips along at a constant speed, and its tension is averaged over the nodes that pass.
    """
    wrap, way = (a.ravel() for a in np.meshgrid([0.5, 1.0, 2.0], [1.0, -1.0]))
    tension = slipping(wrap, 0.3 * way, friction, rounds)
    np.testing.assert_allclose(way * np.log(tension) / friction / wrap, 1.0, atol=off)


@pytest.mark.parametrize("rounds", [0, 1, 4])
def test_compiled_ropes_slip_as_those_of_the_reference(rounds: int) -> None:
    """The same pull on the same bollard, half a tenth of a second: the same places to 0.01 mm."""
    wrap = np.linspace(0.3, 2.0, 9)
    points = around(wrap, np.linspace(0, LENGTH, 16))
    rods = rods_of(points, DENSITY, 1e-12, straight=True)
    force = np.zeros_like(points)
    force[:, -1] = 1e-5 * np.stack([np.cos(wrap), -np.sin(wrap), 0.3 + 0 * wrap], axis=1)
    contact = Contact(Bodies(bollard()), np.zeros_like(rods.mass), 0.3, 0.5, rounds)
    system, steps = system_of(rods, 1 / 240), steps_of(load_of(), 4, 1 / 240)
    places = []
    for engine in (TwinEngine(rods, contact), Engine(rods, contact)):
        for _ in range(3):
            engine.run(system, steps, acting(rods, NOTHING, force))
        places.append(engine.state.position)
    assert np.abs(places[0] - rods.points).max() > 1e-3
    np.testing.assert_allclose(places[1], places[0], atol=1e-5)


def slipping(wrap: Float64Array, speed: Float64Array, friction: float, rounds: int) -> Float64Array:
    """Return the tension (S,) at the root over that at the tip, averaged over 75 ms of slip.

    `wrap` (S,) rad around the bollard, `speed` (S,) m/s at which the root goes away from it.
    """
    nodes, step, pull = 31, 1e-3, 1e-5
    points = around(wrap, np.linspace(0, LENGTH, nodes))
    rods = rods_of(points, DENSITY, 1e-16, straight=True)
    along = quaternion.normalize(np.gradient(points, axis=1))
    state = replace(rest_state(rods), velocity=-speed[:, None, None] * along)
    force = np.zeros_like(points)
    force[:, -1] = pull * np.stack([np.cos(wrap), -np.sin(wrap), 0 * wrap], axis=1)
    system, load, found = system_of(rods, step), load_of(force=force), []
    contact = Contact(Bodies(bollard()), np.zeros_like(rods.mass), friction, 0.5, rounds)
    for _ in range(100):
        points[:, 0, 0] -= speed * step
        state, before = solve_substep(replace(rods, points=points), system, state, load)
        state, after = resolve_contacts(rods, state, contact, load, step)
        found.append((before + after)[:, 0] / pull)
    return np.mean(found[25:], axis=0)


def around(wrap: Float64Array, s: Float64Array) -> Float64Array:
    """Return points (S, n, 3) at arc lengths `s` of a rope along X, around the bollard, and off."""
    angle = np.clip((s - LEAD) / RADIUS, 0.0, wrap[:, None])
    beyond = np.minimum(s - LEAD, 0.0)
    off = np.maximum(s - LEAD - wrap[:, None] * RADIUS, 0.0)
    x = RADIUS * np.sin(angle) + beyond + off * np.cos(wrap)[:, None]
    y = RADIUS * np.cos(angle) - off * np.sin(wrap)[:, None]
    return np.stack([x, y, 0 * x], axis=-1)


def bollard() -> Obstacles:
    """Return a cylinder along Z."""
    spacing = 0.0005
    grid = VoxelGrid.around([-0.03, -0.03, -spacing], [0.03, 0.03, spacing], spacing)
    x, y, _ = np.moveaxis(grid.centres(), -1, 0)
    return Obstacles(grid, np.hypot(x, y) - RADIUS)
