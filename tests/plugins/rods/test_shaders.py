"""What the shaders meet: gusts, pulls, covered points, many nodes."""

from __future__ import annotations

import numpy as np
import pytest
from hairkit_plugins.rods import Options, gl_backend
from hairkit_plugins.rods.simulator import RodSimulator
from shader_rods import AGREE, SHAKE, WIND, apart, bent_groom, both, skip_without_shaders

from hairkit.head_model.signed_distance import distance_to
from hairkit.simulation import Grab, Surroundings, add_shakes
from hairkit.types.groom import Groom


@pytest.fixture(scope="module", autouse=True)
def _drawing() -> None:
    skip_without_shaders()


@pytest.fixture(scope="module")
def groom() -> Groom:
    """Return 20 bent strands."""
    return bent_groom()


def pulled(groom: Groom, strands: list[int], back: int = 0) -> tuple[Grab, ...]:
    """Return grabs of points, the `back`-th from the tips, to places 3 cm away."""
    points = groom.strands.offsets[np.array(strands) + 1] - 1 - back
    targets = groom.strands.points[points] + np.array([0.01, 0.02, 0.02])
    return tuple(
        Grab(int(point), (float(x), float(y), float(z)))
        for point, (x, y, z) in zip(points, targets, strict=True)
    )


@pytest.mark.parametrize("nodes", [24, 40, 64])
def test_many_nodes_move_as_in_the_reference(groom: Groom, nodes: int) -> None:
    """Shaken in gusts, with loops that compilers do not unroll: no point differs by 0.02 mm."""
    pair, motion = both(groom, nodes=nodes), add_shakes(SHAKE, groom.head)
    grabs = pulled(groom, [9]) if nodes == 24 else ()
    for frame in (1, 2, 3):
        around = Surroundings(motion(frame / 60), WIND, 1.0, grabs=grabs)
        for simulator in pair:
            simulator.advance(1 / 60, around)
    still = groom.strands.points @ motion(0.05)[:3, :3].T + motion(0.05)[:3, 3]
    assert np.abs(pair[0].points - still).max() > 0.002
    assert apart(pair) < AGREE


def test_gusts_are_those_of_the_reference_far_away_and_late(groom: Groom) -> None:
    """A head 20 m off that has been there for two minutes: the same gusts, to 0.05 mm."""
    pair, head = both(groom, seed=3), add_shakes(["yaw:60:1"], groom.head)(0.2)
    head[:3, 3] += [20.0, -3.0, 7.0]
    for simulator in pair:
        simulator.reset(head)
        simulator._time = 120.0
        for _ in range(10):
            simulator.advance(1 / 60, Surroundings(head, WIND, 2.0))
    still = both(groom)[0]
    still.reset(head)
    for _ in range(10):
        still.advance(1 / 60, Surroundings(head, WIND))
    assert np.abs(pair[0].points - still.points).max() > 0.005
    assert apart(pair) < 5e-5


def test_fine_points_do_not_cut_through_the_head(groom: Groom) -> None:
    """Four nodes a guide, pressed on the head by wind: points come out as in the reference."""
    pressed = Surroundings(wind=np.array([0.0, -40.0, 0.0]))
    pair, deepest = both(groom, nodes=4, bend=0.0, stiffness=0.0), 0.0
    rest = np.minimum(distance_to(groom.head, groom.strands.points), 0.0)
    np.testing.assert_allclose(pair[1].points, groom.strands.points, atol=1e-6)
    for _ in range(40):
        pair[1].advance(1 / 60, pressed)
        inside = rest - distance_to(groom.head, pair[1].points)
        deepest = max(deepest, float(inside.max()))
    assert deepest < 0.002
    pair[0]._engine.state = pair[1]._engine.state
    pair[0]._points = None
    assert apart(pair) < AGREE
    pair[0]._drawn, pair[0]._points = pair[0]._drawn._replace(deepest=np.zeros(0)), None
    assert np.abs(pair[0].points - pair[1].points).max() > 5e-4


def test_many_held_points_go_where_the_reference_puts_them(groom: Groom) -> None:
    """Locks, two points of one node, others later, none again: the same within 0.02 mm."""
    pair = both(groom)
    tips, middles = pulled(groom, [12, 3, 19]), pulled(groom, [19, 7], 1)
    for grabs in (tips, tips + middles, middles, (), tips):
        for simulator in pair:
            for _ in range(4):
                simulator.advance(1 / 60, Surroundings(grabs=grabs))
        assert apart(pair) < AGREE
    assert np.abs(pair[0].points - groom.strands.points).max() > 0.005


def test_reset_lets_go(groom: Groom) -> None:
    """After a reset the same pull gives the same motion."""
    simulator, grabs = RodSimulator(groom, Options(backend="compute", nodes=8)), pulled(groom, [5])
    ends = []
    for _ in range(2):
        simulator.reset()
        for _ in range(6):
            simulator.advance(1 / 60, Surroundings(grabs=grabs))
        ends.append(simulator.points)
    assert (ends[0] == ends[1]).all()


def test_work_groups_beyond_one_axis_are_run_too(
    groom: Groom, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A renderer that runs one work group along x: all hair moves, all points are written."""
    pair = both(groom)
    monkeypatch.setattr(gl_backend, "MOST_GROUPS", 1)
    for simulator in pair:
        simulator.advance(0.1, Surroundings(wind=WIND, turbulence=0.5))
    assert apart(pair) < AGREE
