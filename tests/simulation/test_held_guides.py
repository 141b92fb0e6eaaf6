"""Laws of hair that a tie holds to the head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hairkit.manager import Manager
from hairkit.simulation import Surroundings
from hairkit.simulation.held_guides import borne_masses, held_lengths
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import PLANTED, Strands
from hairkit.types.tie import Tie

TIE = Tie(np.array([0.0, 0.06, -0.12]), np.array([0.0, 0.0, -1.0]), 0.008, "tail")


def ponytail() -> Groom:
    """Five strands level from the ball to a ring 6 cm away and 12 cm beyond; one stays loose."""
    groom = bristle_groom()
    start = groom.strands.roots[:6].astype(np.float64)
    points = np.empty((6, 40, 3))
    ring = TIE.centre + np.linspace(-0.004, 0.004, 6)[:, None] * [1.0, 0.0, 0.0]
    ring[5] = start[5] + [0.0, 0.06, 0.0]
    share = np.linspace(0, 1, 14)[None, :, None]
    points[:, :14] = (1 - share) * start[:, None] + share * ring[:, None]
    beyond = np.linspace(0, 0.12, 27)[1:, None] * TIE.axis
    points[:, 14:] = ring[:, None] + beyond
    strands = Strands(points.reshape(-1, 3).astype(np.float32), np.arange(7) * 40)
    return Groom(
        strands, groom.head, groom.root_triangle[:6], groom.root_barycentric[:6], ties=(TIE,)
    )


def test_strands_are_held_up_to_their_ring() -> None:
    """The held way is that to the ring; a strand that passes none is loose, as without ties."""
    groom = ponytail()
    way = groom.strands.arc_lengths().reshape(6, 40)[:, 13]
    held = held_lengths(groom)
    assert held[:5] == pytest.approx(way[:5], abs=0.006)
    assert held[5] == 0
    assert not held_lengths(replace(groom, ties=())).any()


@pytest.mark.parametrize(("level", "borne"), [(0, 0.0), (8, 1.0), (15, 1.0)])
def test_what_a_strand_lies_on_bears_what_hangs_from_it(level: int, borne: float) -> None:
    """A strand lies with its first segments and hangs with the others: all its weight is borne.

    None is where it only hangs, and none at nodes that hang beyond the bend.
    """
    way = np.where(np.arange(15)[:, None] < level, [0.01, 0.0, 0.0], [0.0, -0.01, 0.0])
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(way, axis=0)])[None]
    mass, loose = np.arange(1.0, 17.0)[None], np.zeros(1)
    found = borne_masses(points, np.full((1, 15), 0.01), mass, loose)
    assert found.sum() == pytest.approx(borne * mass[:, 1:].sum(), abs=1e-9)
    assert found[:, level + 1 :].max(initial=0.0) < 1e-9
    assert not borne_masses(points, np.full((1, 15), 0.01), mass, loose + 0.1).any()


def test_hair_that_lies_goes_up_and_down_with_the_head() -> None:
    """What bears level hair lifts it and falls with it, at up to 0.6 g, and does not throw it."""
    groom = replace(ponytail(), ties=())
    simulator = Manager.loaded().call("make_simulator", "rods", groom=groom)
    farthest, head = 0.0, np.eye(4)
    for frame in range(1, 61):
        head[1, 3] = 0.075 * np.sin(np.pi * frame / 30) ** 2
        simulator.advance(1 / 60, Surroundings(head.copy()))
        seen = simulator.points - head[:3, 3]
        farthest = max(farthest, float(np.abs(seen - groom.strands.points).max()))

    assert farthest < 0.012


@pytest.mark.parametrize("name", ["pbd", "rods", "super_helix"])
def test_brows_are_stiff(name: str) -> None:
    """On a head that turns fast, brows go with it wholly where hair of the head lags behind."""
    groom = bristle_groom()
    count = len(groom.strands)
    group = np.where(np.arange(count) % 2, PLANTED["brows"], 0)
    groom = replace(groom, strands=replace(groom.strands, group=group))
    simulator = Manager.loaded().call("make_simulator", name, groom=groom)
    rest, worst = simulator.points.reshape(count, -1, 3).copy(), np.zeros(count)
    for step in range(1, 20):
        angle = 0.4 * np.sin(0.8 * step)
        head = np.eye(4)
        head[:3, :3] = Rotation.from_rotvec([0, 0, angle]).as_matrix()
        simulator.advance(1 / 60, Surroundings(head_from_rest=head))
        own = simulator.points.reshape(count, -1, 3) @ head[:3, :3]
        worst = np.maximum(worst, np.linalg.norm(own - rest, axis=2).max(axis=1))
    stiff = groom.strands.planted
    assert worst[stiff].max() < 1e-5
    assert worst[~stiff].min() > 1e-4


@pytest.mark.parametrize("name", ["pbd", "rods", "super_helix"])
def test_a_tie_moves_with_the_head(name: str) -> None:
    """When gravity turns sideways, the ring's hair stays, and the tail swings less than untied."""
    moved = {}
    for tied in (True, False):
        groom = ponytail() if tied else replace(ponytail(), ties=())
        simulator = Manager.loaded().call("make_simulator", name, groom=groom)
        rest = simulator.points.reshape(6, 40, 3).copy()
        for _ in range(12):
            simulator.advance(1 / 60, Surroundings(gravity=np.array([9.81, 0.0, 0.0])))
        moved[tied] = np.linalg.norm(simulator.points.reshape(6, 40, 3) - rest, axis=2)
    assert moved[True][:5, 13].max() < 0.3 * moved[False][:5, 13].max()
    assert moved[True][:5, 39].min() > moved[True][:5, 13].max()
    assert moved[True][5] == pytest.approx(moved[False][5], abs=2e-3)
