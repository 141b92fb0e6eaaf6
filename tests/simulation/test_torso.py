"""Laws of hair on shoulders: the torso stays when the head turns and keeps hair out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hairkit_plugins import pbd, rods, super_helix

from hairkit.arrays import Float64Array
from hairkit.head_model.bust import bust_under
from hairkit.head_model.bvh import build_tree, inside_surface, nearest_on_surface
from hairkit.head_model.template import default_head
from hairkit.simulation import Simulator, Surroundings, add_shakes
from hairkit.simulation.obstacle_kernels import Drawn, draw_points, nearest_body
from hairkit.simulation.obstacles import Bodies, groom_bodies, head_obstacles
from hairkit.simulation.rigid_motion import inverse_motion
from hairkit.synth import grow
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom

SIMULATORS: dict[str, Callable[[Groom], Simulator]] = {
    "pbd": lambda groom: pbd.make_simulator(groom, pbd.Options()),
    "rods": lambda groom: rods.make_simulator(groom, rods.Options(backend="fast")),
    "rods reference": lambda groom: rods.make_simulator(groom, rods.Options(backend="reference")),
    "super_helix": lambda groom: super_helix.make_simulator(groom, super_helix.Options()),
}


@pytest.fixture(scope="module")
def groom() -> Groom:
    """Return few strands of long straight hair, which lies on the shoulders."""
    return grow("straight", default_head(), 60, 0)


@pytest.fixture(scope="module")
def bodies(groom: Groom) -> Bodies:
    """Return what they touch."""
    return groom_bodies(groom)


def test_the_torso_is_the_bust_that_is_drawn(groom: Groom, bodies: Bodies) -> None:
    """Its distances are those to the bust's surface, to a fifth of a cell."""
    bust = bust_under(groom.head, groom.strands)
    assert bust is not None
    assert bodies.torso is not None
    rng = np.random.default_rng(0)
    near = bust.vertices[rng.integers(len(bust.vertices), size=300)].astype(np.float64)
    points = near[near[:, 1] < -0.21] + rng.uniform(-0.01, 0.01, 3)
    tree = build_tree(bust.vertices.astype(np.float64), bust.faces)
    exact = nearest_on_surface(tree, points)[2]
    exact[inside_surface(tree, points)] *= -1
    off = np.abs(bodies.torso.at(points)[0] - exact)
    assert np.quantile(off, 0.95) < 0.2 * bodies.torso.grid.spacing
    assert bodies.torso.at(groom.strands.points)[0].min() > -0.001


def test_shoulders_belong_to_the_torso(groom: Groom, bodies: Bodies) -> None:
    """Under a head that ends at its neck no part of the head's obstacle reaches out sideways."""
    shoulder = np.array([[0.15, -0.31, -0.03]])
    assert head_obstacles(groom.head).at(shoulder)[0] < 0
    assert bodies.head.at(shoulder)[0] > 0.05
    assert bodies.at(shoulder)[0] < 0


def test_a_head_without_a_neck_has_no_torso() -> None:
    """A ball is the obstacle that it was."""
    ball = bristle_groom()
    bodies = groom_bodies(ball)
    assert bodies.torso is None
    np.testing.assert_array_equal(bodies.head.distance, head_obstacles(ball.head).distance)


def test_compiled_distances_are_those_of_the_reference(bodies: Bodies) -> None:
    """Anywhere near head and torso, however the head is turned."""
    rng = np.random.default_rng(1)
    pose = inverse_motion(add_shakes(["pitch:30:1"], default_head())(0.2))
    points = rng.uniform([-0.2, -0.4, -0.15], [0.2, 0.1, 0.15], (500, 3))
    distance, normal, _ = bodies.at(points, pose)
    found = np.array([nearest_body(bodies.fields, pose, *point, 1e9) for point in points])
    np.testing.assert_allclose(found[:, 0], distance, atol=1e-7)
    np.testing.assert_allclose(found[:, 1:], normal * (distance < 1)[:, None], atol=1e-5)


def test_drawn_points_keep_their_lengths_and_stay_out(groom: Groom, bodies: Bodies) -> None:
    """Curves through the torso become strands along it, of the same lengths."""
    strands = groom.strands
    points = strands.points.astype(np.float64)
    length = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    length[strands.offsets[:-1]] = 0.0
    least = np.minimum(bodies.at(points)[0], 0.001)
    shifted = points.copy()
    below = np.clip((-0.12 - points[:, 1]) / 0.1, 0, 1)
    shifted[:, [0, 2]] *= 1 - 0.12 * below[:, None]  # into the chest
    assert (least - bodies.at(shifted)[0]).max() > 0.005
    drawn = Drawn(strands.offsets, length, least)
    draw_points(0, len(strands), drawn, bodies.fields, np.eye(4), shifted)
    size = np.linalg.norm(np.diff(shifted, axis=0, prepend=shifted[:1]), axis=1)
    inner = length > 0
    np.testing.assert_allclose(size[inner], length[inner], rtol=1e-6)
    assert (least - bodies.at(shifted)[0]).max() < 0.001


@pytest.mark.parametrize("method", ["pbd", "rods", "super_helix"])
@pytest.mark.parametrize("shake", ["yaw:35:1.5", "pitch:25:1.5"])
def test_no_drawn_point_gets_into_shoulders(
    groom: Groom, bodies: Bodies, method: str, shake: str
) -> None:
    """Of long hair on a shaken head: 1 mm at most, and the torso does not go with the head."""
    simulator, motion = SIMULATORS[method](groom), add_shakes([shake], groom.head)
    least, moved = np.minimum(bodies.at(groom.strands.points)[0], 0.0), 0.0
    for frame in range(40):
        head = motion((frame + 1) / 60)
        simulator.advance(1 / 60, Surroundings(head))
        local = (simulator.points - head[:3, 3]) @ head[:3, :3]
        depth = float((least - bodies.at(local, head)[0]).max())
        assert depth < 0.001
        assert simulator.measure().depth == pytest.approx(max(depth, 0.0), abs=2e-5)
        moved = max(moved, float((least - bodies.at(local)[0]).max()))
    assert moved > 0.005  # it would be deep in a torso that turned with the head


@pytest.mark.parametrize(
    "method", sorted(SIMULATORS.keys() - {"pbd"})
)  # it falls past the shoulders
def test_hair_pushed_at_the_back_stays_on_it(groom: Groom, bodies: Bodies, method: str) -> None:
    """Gravity towards the front presses hair onto the back, not through it."""
    simulator, depth = SIMULATORS[method](groom), []
    for _ in range(10 if method == "rods reference" else 30):
        simulator.advance(1 / 60, Surroundings(gravity=np.array([0.0, -9.8, 15.0])))
        depth.append(simulator.measure().depth)
    assert max(depth) < 0.001
    assert touching(simulator.points.astype(np.float64), bodies) > 20


def touching(points: Float64Array, bodies: Bodies) -> int:
    """Return how many points are within 4 mm of the torso."""
    distance, _, on_torso = bodies.at(points)
    return int((on_torso & (distance < 0.004)).sum())
