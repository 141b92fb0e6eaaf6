"""Laws of the tracker beyond its walk: first directions, trimming, smoothing, waves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.certainty_tracker import Options, smooth_strands, trim_u_turns
from tracked_ball import (
    BALL,
    CENTRES,
    DISTANCE,
    FREE,
    GRID,
    UP,
    constant,
    crown,
    field_along,
    filled,
    polylines,
    roots_where,
    run,
    with_normals,
)

from hairkit.arrays import Float32Array, Float64Array
from hairkit.testing import scalp_roots, turn_scene
from hairkit.types.head import Roots
from hairkit.types.waves import Waves


def bent_starts(normals: Float64Array, bend_deg: float) -> Float64Array:
    """First directions: where no field is known, blind strands keep them."""
    empty = field_along(np.zeros(3), 0 * DISTANCE)
    options = replace(FREE, start="bent_normal", bend_deg=bend_deg, blind_steps=6, clearance=0.0)
    points = polylines(run(empty, filled(), with_normals(normals), options))
    steps = np.diff(points, axis=1)
    np.testing.assert_allclose(steps, np.repeat(steps[:, :1], steps.shape[1], axis=1), atol=1e-5)
    direction: Float64Array = points[:, -1] - points[:, 0]
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


@pytest.mark.parametrize("bend_deg", [0.0, 30.0, 50.0])
def test_bent_normals_lean_down_by_the_bend(bend_deg: float) -> None:
    """The start is the normal turned towards the ground in the vertical plane that holds it."""
    normals = np.array([[1.0, 0, 0], [0, 0, -1], [0.6, 0.8, 0], [0.48, 0.6, 0.64]])
    start = bent_starts(normals, bend_deg)
    np.testing.assert_allclose(
        np.sum(start * normals, axis=1), np.cos(np.radians(bend_deg)), atol=1e-3
    )
    np.testing.assert_allclose(np.cross(normals, start) @ UP, 0, atol=1e-3)
    if bend_deg:
        assert (start[:, 1] < normals[:, 1] - 0.05).all()


@pytest.mark.parametrize("height", [1.0, -1.0])
def test_where_no_side_is_lower_the_normal_stays(height: float) -> None:
    """Straight above and below the head the axis of the bend vanishes."""
    np.testing.assert_allclose(bent_starts(height * UP[None], 50.0), height * UP[None], atol=1e-4)


def heights(*steps: float) -> tuple[Float32Array, np.ndarray]:
    """One strand whose heights change by these steps, padded with a point that is not its own."""
    y = np.concatenate([[0.0], np.cumsum(steps), [1e3]])
    points = np.zeros((1, len(y), 3), np.float32)
    points[0, :, 1] = y
    points[0, :, 0] = np.arange(len(y))
    return points, np.array([len(steps) + 1])


def trimmed_twin(steps: list[float], mu: float) -> int:
    """The thesis's rule in words of a loop; returns the number of points that stay."""
    first_down = next((k for k, step in enumerate(steps) if step < 0), None)
    if first_down is None:
        return len(steps) + 1
    ups = [k for k in range(first_down + 1, len(steps)) if steps[k] > 0]
    if len(ups) > mu * max(len(steps) - first_down - 1, 1):
        return max(ups[0] + 1, 2)
    return len(steps) + 1


def test_strands_that_turn_up_into_a_u_are_cut_at_its_bottom() -> None:
    """Ten steps down and ten up leave the ten down; the points that stay are not moved."""
    points, counts = heights(*[-1] * 10, *[1] * 10)
    same, kept = trim_u_turns(points, counts, 0.3)
    assert kept.tolist() == [11]
    np.testing.assert_array_equal(same, points)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_trimming_follows_the_rule_of_the_thesis(share: float) -> None:
    """Random strands, up first or down first, have as many points left as the loop says."""
    rng = np.random.default_rng(6)
    for _ in range(60):
        steps = rng.choice([-1.0, -1.0, 0.0, 1.0], rng.integers(2, 25)).tolist()
        points, counts = heights(*steps)
        assert trim_u_turns(points, counts, share)[1].tolist() == [trimmed_twin(steps, share)]


@pytest.mark.parametrize(
    "steps", [[1] * 8, [-1] * 8, [1, 1, 1, -1, -1, -1], [-1] * 9 + [1, 1], [0, 0, 0]]
)
def test_rising_falling_and_little_curled_strands_are_nottrim_u_turns(steps: list[int]) -> None:
    """Up then down is an arch, no U; a tip that turns up a little may."""
    points, counts = heights(*steps)
    assert trim_u_turns(points, counts, 0.3)[1].tolist() == [len(steps) + 1]
    bowl, full = heights(-1, 1, 1, 1)
    assert trim_u_turns(bowl, full, 1.0)[1].tolist() == [5]


def test_tracked_strands_are_trimmed_and_the_option_keeps_them() -> None:
    """In a field that circles, strands rise, fall and rise again; trimmed, they end below."""
    x, y = CENTRES[..., 0] - 0.1, CENTRES[..., 1] - 0.1
    circle = np.stack([y, -x, 0 * x], axis=-1)
    circle /= np.maximum(np.linalg.norm(circle, axis=-1, keepdims=True), 1e-9)
    field = field_along(circle, CENTRES[..., 0])
    roots = roots_where(lambda n: (n[:, 1] > 0.8) & (np.abs(n[:, 2]) < 0.3))
    options = replace(FREE, max_length=0.5, max_turn_deg=80)
    whole, cut = (run(field, filled(), roots, replace(options, u_share=u)) for u in (1.0, 0.3))
    shorter = cut.lengths() < whole.lengths() - 0.01
    assert shorter.any()
    rise = np.diff(polylines(cut)[shorter][:, :, 1], axis=1)
    assert (rise[:, -2] < 0).all()


def test_smoothing_keeps_root_and_length_and_takes_off_the_zigzag() -> None:
    """Every segment keeps its length; angles between segments shrink, more with each pass."""
    rng = np.random.default_rng(7)
    walk = np.cumsum(rng.normal((0, -0.005, 0), 0.003, (20, 30, 3)), axis=1)
    points = walk.astype(np.float32)

    def roughness(lines: Float32Array) -> float:
        edges = np.diff(lines.astype(np.float64), axis=1)
        edges /= np.linalg.norm(edges, axis=2, keepdims=True)
        return float(np.arccos(np.clip(np.sum(edges[:, 1:] * edges[:, :-1], axis=2), -1, 1)).mean())

    before = np.linalg.norm(np.diff(points, axis=1), axis=2)
    rough = [roughness(points)]
    for iterations in (1, 5):
        smooth = smooth_strands(points, iterations)
        np.testing.assert_array_equal(smooth[:, 0], points[:, 0])
        after = np.linalg.norm(np.diff(smooth, axis=1), axis=2)
        np.testing.assert_allclose(after, before, atol=1e-6)
        rough.append(roughness(smooth))
    assert rough[2] < 0.7 * rough[1] < 0.7 * 0.8 * rough[0]
    np.testing.assert_array_equal(smooth_strands(points, 0), points)


def test_smoothing_leaves_straight_strands() -> None:
    """A line has nothing to smooth, however uneven its segments."""
    t = np.cumsum(np.random.default_rng(8).uniform(0.001, 0.01, 20))
    line = (t[None, :, None] * np.array([0.6, -0.8, 0.0])).astype(np.float32)
    np.testing.assert_allclose(smooth_strands(line, 5), line, atol=1e-6)


@pytest.mark.parametrize("clearance", [0.0, 0.001, 0.004])
@pytest.mark.parametrize("wound", [False, True])
def test_strands_stay_out_of_the_head(clearance: float, wound: bool) -> None:
    """Where the field leads through the head they go round, at the clearance; also when wound."""
    waves = Waves(0.008, 0.04, 0.3)
    roots = scalp_roots(turn_scene().head)
    options = Options(clearance=clearance, waves=wound, max_length=0.4)
    strands = run(constant(np.array([0.1, -1.0, 0.2])), filled(), roots, options, waves)
    free = np.ones(len(strands.points), bool)
    free[strands.offsets[:-1]] = False
    distance = np.linalg.norm(strands.points[free], axis=1) - BALL
    assert distance.min() > clearance - 0.0007  # the distance is interpolated in cells of 1 cm
    assert GRID.sample(filled().head_distance, strands.points[free]).min() > clearance - 1e-4
    assert np.median(strands.tips[:, 1]) < -0.1


def test_waves_are_wound_unless_the_option_says_no() -> None:
    """Wound strands start at the same roots and are longer by about the length of the helix."""
    waves = Waves(0.006, 0.04, 0.3)
    roots = roots_where(crown)
    options = replace(FREE, max_length=0.15, points=200)
    plain, wound = (
        run(constant(UP), filled(), roots, replace(options, waves=w), waves) for w in (False, True)
    )
    np.testing.assert_array_equal(plain.roots, wound.roots)
    helix = np.hypot(1, 2 * np.pi * waves.radius / waves.pitch)
    ratio = (wound.lengths() / plain.lengths()).mean()
    assert 1 + 0.75 * (helix - 1) < ratio < helix


def test_a_strand_does_not_depend_on_how_many_others_are_tracked() -> None:
    """Some of the roots, tracked alone, give exactly the strands that they give among all."""
    roots, waves = scalp_roots(turn_scene().head), Waves(0.006, 0.04, 0.0)
    some = np.random.default_rng(0).permutation(len(roots))[:15]
    few = Roots(
        roots.positions[some],
        roots.normals[some],
        roots.uv[some],
        roots.triangle[some],
        roots.barycentric[some],
    )
    among, alone = (
        run(constant(np.array([0.1, -1.0, 0.2])), filled(), r, Options(max_length=0.2), waves)
        for r in (roots, few)
    )
    np.testing.assert_array_equal(among.select(some).points, alone.points)
