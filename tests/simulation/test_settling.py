"""Laws of both simulators: captured hair stays where it is, and comes back to rest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hairkit_plugins import rods, super_helix

from hairkit.head_model.template import default_head
from hairkit.simulation import Simulator, Surroundings, add_shakes
from hairkit.synth import StyleName, grow
from hairkit.types.groom import Groom

SIMULATORS: dict[str, Callable[[Groom], Simulator]] = {
    "rods": lambda groom: rods.make_simulator(groom, rods.Options(backend="fast")),
    "super_helix": lambda groom: super_helix.make_simulator(groom, super_helix.Options()),
}
GUIDES, RATE, CALM = 60, 60, 0.005
"""Guides, frames a second, and metres a second at which hair counts as still."""


@pytest.mark.parametrize("method", list(SIMULATORS))
@pytest.mark.parametrize("style", ["straight", "wavy"])
def test_hair_is_still_three_seconds_after_a_shake(method: str, style: StyleName) -> None:
    """99 of 100 points go slower than 5 mm/s, and are within 5 mm of where they were captured."""
    groom = grow(style, default_head(), GUIDES)
    simulator, motion = SIMULATORS[method](groom), add_shakes(["yaw:25:1.5:2"], groom.head)
    before = after = simulator.points
    for frame in range(1, 5 * RATE + 1):
        simulator.advance(1 / RATE, Surroundings(motion(frame / RATE)))
        before, after = after, simulator.points
    speed = np.linalg.norm(after - before, axis=1) * RATE
    assert np.percentile(speed, 99) < CALM
    off = np.linalg.norm(after - groom.strands.points, axis=1)
    assert np.percentile(off, 99) < 0.005


@pytest.mark.parametrize("style", ["straight", "wavy", "curly"])
def test_captured_hair_stays_for_five_seconds(style: StyleName) -> None:
    """No tip of hair of `rods` leaves its place by 2 mm where nothing moves: none topples over."""
    groom = grow(style, default_head(), 2 * GUIDES)
    simulator = SIMULATORS["rods"](groom)
    for _ in range(5 * RATE):
        simulator.advance(1 / RATE, Surroundings())
    assert np.linalg.norm(simulator.points - groom.strands.points, axis=1).max() < 0.002


def test_hair_blown_over_the_shoulders_comes_back() -> None:
    """Of hair that wind from behind brings to the front, none lies there a second after it.

    Without the adhesion of `rods` tips stay up to 10 cm off; here each is within 25 mm.
    """
    groom = grow("wavy", default_head(), 150)
    simulator, tips = SIMULATORS["rods"](groom), groom.strands.offsets[1:] - 1
    for frame in range(1, 2 * RATE + 1):
        wind = np.array([0.0, 0.0, 6.0 * (frame <= RATE)])
        simulator.advance(1 / RATE, Surroundings(wind=wind, turbulence=0.4))
    off = np.linalg.norm(simulator.points[tips] - groom.strands.points[tips], axis=1)
    assert off.max() < 0.025
