"""Laws of hair that is cut short, of heads that jump, and of heads that face down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods import Options
from hairkit_plugins.rods.simulator import RodSimulator

from hairkit.head_model.template import default_head
from hairkit.simulation import Surroundings, add_shakes, quaternion
from hairkit.simulation.rigid_motion import FARTHEST, FINEST, finer_steps
from hairkit.synth import grow
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands


def groom_of(length: float, wave: float) -> Groom:
    """Return ten strands of a length, with waves of a radius, on the ball head."""
    ball, strands = bristle_groom(), []
    pick = np.linspace(0, len(ball.strands) - 1, 10).astype(int)
    for root in ball.strands.roots[pick].astype(np.float64):
        way, s = root / np.linalg.norm(root), np.linspace(0, 1, 40)[:, None]
        side, turn = np.cross(way, [0.3, 0.2, 0.9]), 2 * np.pi * 4 * s
        coil = wave * (np.sin(turn) * side + (1 - np.cos(turn)) * np.cross(way, side))
        strands.append(root + length * s * way + coil)
    return replace(
        ball,
        strands=Strands.from_list(strands),
        root_triangle=ball.root_triangle[pick],
        root_barycentric=ball.root_barycentric[pick],
    )


@pytest.mark.parametrize("length", [0.001, 0.003, 0.008])
def test_hair_cut_short_keeps_its_length(length: float) -> None:
    """Shaken by 25 degrees at 1.5 Hz for a second, in both precisions: stretch below 1 %."""
    groom = groom_of(length, 0.0)
    motion = add_shakes(["yaw:25:1.5"], groom.head)
    for backend in ("reference", "fast"):
        simulator = RodSimulator(groom, Options(backend=backend))
        for frame in range(1, 61):
            simulator.advance(1 / 60, Surroundings(motion(frame / 60)))
            assert simulator.measure().stretch < 0.01


@pytest.mark.parametrize(("way", "turn"), [(0.05, 0.0), (1.0, 180.0), (0.0, 90.0), (0.05, 40.0)])
@pytest.mark.parametrize("wave", [0.0, 0.006])
def test_hair_is_whole_a_second_after_the_head_jumps(way: float, turn: float, wave: float) -> None:
    """Straight or wavy, after any jump within a frame: finite, and stretch below 1 %."""
    groom = groom_of(0.15, wave)
    head = np.eye(4)
    head[:3, :3] = quaternion.to_matrix(quaternion.from_axis([0.0, 1.0, 0.0], np.radians(turn)))
    head[0, 3] = way
    simulator = RodSimulator(groom, Options(backend="fast"))
    for _ in range(61):
        simulator.advance(1 / 60, Surroundings(head))
    assert np.isfinite(simulator.points).all()
    assert simulator.measure().stretch < 0.01


def test_a_fast_head_takes_finer_steps_and_a_jump_is_cut() -> None:
    """Steps double with the way of the roots, to a bound; farther than that the head is cut."""
    roots, found = np.array([[0.0, 0.1, 0.0]]), []
    for way in (0.0, 0.01, 0.03, 0.11, 1.01 * FARTHEST):
        end = np.eye(4)
        end[0, 3] = way
        found.append(finer_steps(np.eye(4), end, roots, 0.01, 4))
    assert found == [1, 1, 2, FINEST, 0]
    turned = np.diag([-1.0, 1.0, -1.0, 1.0])
    assert finer_steps(np.eye(4), turned, roots, 0.01, 4) == 0


def test_long_hair_falls_where_the_head_faces_down() -> None:
    """Pitched by 80 degrees for three seconds: tips hang 0.6 to 1 of the length below roots."""
    groom = grow("straight", default_head(), 60, 0)
    simulator, neck = RodSimulator(groom, Options(backend="fast")), groom.head.joints[1]
    for frame in range(240):
        head, angle = np.eye(4), np.radians(min(80.0, 80 * (frame + 1) / 60))
        head[:3, :3] = quaternion.to_matrix(quaternion.from_axis([1.0, 0.0, 0.0], angle))
        head[:3, 3] = neck - head[:3, :3] @ neck
        simulator.advance(1 / 60, Surroundings(head))
    own = simulator.strands
    height = simulator.points[:, 1]
    drop = (height[own.offsets[:-1]] - height[own.offsets[1:] - 1]) / own.lengths()
    assert 0.6 < np.median(drop) <= 1.0
