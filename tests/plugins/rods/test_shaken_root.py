"""Hair whose root is shaken, at the default quality, against the beam under tension."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods import Options, make_simulator
from hairkit_plugins.rods.simulator import SINGLE_HAIR
from heavy_beam import modes, shaken_tip

from hairkit.arrays import Float64Array
from hairkit.simulation import Surroundings
from hairkit.testing import bristle_groom
from hairkit.types.strands import Strands

SIZE, RATE, SECONDS = 0.002, 60, 3
FREE = {
    "stiffness": 0.0,
    "bend": 0.0,
    "damping": 0.0,
    "cohesion": 0.0,
    "pressure": 0.0,
    "adhesion": 0.0,
}
"""What would hold or slow the hair, besides the air."""


def shaken(length: float, hertz: float, options: Options) -> Float64Array:
    """Return (F,) the tip of a hair that hangs, each frame, its head moved by a sine along x."""
    ball = bristle_groom()
    hair = np.linspace(0, length, 60)[:, None] * [0.0, -1.0, 0.0] + [0.0, 0.0, 0.5]
    groom = replace(
        ball,
        strands=Strands.from_list([hair]),
        root_triangle=ball.root_triangle[:1],
        root_barycentric=ball.root_barycentric[:1],
    )
    simulator, tips = make_simulator(groom, options), []
    for frame in range(1, RATE * SECONDS + 1):
        head = np.eye(4)
        head[0, 3] = SIZE * np.sin(2 * np.pi * hertz * frame / RATE)
        simulator.advance(1 / RATE, Surroundings(head))
        tips.append(float(simulator.points[-1, 0]))
    return np.array(tips)


@pytest.mark.parametrize(("length", "hertz"), [(0.1, 2.0), (0.2, 2.0), (0.3, 1.8)])
@pytest.mark.parametrize(("drag", "off"), [(2.0, 0.03), (0.0, 0.06)])
def test_a_tip_follows_its_shaken_root_as_a_beam(
    length: float, hertz: float, drag: float, off: float
) -> None:
    """Over three seconds from rest: to 3 % of its motion in air, 6 % where nothing damps."""
    time = np.arange(1, RATE * SECONDS + 1) / RATE
    law = shaken_tip(time, SIZE, hertz, drag, modes(length, SINGLE_HAIR, 9.81))
    found = shaken(length, hertz, Options(backend="fast", drag=drag, **FREE))
    assert np.sqrt(((found - law) ** 2).mean() / (law**2).mean()) < off
