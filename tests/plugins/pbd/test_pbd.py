"""Laws of position-based dynamics as a plugin."""

from __future__ import annotations

import numpy as np
import pytest
from hairkit_plugins.pbd import Options
from hairkit_plugins.pbd.simulator import PbdSimulator
from hypothesis import given, settings
from hypothesis import strategies as st
from random_hair import DEEDS, FAR, KINDS, STEPS, Happening, endure, groom_of

from hairkit import parallel
from hairkit.arrays import Float64Array
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.simulation import Grab, Simulator, Surroundings, add_shakes, quaternion
from hairkit.simulation.rigid_motion import interpolate_motion
from hairkit.synth import StyleName, grow
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom

FRAME = 1 / 60
STILL = Surroundings()


@pytest.fixture(scope="module")
def groom() -> Groom:
    """Return a few strands of long straight hair."""
    return grow("straight", default_head(), 60)


def shaken(simulator: Simulator, groom: Groom, frames: int, parts: int = 1) -> float:
    """Shake the head, each frame in so many parts; return the largest stretch."""
    motion, stretch = add_shakes(["yaw:25:1.5:2"], groom.head), 0.0
    for frame in range(frames):
        poses = motion(frame * FRAME), motion((frame + 1) * FRAME)
        for part in range(1, parts + 1):
            head = interpolate_motion(*poses, part / parts)
            simulator.advance(FRAME / parts, Surroundings(head))
        stretch = max(stretch, simulator.measure().stretch)
    return stretch


def test_it_keeps_the_contract(manager: Manager, caplog: pytest.LogCaptureFixture) -> None:
    """The hook makes a simulator whose points start as the groom's strands.

    It says that the name meant another method before.
    """
    groom = bristle_groom()
    simulator = manager.call("make_simulator", "pbd", groom=groom)
    assert isinstance(simulator, Simulator)
    np.testing.assert_allclose(simulator.points, groom.strands.points, rtol=0, atol=1e-6)
    assert simulator.time == 0.0
    assert simulator.options.friction == groom.physics.friction
    assert caplog.messages == [
        "pbd is position-based dynamics since 0.3; what was pbd is rods, the default"
    ]


@pytest.mark.parametrize("style", ["straight", "wavy"])
def test_hair_keeps_its_length_and_comes_back(style: StyleName) -> None:
    """Stretch stays below 1 % in a shake; three seconds later 99 of 100 points rest within 1 cm."""
    groom = grow(style, default_head(), 60)
    simulator = PbdSimulator(groom, Options())
    assert shaken(simulator, groom, 300) < 0.01
    off = np.linalg.norm(simulator.points - groom.strands.points, axis=1)
    assert np.percentile(off, 99) < 0.01
    assert simulator.measure().kinetic_energy < 1e-8


def test_more_substeps_stretch_less(groom: Groom) -> None:
    """Four times the substeps, less than half the stretch."""
    few, many = (
        shaken(PbdSimulator(groom, Options(substeps=substeps)), groom, 40) for substeps in (4, 16)
    )
    assert many < 0.5 * few


def test_captured_hair_is_in_balance() -> None:
    """In float64 and many substeps nothing moves: segments and the captured shape bear gravity."""
    groom = grow("curly", default_head(), 20)
    simulator = PbdSimulator(groom, Options(substeps=128), np.float64)
    for _ in range(10):
        simulator.advance(FRAME, STILL)
    assert np.abs(simulator.points - groom.strands.points).max() < 1e-4
    unborne = PbdSimulator(groom, Options(borne=0.0, stiffness=0.0))
    for _ in range(10):
        unborne.advance(FRAME, STILL)
    assert np.abs(unborne.points - groom.strands.points).max() > 1e-2


@pytest.mark.parametrize("contact", [True, False])
def test_the_head_keeps_hair_out(groom: Groom, contact: bool) -> None:
    """Hair that is blown at the head stays out of it, to a millimetre; without contact it is in."""
    simulator = PbdSimulator(groom, Options(drag=10.0), contact=contact)
    bodies = PbdSimulator(groom, Options())._bodies
    least = np.minimum(bodies.at(groom.strands.points)[0], 0.001)
    for _ in range(40):
        simulator.advance(FRAME, Surroundings(wind=np.array([0.0, 0.0, -12.0])))
    depth = float((least - bodies.at(simulator.points)[0]).max())
    assert (depth < 0.001) == contact


def test_frame_rates_give_the_same_motion(groom: Groom) -> None:
    """60 or 240 steps a second: the same substeps, and the same points to a micrometre."""
    once, often = (PbdSimulator(groom, Options()) for _ in range(2))
    shaken(once, groom, 60)
    shaken(often, groom, 60, parts=4)
    assert np.abs(once.points - groom.strands.points).max() > 0.01
    np.testing.assert_allclose(often.points, once.points, rtol=0, atol=1e-6)


def test_a_turned_world_gives_turned_motion(groom: Groom) -> None:
    """Head motion, gravity and wind turned: the points are turned."""
    turn = np.eye(4)
    axis = np.array([0.6, 0.0, 0.8])
    turn[:3, :3] = quaternion.to_matrix(quaternion.from_axis(axis, 1.1))
    simulators = [PbdSimulator(groom, Options(), np.float64) for _ in range(2)]
    wind, down = np.array([2.0, 0.0, 1.0]), np.array([0.0, -9.81, 0.0])
    motion = add_shakes(["yaw:20:1.5"], groom.head)
    for simulator, pose in zip(simulators, (np.eye(4), turn), strict=True):
        simulator.reset(pose)
        for frame in range(1, 31):
            around = pose @ motion(frame * FRAME), pose[:3, :3] @ wind, 0.0, pose[:3, :3] @ down
            simulator.advance(FRAME, Surroundings(*around))
    plain, turned = (simulator.points for simulator in simulators)
    assert np.abs(plain - groom.strands.points).max() > 0.01
    np.testing.assert_allclose(turned, plain @ turn[:3, :3].T, rtol=0, atol=1e-6)


def test_wind_and_hands_move_hair(groom: Groom) -> None:
    """Tips go with the wind; a point within reach comes to the hand that pulls it."""
    simulator = PbdSimulator(groom, Options())
    for _ in range(40):
        simulator.advance(FRAME, Surroundings(wind=np.array([4.0, 0.0, 0.0])))
    ends = groom.strands.offsets[1:] - 1
    assert (simulator.points - groom.strands.points)[ends, 0].mean() > 0.01
    simulator.reset()
    target = simulator.points[ends[0]] + np.array([0.02, 0.03, 0.0])
    for _ in range(40):
        simulator.advance(FRAME, Surroundings(grabs=(Grab(int(ends[0]), tuple(target)),)))
    assert np.linalg.norm(simulator.points[ends[0]] - target) < 0.005


def test_reset_puts_hair_at_rest_on_the_head(groom: Groom) -> None:
    """After a reset it is as new, turned with the head; a head that jumps takes the hair along."""
    head = np.eye(4)
    head[:3, :3] = quaternion.to_matrix(quaternion.from_axis(np.array([0.0, 1.0, 0.0]), 0.4))
    simulator = PbdSimulator(groom, Options())
    shaken(simulator, groom, 5)
    simulator.reset(head)
    wanted: Float64Array = groom.strands.points @ head[:3, :3].T
    np.testing.assert_allclose(simulator.points, wanted, rtol=0, atol=1e-6)
    assert simulator.time == 0.0
    assert simulator.measure().kinetic_energy == 0.0
    head[:3, 3] = 100.0
    simulator.advance(FRAME, Surroundings(head))
    away = simulator.points - (wanted + head[:3, 3])
    assert np.abs(away).max() < 1e-4


def test_retuning_keeps_positions(groom: Groom) -> None:
    """Sliders change what comes, not what is; other numbers of nodes start at rest."""
    simulator = PbdSimulator(groom, Options())
    shaken(simulator, groom, 20)
    before = simulator.points
    simulator.retune(Options(bend=5000.0, damping=0.3))
    np.testing.assert_array_equal(simulator.points, before)
    simulator.retune(Options(nodes=8))
    simulator.advance(FRAME, STILL)
    assert np.isfinite(simulator.points).all()


def test_frames_do_not_depend_on_threads(monkeypatch: pytest.MonkeyPatch, groom: Groom) -> None:
    """One thread or two: the same bits."""
    results = []
    for threads in (1, 2):
        monkeypatch.setattr(parallel, "thread_count", lambda threads=threads: threads)
        simulator = PbdSimulator(grow("straight", default_head(), 150), Options())
        shaken(simulator, groom, 5)
        results.append(simulator.points)
    np.testing.assert_array_equal(*results)


@settings(max_examples=8)
@given(
    st.lists(
        st.tuples(st.sampled_from(KINDS), st.floats(-3.0, 0.18), st.integers(2, 60)),
        min_size=1,
        max_size=6,
    ),
    st.builds(Happening, st.sampled_from(DEEDS), st.sampled_from(STEPS), st.sampled_from(FAR)),
    st.integers(0, 2**31),
)
def test_any_hair_is_whole_a_second_after_anything(
    strands: list[tuple[str, float, int]], happening: Happening, seed: int
) -> None:
    """As of the other simulators, with 3 % of stretch instead of 1."""
    rng = np.random.default_rng(seed)
    simulator = PbdSimulator(groom_of(strands, rng), Options(friction=0.0))
    endure(simulator, happening, rng, 60)
    assert simulator.measure().stretch < 0.03
