"""The rods plugin: grooms at rest, shaken, blown and held; backends against each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods import Options
from hairkit_plugins.rods.rods import Rods, State, rest_state
from hairkit_plugins.rods.simulator import RodSimulator
from rods_bench import untouched
from rods_reference import TwinSimulator

from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.head_model.signed_distance import distance_to
from hairkit.manager import Manager
from hairkit.simulation import (
    Grab,
    Simulator,
    Surroundings,
    add_shakes,
    quaternion,
    run,
    static_motion,
)
from hairkit.simulation.hair_grid import SPACING, HairGrid, make_hair_grid
from hairkit.simulation.wind import air_velocity
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands


@pytest.fixture(scope="module")
def groom() -> Groom:
    """Return 40 waved strands of 9 to 18 cm, of 20 to 39 points, on the ball head."""
    ball = bristle_groom()
    pick = np.linspace(0, len(ball.strands) - 1, 40).astype(int)
    roots = ball.strands.roots[pick].astype(np.float64)
    out = roots / np.linalg.norm(roots, axis=1, keepdims=True)
    strands = []
    for k, (root, way) in enumerate(zip(roots, out, strict=True)):
        s = np.linspace(0, 0.09 + 0.0023 * k, 20 + k // 2)[:, None]
        side = np.cross(way, [0.3, 0.2, 0.9])
        fall = np.array([0.0, -1.0, 0.0]) * s**2 * 3 + way * s
        strands.append(root + fall + 0.004 * np.sin(60 * s) * side)
    return replace(
        ball,
        strands=Strands.from_list(strands),
        root_triangle=ball.root_triangle[pick],
        root_barycentric=ball.root_barycentric[pick],
    )


@pytest.mark.parametrize("backend", ["reference", "fast"])
def test_captured_hair_does_not_sag(groom: Groom, backend: str) -> None:
    """Two seconds under gravity move no point by 0.1 mm."""
    simulator = RodSimulator(groom, Options(backend=backend))
    for _ in range(20):
        simulator.advance(0.1, Surroundings())
    assert np.abs(simulator.points - groom.strands.points).max() < 1e-4


def test_backends_agree(groom: Groom) -> None:
    """Shaken, in gusts, for half a second: no point differs by 0.02 mm.

    Without pressure, which jumps where a node comes into another cell of the hair grid.
    """
    motion = add_shakes(["yaw:25:2", "pitch:10:1.3"], groom.head)
    wind = np.array([2.0, 0.0, 1.0])
    options = Options(backend="fast", pressure=0.0)
    both = TwinSimulator(groom, options), RodSimulator(groom, options)
    for frame in range(1, 31):
        around = Surroundings(motion(frame / 60), wind, 0.4)
        for simulator in both:
            simulator.advance(1 / 60, around)
    assert np.abs(both[0].points - groom.strands.points).max() > 0.01
    assert np.abs(both[0].points - both[1].points).max() < 2e-5


def test_shaken_hair_keeps_its_length_and_stays_out_of_the_head(groom: Groom) -> None:
    """Stretch below 1 % at every frame; no node more than 2 mm inside."""
    simulator = RodSimulator(groom, Options())
    motion, deepest, stretch = add_shakes(["yaw:30:2"], groom.head), 0.0, 0.0
    rest = distance_to(groom.head, groom.strands.points)
    for frame in range(1, 61):
        head = motion(frame / 60)
        simulator.advance(1 / 60, Surroundings(head))
        stretch = max(stretch, simulator.measure().stretch)
        local = (simulator.points - head[:3, 3]) @ head[:3, :3]
        inside = np.minimum(rest, 0.0) - distance_to(groom.head, local)
        deepest = max(deepest, float(inside.max()))
    assert stretch < 0.01
    assert deepest < 0.002


@pytest.mark.parametrize("backend", ["reference", "fast"])
def test_fine_points_do_not_cut_through_the_head(groom: Groom, backend: str) -> None:
    """Four nodes a guide, pressed on the head by wind: its points are at most 2 mm inside."""
    wind, deepest = Surroundings(wind=np.array([0.0, -14.0, 0.0])), 0.0
    simulator = RodSimulator(groom, Options(backend=backend, nodes=4, bend=0.0, stiffness=0.0))
    rest = np.minimum(distance_to(groom.head, groom.strands.points), 0.0)
    np.testing.assert_allclose(simulator.points, groom.strands.points, atol=1e-6)
    for _ in range(40):
        simulator.advance(1 / 60, wind)
        inside = rest - distance_to(groom.head, simulator.points)
        deepest = max(deepest, float(inside.max()))
    assert deepest < 0.002


def test_shaken_hair_comes_back_to_rest(groom: Groom) -> None:
    """Three seconds after a short shake the hair is within 2 mm of where it was."""
    motion = add_shakes(["roll:20:2:0.5"], groom.head)
    cache = run(RodSimulator(groom, Options(friction=0.0)), motion, 210)
    away = np.linalg.norm(cache.points - groom.strands.points, axis=2).max(axis=1)
    assert away[20] > 0.01
    assert away[-1] < 0.002


def test_roots_ride_on_the_head(groom: Groom) -> None:
    """Whatever happens, a root is where the head carries it."""
    simulator = RodSimulator(groom, Options())
    head = add_shakes(["yaw:40:1"], groom.head)(0.3)
    simulator.advance(0.05, Surroundings(head, np.array([5.0, 0, 0])))
    roots = simulator.points[groom.strands.offsets[:-1]]
    wanted = groom.strands.roots @ head[:3, :3].T + head[:3, 3]
    np.testing.assert_allclose(roots, wanted, atol=1e-6)


def test_a_carried_head_carries_hair_at_rest(groom: Groom) -> None:
    """Reset on a turned and moved head: the captured shape, turned and moved, without motion."""
    simulator = RodSimulator(groom, Options())
    head = add_shakes(["yaw:90:1"], groom.head)(0.25)
    head[:3, 3] += [10.0, 0.0, -3.0]
    simulator.reset(head)
    for _ in range(10):
        simulator.advance(1 / 60, Surroundings(head))
    wanted = groom.strands.points @ head[:3, :3].T + head[:3, 3]
    np.testing.assert_allclose(simulator.points, wanted, atol=1e-4)


@pytest.mark.parametrize("backend", ["reference", "fast"])
def test_motion_does_not_depend_on_how_frames_are_cut(groom: Groom, backend: str) -> None:
    """In steady wind, one call of a tenth of a second equals six of a sixtieth."""
    around = Surroundings(wind=np.array([3.0, 0.0, 0.0]))
    one, six = (RodSimulator(groom, Options(backend=backend)) for _ in range(2))
    one.advance(0.1, around)
    for _ in range(6):
        six.advance(1 / 60, around)
    np.testing.assert_allclose(one.points, six.points, atol=1e-6)


@pytest.mark.parametrize("backend", ["reference", "fast"])
@pytest.mark.parametrize("share", [0.97, 0.8])
def test_a_grabbed_point_is_at_the_hand(groom: Groom, backend: str, share: float) -> None:
    """After 0.75 seconds a held tip is within 1 mm of a target 5 cm off; the length is kept."""
    simulator = RodSimulator(groom, Options(backend=backend))
    tip = int(groom.strands.offsets[39]) - 1
    root = groom.strands.roots[38].astype(np.float64)
    turn = quaternion.to_matrix(quaternion.from_axis([0.0, 1.0, 0.0], 0.3))
    target = root + share * turn @ (groom.strands.points[tip] - root)
    assert np.linalg.norm(groom.strands.points[tip] - target) > 0.05
    grab = Grab(tip, (target[0], target[1], target[2]))
    for _ in range(45):
        simulator.advance(1 / 60, Surroundings(grabs=(grab,)))
    assert np.linalg.norm(simulator.points[tip] - target) < 1e-3
    assert simulator.measure().stretch < 0.01


def test_a_hand_goes_no_faster_than_it_may(groom: Groom) -> None:
    """At 0.5 m/s a held tip has come 5 cm nearer after 0.1 s, to 1 cm, and no farther."""
    simulator = RodSimulator(groom, Options(backend="fast", grab_speed=0.5))
    tip = int(groom.strands.offsets[39]) - 1
    root, start = groom.strands.roots[38], groom.strands.points[tip].astype(np.float64)
    target = root + 0.9 * np.linalg.norm(start - root) * np.array([0.0, 0.0, 1.0])
    grab = Grab(tip, (float(target[0]), float(target[1]), float(target[2])))
    for _ in range(6):
        simulator.advance(1 / 60, Surroundings(grabs=(grab,)))
    way = np.linalg.norm(target - start) - np.linalg.norm(target - simulator.points[tip])
    assert np.linalg.norm(target - start) > 0.1
    assert way == pytest.approx(0.05, abs=0.01)


def test_a_hand_out_of_reach_stretches_nothing(groom: Groom) -> None:
    """A tip drawn a metre away ends on a taut strand of its own length."""
    simulator = RodSimulator(groom, Options(backend="fast"))
    tip = int(groom.strands.offsets[9]) - 1
    for _ in range(60):
        simulator.advance(1 / 60, Surroundings(grabs=(Grab(tip, (1.0, 0.5, 0.3)),)))
    assert simulator.measure().stretch < 0.01


@pytest.mark.parametrize("point", [-1, 10**9])
def test_a_grab_of_no_point_is_told(groom: Groom, point: int) -> None:
    """The error names the point and those that there are."""
    simulator = RodSimulator(groom, Options())
    with pytest.raises(InputError, match=f"grab of point {point}"):
        simulator.advance(1 / 60, Surroundings(grabs=(Grab(point, (0.0, 0.0, 0.0)),)))


def test_more_stiffness_moves_less(groom: Groom) -> None:
    """Wind blows hair less far the stiffer it is, by either option, once it has settled."""
    around = Surroundings(wind=np.array([8.0, 0.0, 0.0]))

    def blown(**options: float) -> float:
        simulator = RodSimulator(groom, Options(adhesion=0.0, **options))
        for _ in range(60):
            simulator.advance(1 / 60, around)
        return float(np.linalg.norm(simulator.points - groom.strands.points, axis=1).mean())

    assert blown(stiffness=0.9) < blown(stiffness=0.4) < blown(stiffness=0.0)
    assert blown(bend=0.9) < blown(bend=0.2)


@pytest.mark.parametrize("bend", [0.0, 1.0])
def test_the_stiffest_torsion_is_stable(groom: Groom, bend: float) -> None:
    """At the upper bound of twist, shaken hair calms down in a second and a half."""
    simulator = RodSimulator(groom, Options(backend="fast", twist=1.0, bend=bend))
    motion, energy = add_shakes(["yaw:30:2:0.5", "roll:25:3:0.5"], groom.head), []
    for frame in range(1, 121):
        simulator.advance(1 / 60, Surroundings(motion(frame / 60)))
        energy.append(simulator.measure().kinetic_energy)
    assert energy[-1] < 0.01 * max(energy)
    assert simulator.measure().stretch < 0.01


def test_retuning_keeps_the_positions(groom: Groom) -> None:
    """New options move nothing by themselves, and None is resolved by the groom."""
    simulator = RodSimulator(groom, Options())
    simulator.advance(0.1, Surroundings(wind=np.array([4.0, 0.0, 0.0])))
    before = simulator.points.copy()
    simulator.retune(Options(stiffness=0.9))
    np.testing.assert_allclose(simulator.points, before, atol=1e-6)
    assert simulator.options.stiffness == 0.9
    assert simulator.options.damping == groom.physics.damping


def test_equal_input_gives_equal_frames(groom: Groom) -> None:
    """Two runs with gusts are the same to the last bit."""
    around = Surroundings(wind=np.array([3.0, 0.0, 0.0]), turbulence=0.5)
    frames = []
    for _ in range(2):
        simulator = RodSimulator(groom, Options())
        simulator.advance(0.2, around)
        frames.append(simulator.points)
    assert (frames[0] == frames[1]).all()


def test_folded_and_tiny_strands_stay_finite(groom: Groom) -> None:
    """Strands that fold back, lie in one point or hold two points are simulated all the same."""
    root = groom.strands.roots[0].astype(np.float64)
    fold = root + np.array([[0, 0, 0], [0, 0.05, 0], [0, 0, 0], [0, 0.05, 0]])
    odd = Strands.from_list(
        [fold, np.repeat(root[None], 3, axis=0), root + np.array([[0, 0, 0], [0, 0.1, 0]])]
    )
    few = replace(
        groom,
        strands=odd,
        root_triangle=groom.root_triangle[:3],
        root_barycentric=groom.root_barycentric[:3],
    )
    cache = run(RodSimulator(few, Options()), add_shakes(["yaw:30:3"], few.head), 40)
    assert np.abs(cache.points).max() < 0.5


def test_the_plugin_makes_a_simulator(manager: Manager, groom: Groom) -> None:
    """By name it gives what the contract asks for; only guides are simulated."""
    guide = np.arange(len(groom.strands)) % 2 == 0
    mixed = replace(groom, strands=replace(groom.strands, guide=guide))
    simulator = manager.call("make_simulator", "rods", {"nodes": 8}, groom=mixed)
    assert isinstance(simulator, Simulator)
    assert len(simulator.strands) == guide.sum()
    cache = run(simulator, static_motion(), 2)
    assert cache.points.shape == (2, len(simulator.strands.points), 3)


def test_gusts_are_the_law_of_the_wind(groom: Groom) -> None:
    """At every fourth node and the last, where the head carries them, the air is `air_velocity`.

    Between them it is straight, also far from the origin.
    """
    around, head = Surroundings(wind=np.array([3.0, -1.0, 2.0]), turbulence=0.4), np.eye(4)
    head[:3] = add_shakes(["yaw:40:1"], groom.head)(0.2)[:3]
    head[:3, 3] += [4000.0, 1.0, -2.0]
    simulator = RodSimulator(groom, Options(backend="reference"))
    simulator._time = 7.3
    simulator._shadow = (0 * simulator._shadow[0], simulator._shadow[1])
    found = simulator._air(around, head)
    points = simulator.rods.points[:, [0, 4, 8, 12, 15]] @ head[:3, :3].T + head[:3, 3]
    wanted = air_velocity(points.reshape(-1, 3), 7.3, around.wind, 0.4).reshape(points.shape)
    np.testing.assert_allclose(found[:, [0, 4, 8, 12, 15]], wanted, atol=1e-5)
    np.testing.assert_allclose(found[:, 2], 0.5 * (found[:, 0] + found[:, 4]), atol=1e-6)
    assert np.abs(wanted - around.wind).max() > 0.5


def test_hair_is_drawn_to_where_the_hair_beside_it_has_gone(rng: np.random.Generator) -> None:
    """What moves alike feels nothing; what does not is drawn together, all forces in balance."""
    simulator = RodSimulator(bristle_groom(), Options(backend="reference"))
    still, free = simulator._state, np.s_[:, 1:]
    alike = np.array([0.01, -0.02, 0.005])
    simulator._state = replace(still, position=still.position + alike)
    np.testing.assert_allclose(simulator._bonds(), 0.0, atol=1e-18)
    apart = rng.normal(0, 0.01, still.position.shape)
    apart[:, 0] = 0.0
    simulator._state = replace(still, position=still.position + apart)
    bonds = simulator._bonds()
    assert (bonds[free] * apart[free]).sum() < 0
    assert np.abs(bonds).max() <= 1.01 * 200.0 * simulator.rods.mass.max() * 2 * np.abs(apart).max()
    assert not bonds[:, 0].any()


def mixed(
    grid: HairGrid, rods: Rods, state: State, head_step: Float64Array, rates: tuple[float, ...]
) -> Float64Array:
    """Return velocities (S, n, 3) after hair-hair interaction: the twin of `HairGrid.mix`."""
    cohesion, pressure, seconds = rates
    bits = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
    shape, place = np.array(grid.density.shape), state.position.reshape(-1, 3)
    drift = (place - place @ head_step[:3, :3].T - head_step[:3, 3]) / seconds
    relative = state.velocity.reshape(-1, 3) - drift
    at = np.clip((place - grid.origin) / SPACING, 0.0, shape - 1.001)
    low, t = np.floor(at).astype(int), (at % 1)[:, None]
    part = np.where(bits, t, 1 - t)
    weight, corner = part.prod(axis=-1), (low[:, None] + bits) @ [shape[1] * shape[2], shape[2], 1]
    share = weight * rods.mass.reshape(-1, 1)
    filled, *momenta = (
        np.bincount(corner.ravel(), (share * value).ravel(), shape.prod())
        for value in (np.ones((len(place), 1)), *relative.T[..., None])
    )
    cells = np.stack(momenta, axis=-1) / np.maximum(filled, 1e-30)[:, None]
    usual = grid.uncrowded_mass.ravel()
    crowd = np.clip(filled / usual - 1, 0.0, 4.0)
    others = np.stack([part[..., [1, 0, 0][k]] * part[..., [2, 2, 1][k]] for k in range(3)], -1)
    slope = np.einsum("nc,nck->nk", crowd[corner], others * (2 * bits - 1))
    mean = np.einsum("nc,nck->nk", weight, cells[corner])
    new = relative + (1 - np.exp(-cohesion * seconds)) * (mean - relative)
    result = (new - pressure * seconds * slope + drift).reshape(state.velocity.shape)
    result[:, 0] = state.velocity[:, 0]
    return result


@pytest.mark.parametrize("copies", [1, 60])
def test_hair_among_hair_moves_as_its_twin(groom: Groom, copies: int) -> None:
    """Crowded and moving, on a moving head: velocities of metres a second agree to 0.01 mm/s."""
    from hairkit_plugins.rods.backend import Engine

    rods = RodSimulator(groom, Options(backend="reference")).rods
    pick = np.tile(np.arange(len(rods.points)), copies)
    rods = replace(rods, **{name: values[pick] for name, values in vars(rods).items()})
    rng = np.random.default_rng(3)
    state = rest_state(rods)
    state = replace(
        state,
        position=0.7 * state.position + rng.normal(0, 1e-3, state.position.shape),
        velocity=rng.normal(0, 1, state.position.shape),
    )
    head_step = add_shakes(["yaw:40:1"], groom.head)(0.01)
    hair_grid = make_hair_grid(rods.points, rods.mass)
    engine = Engine(rods, untouched(rods))
    engine.state = state
    place, speed = engine.rows[..., :3], engine.rows[..., 4:7]
    hair_grid.mix(place, speed, engine.mass, head_step, (5.0, 4.0, 1 / 60))
    wanted = mixed(hair_grid, rods, state, head_step, (5.0, 4.0, 1 / 60))
    assert np.abs(wanted - state.velocity).max() > 0.05
    np.testing.assert_allclose(engine.state.velocity, wanted, atol=1e-5)
