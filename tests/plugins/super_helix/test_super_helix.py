"""Laws of the super-helix simulator as a plugin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hairkit_plugins.super_helix import Options
from hairkit_plugins.super_helix.simulator import SuperHelices

from hairkit import parallel
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.simulation import Grab, Simulator, Surroundings, quaternion
from hairkit.simulation.obstacles import head_obstacles
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

FEW = Options(elements=4, hair_friction=0.0, hair_push=0.0)


def hanging() -> Groom:
    """Return the small groom with its hair at half its stiffness, combed outwards and down."""
    groom = bristle_groom()
    roots = groom.strands.roots.astype(np.float64)
    out = roots / np.linalg.norm(roots, axis=1, keepdims=True)
    s = np.linspace(0, 1, 12)[:, None]
    strands = [
        root + 0.12 * (s * direction * [1, 0.3, 1] + s * s * np.array([0.0, -0.6, 0.0]))
        for root, direction in zip(roots, out, strict=True)
    ]
    return dataclasses.replace(groom, strands=Strands.from_list(strands))


def turned(angle: float, shift: float = 0.0) -> np.ndarray:
    """Return a head turned about the up axis and moved sideways."""
    head = np.eye(4)
    head[:3, :3] = quaternion.to_matrix(quaternion.from_axis(np.array([0.0, 1, 0]), angle))
    head[0, 3] = shift
    return head


def test_it_keeps_the_contract(manager: Manager) -> None:
    """The hook makes a simulator whose points start as the groom's strands."""
    groom = bristle_groom()
    simulator = manager.call("make_simulator", "super_helix", groom=groom)
    assert isinstance(simulator, Simulator)
    np.testing.assert_allclose(simulator.points, groom.strands.points, rtol=0, atol=1e-6)
    assert simulator.time == 0.0


def test_the_captured_shape_rests_under_gravity() -> None:
    """Nothing moves on a still head: inverse statics, contact and neighbours at rest."""
    simulator = SuperHelices(hanging(), Options(elements=0))
    for _ in range(30):
        simulator.advance(1 / 60, Surroundings())
    np.testing.assert_allclose(simulator.points, hanging().strands.points, rtol=0, atol=1e-6)
    measured = simulator.measure()
    assert measured.stretch < 1e-5
    assert measured.kinetic_energy < 1e-15
    assert measured.potential_energy == pytest.approx(0, abs=1e-12)


def test_nothing_stretches_on_a_shaken_head() -> None:
    """Points keep their distances along the strand, to float32."""
    simulator = SuperHelices(hanging(), FEW)
    most = 0.0
    for frame in range(60):
        head = turned(0.5 * np.sin(0.2 * frame))
        simulator.advance(1 / 60, Surroundings(head))
        most = max(most, simulator.measure().stretch)
    assert most < 1e-4
    moved = np.abs(simulator.points - hanging().strands.points @ head[:3, :3].T).max()
    assert moved > 1e-3


def test_roots_follow_the_head() -> None:
    """Roots are rigid on the head, wherever it goes."""
    simulator = SuperHelices(hanging(), FEW)
    head = turned(0.3, 0.02)
    simulator.advance(1 / 30, Surroundings(head))
    roots = simulator.points[simulator.strands.offsets[:-1]]
    expected = simulator.strands.roots @ head[:3, :3].T + head[:3, 3]
    np.testing.assert_allclose(roots, expected, rtol=0, atol=1e-6)


def test_reset_puts_hair_at_rest_on_the_head() -> None:
    """After a reset it is as new, turned with the head."""
    simulator = SuperHelices(hanging(), FEW)
    simulator.advance(1 / 60, Surroundings(turned(0.4), np.array([3.0, 0, 0])))
    simulator.reset(turned(0.2))
    expected = simulator.strands.points @ turned(0.2)[:3, :3].T
    np.testing.assert_allclose(simulator.points, expected, rtol=0, atol=1e-6)
    assert simulator.time == 0
    assert simulator.measure().kinetic_energy == 0


def test_hair_comes_back_after_a_shake() -> None:
    """Shaken and left alone it rests near where it was."""
    simulator = SuperHelices(hanging(), dataclasses.replace(FEW, air_drag=8.0))
    for frame in range(150):
        simulator.advance(1 / 60, Surroundings(turned(0.4 * np.sin(0.3 * min(frame, 21)))))
    np.testing.assert_allclose(
        simulator.points,
        hanging().strands.points @ turned(0.4 * np.sin(6.3))[:3, :3].T,
        rtol=0,
        atol=2e-3,
    )


def test_wind_blows_hair_along() -> None:
    """Tips go with the wind, more in more wind."""
    shifts = []
    for speed in (0.0, 2.0, 4.0):
        simulator = SuperHelices(hanging(), dataclasses.replace(FEW, air_drag=6.0))
        for _ in range(40):
            simulator.advance(1 / 60, Surroundings(wind=np.array([0, 0, speed]), turbulence=0.1))
        ends = simulator.points[simulator.strands.offsets[1:] - 1]
        shifts.append((ends - simulator.strands.tips)[:, 2].mean())
    assert shifts[0] == pytest.approx(0, abs=1e-6)
    assert shifts[0] < shifts[1] < shifts[2]


def test_the_head_keeps_hair_out() -> None:
    """Limp hair that falls on the head stays on it, within a few millimetres."""
    groom = hanging()
    obstacles = head_obstacles(groom.head)
    limp = dataclasses.replace(FEW, elements=6, stiffness=0.1)
    depths: list[float] = []
    for contact in (True, False):
        simulator = SuperHelices(groom, dataclasses.replace(limp, contact=contact))
        for _ in range(40):
            simulator.advance(1 / 60, Surroundings(gravity=np.array([0.0, -9.81, -40.0])))
        allowed = np.minimum(obstacles.at(groom.strands.points)[0], 0.0)
        depths.append(float((allowed - obstacles.at(simulator.points)[0]).max()))
    assert depths[0] < 0.003
    assert depths[1] > 0.005


def test_a_grabbed_point_comes_to_the_hand() -> None:
    """Within reach the held point goes where it is pulled, and its strand's root stays."""
    simulator = SuperHelices(hanging(), FEW)
    point = int(simulator.strands.offsets[1] - 1)
    target = simulator.points[point] + np.array([0.01, 0.01, 0.0])
    for _ in range(60):
        simulator.advance(1 / 60, Surroundings(grabs=(Grab(point, tuple(target)),)))
    assert np.linalg.norm(simulator.points[point] - target) < 0.008
    np.testing.assert_allclose(simulator.points[0], simulator.strands.roots[0], atol=1e-6)
    with pytest.raises(InputError, match="grab of point"):
        simulator.advance(1 / 60, Surroundings(grabs=(Grab(10**9, (0, 0, 0)),)))


def test_frames_do_not_depend_on_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """One thread or two: the same bits."""
    results = []
    for threads in (1, 2):
        monkeypatch.setattr(parallel, "thread_count", lambda threads=threads: threads)
        simulator = SuperHelices(hanging(), Options(elements=3))
        for frame in range(5):
            simulator.advance(1 / 60, Surroundings(turned(0.05 * frame)))
        results.append(simulator.points)
    np.testing.assert_array_equal(*results)


def test_hair_takes_on_the_speed_of_hair_around(rng: np.random.Generator) -> None:
    """Hair that moves as one is left alone; speeds that differ come nearer, momentum stays."""
    options = Options(elements=4, hair_friction=60.0, hair_push=0.0)
    simulator = SuperHelices(bristle_groom(), options)
    motion, masses = simulator._motion, simulator._rods.masses
    motion.velocity[:] = [0.1, 0.2, -0.3]
    simulator._mix(0.1)
    np.testing.assert_allclose(motion.velocity - [0.1, 0.2, -0.3], 0.0, atol=1e-12)
    before = rng.normal(size=motion.velocity.shape)
    motion.velocity[:] = before
    simulator._mix(0.1)
    assert motion.velocity.std() < 0.7 * before.std()
    momentum = [(masses[..., None] * v).sum(axis=(0, 1)) for v in (before, motion.velocity)]
    np.testing.assert_allclose(*momentum, atol=0.01 * masses.sum())


def test_hair_is_drawn_to_where_that_beside_has_gone(rng: np.random.Generator) -> None:
    """What has moved alike, with the head or not, feels nothing; what has not comes nearer."""
    simulator = SuperHelices(bristle_groom(), FEW)
    motion, rest = simulator._motion, simulator._motion.points.copy()
    motion.points[:] = rest + np.array([0.01, -0.02, 0.005])
    simulator._mix(0.1)
    np.testing.assert_allclose(motion.velocity, 0.0, atol=1e-12)
    apart = rng.normal(0, 0.005, rest.shape)
    motion.points[:] = rest + apart
    simulator._mix(0.1)
    assert (motion.velocity * apart).sum() < -0.3 * 200 * 0.1 * (apart**2).sum()
    np.testing.assert_array_equal(motion.velocity, motion.velocity_before)


def test_retuning_keeps_positions() -> None:
    """Sliders change what comes, not what is."""
    simulator = SuperHelices(hanging(), FEW)
    simulator.advance(1 / 60, Surroundings(turned(0.2)))
    before = simulator.points
    simulator.retune(dataclasses.replace(FEW, stiffness=40.0))
    np.testing.assert_array_equal(simulator.points, before)


def test_bad_input_is_refused() -> None:
    """Times go on."""
    simulator = SuperHelices(hanging(), FEW)
    with pytest.raises(InputError, match="above 0"):
        simulator.advance(0.0, Surroundings())


def test_guides_without_length_ride_on_the_head() -> None:
    """Their points stay at their roots, wherever the head goes."""
    groom, head = hanging(), turned(0.2)
    dots = Strands(np.repeat(groom.strands.roots, 2, axis=0), np.arange(len(groom.strands) + 1) * 2)
    simulator = SuperHelices(dataclasses.replace(groom, strands=dots), FEW)
    simulator.advance(1 / 60, Surroundings(head))
    wanted = dots.points @ head[:3, :3].T + head[:3, 3]
    np.testing.assert_allclose(simulator.points, wanted, atol=1e-6)
