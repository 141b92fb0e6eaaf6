"""Laws of distances through the hair and of the direction in which hair leaves the scalp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.field.growth_prior import (
    LONG_HAIR,
    SHORT_HAIR,
    WAY_OF_HEIGHT,
    chamfer_distance,
    combing_direction,
    gradient,
    growth_potential,
    hair_ways,
    measure_scalp_distance,
)
from hairkit.testing import ball_head, scalp_roots
from hairkit.types.parting import Parting
from hairkit.types.volume import Hull, VoxelGrid

BALL = 0.1


def curtain(spacing: float = 0.01, hem: float = -0.3, thickness: float = 0.03) -> Hull:
    """Hair around the whole ball that hangs down from y = 0 as a tube to the hem."""
    low, high = np.array([-0.15, hem - 0.02, -0.15]), np.array([0.15, 0.15, 0.15])
    grid = VoxelGrid.around(low, high, spacing)
    centres = grid.centres().astype(np.float64)
    distance = np.linalg.norm(centres, axis=-1) - BALL
    tube = np.hypot(centres[..., 0], centres[..., 2]) - BALL
    gap = np.where(centres[..., 1] > 0, distance, tube)
    hair = (gap > 0) & (gap < thickness) & (centres[..., 1] > hem)
    return Hull(grid, hair, hair, distance.astype(np.float32))


def potential(hull: Hull) -> Float32Array:
    """The growth potential of hair on the ball."""
    return growth_potential(hull, measure_scalp_distance(ball_head(), hull))


def graph_way(occupied: BoolArray, start: BoolArray) -> Float64Array:
    """The shortest way by Dijkstra's algorithm on the graph of the 26 neighbours."""
    number = np.full(np.add(occupied.shape, 2), -1)
    number[1:-1, 1:-1, 1:-1][occupied] = np.arange(occupied.sum())
    rows, columns, costs = [], [], []
    for step in np.ndindex(3, 3, 3):
        shift = np.array(step) - 1
        moved = np.roll(number, tuple(shift), (0, 1, 2))
        pair = (number >= 0) & (moved >= 0) & bool(shift.any())
        rows.append(number[pair])
        columns.append(moved[pair])
        costs.append(np.full(pair.sum(), np.linalg.norm(shift)))
    count = int(occupied.sum())
    graph = coo_matrix(
        (np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns))), (count, count)
    )
    sources = np.flatnonzero(start[occupied])
    result = np.full(occupied.shape, np.inf)
    if len(sources):
        result[occupied] = dijkstra(graph.tocsr(), indices=sources, min_only=True)
    return result


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_way_along_a_straight_corridor_is_its_length(axis: int) -> None:
    """Every cell is as many steps away as it lies from the start, in both directions."""
    occupied = np.moveaxis(np.ones((30, 1, 1), bool), 0, axis)
    start = np.zeros_like(occupied)
    start.flat[10] = True
    wanted = 0.003 * np.abs(np.arange(30) - 10)
    np.testing.assert_allclose(chamfer_distance(occupied, start, 0.003).ravel(), wanted, atol=1e-6)


def test_the_way_goes_round_a_wall() -> None:
    """Behind a wall with one door the way leads through the door."""
    occupied = np.ones((11, 11, 1), bool)
    occupied[5, :10] = False
    start = np.zeros_like(occupied)
    start[4, 0] = True
    way = chamfer_distance(occupied, start, 1.0)
    assert way[6, 0, 0] == pytest.approx(2 * (8 + np.sqrt(2)) + 2, abs=1e-4)
    occupied[5, 10] = False
    assert np.isinf(chamfer_distance(occupied, start, 1.0)[6:]).all()


def test_a_maze_is_followed_to_its_end() -> None:
    """A corridor folded a dozen times is as long as unfolded."""
    occupied = np.zeros((25, 9, 1), bool)
    occupied[::2] = True
    occupied[1::4, 8] = occupied[3::4, 0] = True
    start = np.zeros_like(occupied)
    start[0, 0] = True
    way = chamfer_distance(occupied, start, 1.0)
    np.testing.assert_allclose(way, graph_way(occupied, start), rtol=1e-5)
    assert way[24].max() > 12 * 8


@given(st.integers(0, 10_000), st.floats(0.2, 1))
@settings(max_examples=25)
def test_the_way_is_that_of_dijkstra(seed: int, filled: float) -> None:
    """In any sponge; unreachable and empty cells are infinitely far."""
    rng = np.random.default_rng(seed)
    occupied = rng.random((7, 6, 8)) < filled
    start = occupied & (rng.random(occupied.shape) < 0.03)
    np.testing.assert_allclose(
        chamfer_distance(occupied, start, 1.0), graph_way(occupied, start), rtol=1e-5
    )


@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_the_gradient_of_a_linear_field_is_its_direction(slope: tuple[float, float, float]) -> None:
    """It is a unit vector, whatever the steepness; a constant has none."""
    grid = VoxelGrid.around(-np.ones(3), np.ones(3), 0.2)
    values = (grid.centres() @ np.array(slope)).astype(np.float32)
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (20, 3))
    wanted = np.tile(slope / np.linalg.norm(slope), (20, 1))
    np.testing.assert_allclose(gradient(grid, values, points), wanted, atol=1e-3)
    np.testing.assert_array_equal(gradient(grid, 0 * values + 7, points), 0)


def test_hair_is_as_long_as_the_way_along_the_curtain() -> None:
    """From the edge of the scalp to the hem; 15 cm less of curtain are 15 cm less of way."""
    head = ball_head()
    long, short = curtain(hem=-0.3), curtain(hem=-0.15)
    distance = measure_scalp_distance(head, long)
    assert 0.25 < distance.hair_length < 0.35
    shorter = measure_scalp_distance(head, short).hair_length
    assert distance.hair_length - shorter == pytest.approx(0.15, abs=0.02)
    roots = long.grid.nearest_cell(head.vertices[head.scalp > 0.5] * 1.06)
    assert distance.values[tuple(roots.T)].max() <= 3 * 0.01 * np.sqrt(3)


def test_hair_grows_towards_its_tips() -> None:
    """The potential rises all the way down the curtain and is highest at the hem."""
    hull = curtain()
    growth = potential(hull)
    assert np.isfinite(growth).all()
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    for y in (0.03, -0.03, -0.08):
        ring = np.hypot(0.115, 0) if y < 0 else np.sqrt(0.115**2 - y**2)
        points = np.stack([ring * np.sin(angle), 0 * angle + y, ring * np.cos(angle)], axis=-1)
        assert (gradient(hull.grid, growth, points)[:, 1] < -0.8).all()
    heights = hull.grid.centres()[..., 1]
    means = [growth[hull.dense & (np.abs(heights - y) < 0.006)].mean() for y in (0.1, 0.0, -0.1)]
    assert means[0] < means[1] < means[2]


def long_and_short() -> list[Hull]:
    return [curtain(hem=-0.3), curtain(0.005, hem=0.0, thickness=0.015)]


@pytest.mark.parametrize("lift", [0.0, 0.6, 2.0])
@pytest.mark.parametrize("hull", long_and_short(), ids=["long", "short"])
def test_combed_hair_leaves_the_scalp_at_the_angle_of_the_lift(hull: Hull, lift: float) -> None:
    """Directions are unit; tangential and outward part have the ratio of the lift."""
    head = ball_head()
    at = scalp_roots(head).positions * 1.05
    at = at[at[:, 1] < 0.08]
    growth = potential(hull)
    length = measure_scalp_distance(head, hull).hair_length
    combed = combing_direction(head, hull, growth, at, lift, Parting(), length)
    np.testing.assert_allclose(np.linalg.norm(combed, axis=1), 1, atol=1e-6)
    outward = gradient(hull.grid, hull.head_distance, at)
    rise = np.sum(combed * outward, axis=1)
    wanted = lift / np.hypot(1, lift)
    assert np.median(np.abs(rise - wanted)) < 0.02
    assert (combed - rise[:, None] * outward)[:, 1].max() < 0.2


def test_short_hair_is_combed_away_from_a_whorl_behind_the_crown() -> None:
    """With no length to flow along, hair at the crown leads away from the whorl on all sides."""
    head, hull = ball_head(), curtain(0.005, hem=0.0, thickness=0.015)
    flat = np.zeros(hull.grid.shape, np.float32)
    angle = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    whorl = np.array([0, 0.095, -0.03])
    around = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=-1)
    points = whorl + 0.02 * around
    combed = combing_direction(head, hull, flat, points, 0.0, Parting(), 0.0)
    assert (np.sum(combed * around, axis=1) > 0.3).all()


def test_combing_of_long_hair_follows_the_flow_wherever_it_leads() -> None:
    """A potential that grows sideways combs sideways: all hair to the subject's left."""
    head, hull = ball_head(), curtain()
    sideways = (2 * hull.grid.centres()[..., 0]).astype(np.float32)
    points = [[0.0, 0.11, 0.0], [0.0, 0.08, 0.08]]
    combed = combing_direction(head, hull, sideways, points, 0.0, Parting(), 1.0)
    assert (combed[:, 0] > 0.95).all()


def test_without_hair_on_the_scalp_the_way_is_nothing() -> None:
    """A hull that the scalp does not touch has way 0 everywhere: infinity reaches nobody."""
    hull = curtain()
    below = hull.dense & (hull.grid.centres()[..., 1] < -0.15)
    apart = replace(hull, dense=below, loose=below)
    np.testing.assert_array_equal(measure_scalp_distance(ball_head(), apart).values, 0)
    assert np.isfinite(potential(apart)).all()


def test_the_potential_of_long_hair_grows_up_to_its_hem() -> None:
    """Among the tips, too, the potential leads down the curtain: signs are not left to chance."""
    hull = curtain()
    growth = potential(hull)
    height = np.arange(-0.1, -0.27, -0.02)
    down = np.stack([np.full_like(height, 0.115), height, np.zeros_like(height)], axis=1)
    assert (np.diff(hull.grid.sample(growth, down)) > 0.1 * 0.02).all()


def test_long_hair_is_combed_from_its_parting_on_the_crown_only() -> None:
    """With a parting, hair on top leads away from it to both sides; below nothing changes."""
    head, hull = ball_head(), curtain(hem=-0.3)
    growth, parting = potential(hull), Parting.at(0.02)
    top = [[0.0, 0.098, 0.02], [0.04, 0.092, 0.02]]
    combed = combing_direction(head, hull, growth, top, 0.0, parting, 1.0)
    assert combed[0, 0] < -0.3
    assert combed[1, 0] > 0.3
    below = [[0.1, 0.02, 0.0], [-0.1, 0.0, 0.02]]
    plain, parted = (
        combing_direction(head, hull, growth, below, 0.3, line, 1.0)
        for line in (Parting(), parting)
    )
    np.testing.assert_array_equal(plain, parted)


def test_short_hair_has_no_parting() -> None:
    """Hair that ends before it could lie down is combed as before."""
    head, hull = ball_head(), curtain(0.005, hem=0.0, thickness=0.015)
    growth, at = potential(hull), scalp_roots(head).positions
    length = measure_scalp_distance(head, hull).hair_length
    plain, parted = (
        combing_direction(head, hull, growth, at, 0.3, line, length)
        for line in (Parting(), Parting.at(0.02))
    )
    np.testing.assert_array_equal(plain, parted)


def way(hull: Hull, longest: float) -> Float64Array:
    """The ways (N,) of hair on the ball."""
    nothing = np.zeros(hull.grid.shape, np.float32)
    return hair_ways(hull, nothing, scalp_roots(ball_head()), longest)


def with_tuft(hull: Hull, radius: float) -> Hull:
    """The hull with hair that stands off the top, over a radius in metres."""
    place = hull.grid.centres()
    tuft = (hull.head_distance > 0) & (np.hypot(place[..., 0], place[..., 2]) < radius)
    tuft &= hull.head_distance < 0.04
    return replace(hull, dense=hull.dense | tuft, loose=hull.loose | tuft)


def test_the_way_through_short_hair_is_that_of_most_of_it() -> None:
    """A tuft that stands off, or an outline that fits badly, makes no hair beside it longer."""
    hull = curtain(0.004, hem=0.0, thickness=0.012)
    plain = way(hull, 0.02)
    assert plain == pytest.approx(WAY_OF_HEIGHT * 0.01, rel=0.2)  # centres of the outermost cells
    tufted = way(with_tuft(hull, 0.015), SHORT_HAIR)
    beside = scalp_roots(ball_head()).positions[:, 1] < 0.09
    assert tufted[beside] == pytest.approx(plain[beside], rel=0.05)


def test_short_hair_is_as_long_as_it_is_thick_there() -> None:
    """Cropped sides do not shorten the top."""
    hull = with_tuft(curtain(0.004, hem=0.0, thickness=0.008), 0.07)
    at = scalp_roots(ball_head()).positions
    ways = way(hull, SHORT_HAIR)
    assert ways[at[:, 1] > 0.09].mean() > 2 * ways[at[:, 1] < 0.03].mean()


def test_the_way_through_long_hair_is_its_longest() -> None:
    """Its height tells nothing of its length; in between the way grows with the longest."""
    hull = curtain(thickness=0.02)
    ways = [float(way(hull, longest)[0]) for longest in (SHORT_HAIR, 0.045, LONG_HAIR, 0.3)]
    assert ways[2:] == [LONG_HAIR, 0.3]
    assert ways == sorted(ways)


def test_long_hair_may_be_as_long_as_its_own_way_to_the_tips() -> None:
    """The longest way is that from the nearest scalp: hair of the crown has farther to go."""
    hull, roots = curtain(thickness=0.02), scalp_roots(ball_head())
    growth = -hull.grid.centres()[..., 1].astype(np.float32) - np.float32(0.1)
    ways = hair_ways(hull, growth, roots, 0.12)
    np.testing.assert_allclose(ways, np.maximum(roots.positions[:, 1] + 0.1, 0.12), atol=2e-3)
