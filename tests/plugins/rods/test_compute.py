"""The compute backend against the reference: one behaviour, within stated tolerances."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods import Options
from hairkit_plugins.rods.backend import FastEngine
from hairkit_plugins.rods.gl_backend import ComputeEngine
from hairkit_plugins.rods.rods import rest_state
from hairkit_plugins.rods.simulator import RodSimulator
from rods_bench import untouched
from shader_rods import AGREE, SHAKE, STILL_AIR, WIND, apart, bent_groom, both, skip_without_shaders

from hairkit.errors import HairkitError, RenderError
from hairkit.manager import Manager
from hairkit.rendering import context
from hairkit.rendering.context import renderer
from hairkit.simulation import Grab, Surroundings, add_shakes, quaternion
from hairkit.types.groom import Groom
from hairkit.types.head import Capsules


@pytest.fixture(scope="module", autouse=True)
def _drawing() -> None:
    skip_without_shaders()


@pytest.fixture(scope="module")
def groom() -> Groom:
    """Return 20 bent strands."""
    return bent_groom()


@pytest.mark.parametrize(
    ("options", "shake", "wind", "gusts"),
    [
        ({"stiffness": 0.0, "bend": 0.1}, [], STILL_AIR, 0.0),
        ({}, SHAKE, STILL_AIR, 0.0),
        ({}, [], WIND, 0.0),
        ({}, SHAKE, WIND, 0.5),
        ({"friction": 1.0, "stiffness": 0.0, "clearance": 0.004}, SHAKE, WIND, 0.0),
        ({"cohesion": 30.0, "pressure": 0.0}, SHAKE, WIND, 0.0),
        ({"cohesion": 0.0, "pressure": 20.0}, SHAKE, WIND, 0.0),
    ],
    ids=["hanging", "shaken", "wind", "gusts", "friction", "cohesion", "pressure"],
)
def test_shaders_move_hair_as_the_reference_does(
    groom: Groom, options: dict[str, object], shake: list[str], wind: np.ndarray, gusts: float
) -> None:
    """A quarter of a second on the head: no point differs by 0.02 mm."""
    pair, motion = both(groom, **options), add_shakes(shake, groom.head)
    gravity = np.array([3.0, -9.0, 0.0])  # not the groom's: hair has to move
    for frame in range(1, 16):
        for simulator in pair:
            simulator.advance(1 / 60, Surroundings(motion(frame / 60), wind, gusts, gravity))
    assert np.abs(pair[0].points - groom.strands.points).max() > 0.005
    assert apart(pair) < AGREE
    one, two = (simulator.measure() for simulator in pair)
    assert two.stretch == pytest.approx(one.stretch, abs=1e-4)
    assert two.kinetic_energy == pytest.approx(one.kinetic_energy, rel=1e-3)
    most = abs(one.potential_energy) + one.kinetic_energy
    assert two.potential_energy == pytest.approx(one.potential_energy, abs=1e-3 * most)


def test_capsules_hold_hair_off_as_in_the_reference(groom: Groom) -> None:
    """A ball in a tip's way: wind blows it elsewhere, by both backends to the same place."""
    soft = {"stiffness": 0.0, "bend": 0.1}

    def blow(*simulators: RodSimulator) -> None:
        for simulator in simulators:
            for _ in range(15):
                simulator.advance(1 / 60, Surroundings(wind=np.array([8.0, 0.0, 0.0])))

    free = both(groom, **soft)[0]
    blow(free)
    away = free.points - groom.strands.points
    tip = int(np.linalg.norm(away, axis=1).argmax())
    centre = (groom.strands.points[tip] + 0.9 * away[tip])[None].astype(np.float64)
    ball = Capsules(centre, centre + 1e-3, np.full((1, 2), 0.02))
    pair = both(replace(groom, head=replace(groom.head, capsules=ball)), **soft)
    blow(*pair)
    assert np.abs(pair[0].points - free.points).max() > 1e-3
    assert apart(pair) < AGREE


def test_captured_hair_does_not_sag(groom: Groom) -> None:
    """Two seconds under gravity move no point by 0.1 mm."""
    simulator = both(groom)[1]
    for _ in range(20):
        simulator.advance(0.1, Surroundings())
    assert np.abs(simulator.points - groom.strands.points).max() < 1e-4


def test_a_grabbed_point_goes_where_the_reference_puts_it(groom: Groom) -> None:
    """A tip drawn aside: the same places within 0.02 mm."""
    pair, tip = both(groom), int(groom.strands.offsets[9]) - 1
    target = groom.strands.points[tip] + [0.02, 0.03, 0.01]
    grab = Grab(tip, (float(target[0]), float(target[1]), float(target[2])))
    for _ in range(10):
        for simulator in pair:
            simulator.advance(1 / 60, Surroundings(grabs=(grab,)))
    assert np.linalg.norm(pair[1].points[tip] - groom.strands.points[tip]) > 0.005
    assert apart(pair) < AGREE


def test_reset_and_other_options_act_as_in_the_reference(groom: Groom) -> None:
    """Options change at once while hair stays; reset puts it at rest on the head's place."""
    pair, motion = both(groom), add_shakes(SHAKE, groom.head)
    for simulator in pair:
        simulator.advance(0.1, Surroundings(motion(0.1), WIND))
        before = simulator.points.copy()
        simulator.retune(replace(simulator.options, stiffness=0.9, drag=20.0, substeps=3))
        np.testing.assert_allclose(simulator.points, before, atol=1e-6)
        simulator.advance(0.1, Surroundings(motion(0.2), WIND))
    assert apart(pair) < AGREE
    head = motion(0.3)
    pair[1].reset(head)
    wanted = groom.strands.points @ head[:3, :3].T + head[:3, 3]
    np.testing.assert_allclose(pair[1].points, wanted, atol=1e-6)
    assert pair[1].measure().kinetic_energy == 0.0


def test_a_turned_world_gives_turned_motion(groom: Groom) -> None:
    """Head, gravity and wind turned together: the same motion turned, within 0.01 mm."""
    turn = np.eye(4)
    turn[:3, :3] = quaternion.to_matrix(quaternion.from_axis([0.48, 0.8, 0.36], 1.1))
    turn[:3, 3] = [2.0, -1.0, 0.5]
    gravity, ends = np.array([0.0, -9.81, 0.0]), []
    for frame in (np.eye(4), turn):
        simulator = RodSimulator(groom, Options(backend="compute", nodes=8))
        simulator.reset(frame)
        motion = add_shakes(SHAKE, groom.head)
        for k in range(1, 16):
            axes = frame[:3, :3]
            around = Surroundings(frame @ motion(k / 60), axes @ WIND, 0.0, axes @ gravity)
            simulator.advance(1 / 60, around)
        ends.append(simulator.points)
    np.testing.assert_allclose(ends[1], ends[0] @ turn[:3, :3].T + turn[:3, 3], atol=1e-5)


def test_equal_input_gives_equal_frames(groom: Groom) -> None:
    """Two runs in which hair rubs on hair are the same to the last bit."""
    ends = []
    for _ in range(2):
        simulator = RodSimulator(groom, Options(backend="compute", nodes=8, cohesion=20.0))
        simulator.advance(0.2, Surroundings(wind=WIND, turbulence=0.5))
        ends.append(simulator.points)
    assert (ends[0] == ends[1]).all()


def test_a_state_comes_back_as_it_was_given(groom: Groom) -> None:
    """What is set is what is read, also beyond a texture's width."""
    rods = RodSimulator(groom, Options(backend="reference", nodes=8)).rods
    many = np.arange(5000) % len(rods.points)
    fields = {name: value[many] for name, value in vars(rods).items()}
    rods = replace(rods, **fields)
    engine, wanted = ComputeEngine(rods, untouched(rods)), rest_state(rods)
    wanted.position[:, 1:] += np.linspace(0, 1, 5000)[:, None, None]
    engine.state = wanted
    np.testing.assert_allclose(engine.state.position, wanted.position, atol=1e-7)
    np.testing.assert_allclose(engine.state.frames, wanted.frames, atol=1e-6)


@pytest.mark.parametrize("card", [False, True])
def test_auto_takes_no_untimed_backend(
    groom: Groom, monkeypatch: pytest.MonkeyPatch, card: bool
) -> None:
    """Shaders have not been timed on graphics cards: `auto` takes the compiled backend there too.

    The shaders run where they are asked for by name.
    """
    monkeypatch.setattr("hairkit.rendering.context.on_graphics_card", lambda: card)
    monkeypatch.setattr("hairkit_plugins.rods.gl_backend.on_graphics_card", lambda: card)
    assert isinstance(RodSimulator(groom, Options(nodes=8))._engine, FastEngine)
    asked = RodSimulator(groom, Options(nodes=8, backend="compute"))
    assert isinstance(asked._engine, ComputeEngine)


def test_no_renderer_is_told_in_one_line(
    groom: Groom, monkeypatch: pytest.MonkeyPatch, manager: Manager
) -> None:
    """Without OpenGL the error says what to install, and `auto` goes on without it."""

    def fail(backend: str) -> None:
        raise RenderError(f"{backend} is not there")

    monkeypatch.setattr(context, "_renderer", None)
    monkeypatch.setattr(context, "_open", fail)
    with pytest.raises(HairkitError, match=r"OpenGL 4\.3") as caught:
        manager.call("make_simulator", "rods", {"backend": "compute"}, groom=groom)
    assert "\n" not in str(caught.value)
    made = manager.call("make_simulator", "rods", {"nodes": 8}, groom=groom)
    assert isinstance(made._engine, FastEngine)


def test_textures_of_a_lost_context_are_let_go(
    groom: Groom, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The end of a simulator opens no context in which to free what belonged to another one."""
    opened: list[str] = []
    made = RodSimulator(groom, Options(backend="compute", nodes=8))
    monkeypatch.setattr(context, "_renderer", None)
    monkeypatch.setattr(context, "_create", lambda: opened.append("a context"))
    del made
    gc.collect()
    assert opened == []


def test_more_rods_than_a_texture_holds_are_told_in_one_line(
    groom: Groom, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A renderer with small textures: the error says what to do instead."""
    with renderer() as gl:
        monkeypatch.setitem(gl.context.info, "GL_MAX_TEXTURE_SIZE", 16)
        with pytest.raises(RenderError, match=r"rods\.backend=fast"):
            RodSimulator(groom, Options(backend="compute", nodes=8))


_BY_OSMESA = """
import numpy as np
from hairkit_plugins.rods import Options
from hairkit_plugins.rods.simulator import RodSimulator
from rods_reference import TwinSimulator
from hairkit.rendering.context import renderer
from hairkit.simulation import Surroundings
from hairkit.testing import bristle_groom
groom, ends = bristle_groom(), []
for kind in (TwinSimulator, RodSimulator):
    simulator = kind(groom, Options(backend="compute", nodes=8))
    simulator.advance(0.1, Surroundings(wind=np.array([3.0, 0.0, 1.0])))
    ends.append(simulator.points)
with renderer() as gl:
    print(gl.backend, abs(ends[0] - ends[1]).max())
"""


def test_shaders_run_by_osmesa() -> None:
    """Where OSMesa is the only way to draw, hair moves the same."""
    environment = {
        **os.environ,
        "HAIRKIT_GL": "osmesa",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    done = subprocess.run(
        [sys.executable, "-c", _BY_OSMESA], env=environment, capture_output=True, text=True,
        timeout=200,
    )  # fmt: skip
    if "no OpenGL 4.3 context" in done.stderr:
        pytest.skip(done.stderr.strip().splitlines()[-1])
    assert done.returncode == 0, done.stderr
    backend, difference = done.stdout.split()
    assert backend == "osmesa"
    assert float(difference) < AGREE
