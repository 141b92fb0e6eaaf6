"""Laws of growing strands through a signed field."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hairkit_plugins.hybrid_growth import (
    BELOW,
    BLIND,
    LEFT,
    Options,
    _grow_strands,
    grow,
    signed_volume,
    track,
)

from hairkit.arrays import Float32Array
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.testing import (
    ball_head,
    ball_mask,
    combed_field,
    scalp_roots,
    shell_hull,
)
from hairkit.types.camera import Camera
from hairkit.types.head import Roots
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.volume import OrientationField, VoxelGrid
from hairkit.types.waves import Waves

FREE = Options(slide_sine=0.0, waves=False, clearance=0.0, cover=0.0)
DISTANCE = measure_scalp_distance(ball_head(), shell_hull())
LOOSE = TiedHair()
CAMERA = Camera.on_turn(0.0, distance=1.0, focal=100.0, width=80, height=60)
SCENE = Scene(("front",), (CAMERA,), ball_head())
MASKS = (ball_mask(CAMERA),)
SHARP_CAMERA = Camera.on_turn(0.0, distance=1.2, focal=600.0, width=240, height=240)
SHARP = Scene(("front",), (SHARP_CAMERA,), ball_head())
SHARP_MASKS = (ball_mask(SHARP_CAMERA),)
GRID = VoxelGrid.around(np.full(3, -0.2), np.full(3, 0.2), 0.01)


def constant(way: tuple[float, float, float]) -> OrientationField:
    """A field of one signed direction."""
    direction = np.broadcast_to(np.array(way, np.float32), (*GRID.shape, 3))
    zero = np.zeros(GRID.shape, np.float32)
    return OrientationField(GRID, np.zeros((*GRID.shape, 6)), zero, zero, direction, zero)


STARTS = np.array([[0.0, 0, 0], [0.05, 0.02, -0.03]], np.float32)


def run(
    field: OrientationField,
    distance: Float32Array,
    options: Options,
    way: float = 0.1,
    starts: Float32Array = STARTS,
    **rest: float,
) -> Strands:
    """Strands whose ways through the hair are all `way` long."""
    assert field.direction is not None
    volume = signed_volume(field, field.direction, distance)
    return grow(field, volume, starts, np.full(len(starts), way), options, **rest)


def test_strands_follow_the_sign_of_the_field() -> None:
    """A field and its negative grow strands to opposite sides, straight and of full length."""
    inside = np.full(GRID.shape, 0.5, np.float32)
    up, down = (run(constant((0, s, 0)), inside, replace(FREE, reach=1.0)) for s in (1.0, -1.0))
    np.testing.assert_allclose((up.tips - up.roots)[:, 1], 0.1, atol=2e-3)
    np.testing.assert_allclose(up.tips - up.roots, -(down.tips - down.roots), atol=1e-6)


def test_an_integer_compiles_no_kernel_of_its_own() -> None:
    """The same code serves a share given as 0: a second compilation takes seconds."""
    inside = np.full(GRID.shape, 0.5, np.float32)
    run(constant((0, 1, 0)), inside, FREE, early=0.5)
    compiled = list(_grow_strands.signatures)
    assert compiled
    run(constant((0, 1, 0)), inside, FREE, early=0)
    assert _grow_strands.signatures == compiled


def test_a_strand_ends_where_the_internal_distance_passes_the_bound() -> None:
    """I grows linearly with x: the end lies where I is `bound`, within one step."""
    distance = (1 + GRID.centres()[..., 0]).astype(np.float32)
    options = replace(FREE, reach=5.0, blind=0.0, bound=1.1)
    found = run(constant((1, 0, 0)), distance, options, way=0.5)
    np.testing.assert_allclose(found.tips[:, 0], 0.1, atol=1.5e-3)


@pytest.mark.parametrize(("way", "end"), [((1, 0, 0), 0.1), ((0, 1, 0), 0.1), ((0, -1, 0), 0.15)])
def test_strands_that_stand_end_at_the_surface(way: tuple[float, float, float], end: float) -> None:
    """Out of side and top they end where I is `LEFT`; below, where it is `bound`."""
    distance = (1 + GRID.centres() @ np.array(way)).astype(np.float32)
    options = replace(FREE, reach=5.0, blind=0.0, bound=1.15, slide_sine=0.5)
    found = run(constant(way), distance, options, way=0.05)
    np.testing.assert_allclose(found.tips @ np.array(way), end, atol=2.5e-3)


def test_no_strand_ends_on_its_blind_way() -> None:
    """Roots lie outside what the photos show as hair: the first way is free."""
    outside = np.full(GRID.shape, 3.0, np.float32)
    found = run(constant((0, 1, 0)), outside, replace(FREE, blind=0.02))
    np.testing.assert_allclose(found.lengths(), 0.02, atol=2e-3)


def test_the_blind_way_of_short_hair_is_short() -> None:
    """It is `BLIND` times the hair's way at most."""
    outside = np.full(GRID.shape, 3.0, np.float32)
    found = run(constant((0, 1, 0)), outside, replace(FREE, blind=0.02, reach=5.0), way=0.008)
    np.testing.assert_allclose(found.lengths(), BLIND * 0.008, atol=2e-3)


def test_strands_slide_along_the_surface_they_meet_at_a_small_angle() -> None:
    """With sliding they run on along x beyond I = 1; at a large angle they leave and end."""
    distance = (1 + 10 * GRID.centres()[..., 1]).astype(np.float32)
    options = replace(FREE, slide_sine=0.35, reach=1.0, inertia=0.0, blind=0.0, bound=1.5)
    starts = np.array([[-0.1, -0.005, 0.0]], np.float32)
    flat, steep = (
        run(field, distance, options, 0.15, starts, early=0)
        for field in (constant((0.97, 0.24, 0)), constant((0.5, 0.87, 0)))
    )
    assert flat.tips[0, 0] > 0.03
    assert flat.tips[0, 1] < 0.012
    assert 0.008 < steep.tips[0, 1] < 0.013


def falling(growth: tuple[float, float, float]) -> OrientationField:
    """Hair that falls straight down, whose growth potential rises along `growth`."""
    potential = (GRID.centres() @ np.array(growth)).astype(np.float32)
    return replace(constant((0, -1, 0)), growth=potential)


@pytest.mark.parametrize(("growth", "turns"), [((1, -0.5, 0), True), ((0.2, -1, 0), False)])
def test_strands_that_meet_the_shoulders_turn_where_the_hair_goes_on(
    growth: tuple[float, float, float], turns: bool
) -> None:
    """Under the hair at y = 0, below the shoulders' height: along x if the tips lie there."""
    distance = (1 - 10 * GRID.centres()[..., 1]).astype(np.float32)
    options = replace(FREE, slide_sine=0.35, reach=1.0, inertia=0.0, blind=0.0, bound=1.3)
    starts = np.array([[-0.05, 0.03, 0.0]], np.float32)
    below, above = (
        run(falling(growth), distance, options, 0.15, starts, shoulders=height).tips[0]
        for height in (0.05, -0.1)
    )
    np.testing.assert_allclose(above, [-0.05, -0.03, 0], atol=2e-3)
    if turns:
        assert below[0] > 0.03
        assert abs(below[1]) < 0.012
    else:
        np.testing.assert_allclose(below, above, atol=1e-6)


@pytest.mark.parametrize(("way", "turns"), [(0.3, True), (0.05, False)])
def test_long_hair_is_no_stub_where_it_leaves_near_its_root(way: float, turns: bool) -> None:
    """Out of the top after 3 cm: long hair goes on where the tips lie, short hair ends there."""
    distance = (1 + 10 * GRID.centres()[..., 1]).astype(np.float32)
    growth = (GRID.centres() @ [1.0, 0.2, 0]).astype(np.float32)
    field = replace(constant((0, 1, 0)), growth=growth)
    options = replace(FREE, slide_sine=0.35, reach=1.0, blind=0.0)
    starts = np.array([[-0.1, -0.02, 0.0]], np.float32)
    grown = run(field, distance, options, way, starts)
    length, height = grown.lengths()[0], grown.tips[0, 1]
    assert length > 0.1 if turns else 0.008 < height < 0.013


def test_a_root_where_nothing_is_known_keeps_its_place() -> None:
    """One strand a root, whatever the field: a stub of two points."""
    inside = np.zeros(GRID.shape, np.float32)
    found = run(constant((0, 0, 0)), inside, FREE)
    assert len(found) == 2
    assert found.lengths().max() < 0.01


def follow_ball(options: Options, roots: Roots) -> Strands:
    hull = shell_hull()
    field = combed_field(hull.grid)
    return track(SCENE, MASKS, hull, field, roots, Waves(), DISTANCE, LOOSE, options)


def test_a_field_without_signs_is_followed_along_its_growth() -> None:
    """Hair combed down a ball, tensors only: strands run down close to the ball."""
    roots = scalp_roots(ball_head())
    found = follow_ball(replace(FREE, reach=1.0, clearance=0.001), roots)
    assert len(found) == len(roots)
    drop = (found.tips - found.roots)[:, 1]
    assert (drop < 0.01).mean() > 0.95
    away = np.linalg.norm(found.points, axis=1)
    assert away.max() < 0.16
    np.testing.assert_allclose(found.roots, roots.positions, atol=1e-7)


def growth_twin(
    values: Float32Array, start: Float32Array, steps: int, free: int, options: Options
) -> list[np.ndarray]:
    """One strand by the rules, in NumPy; it slides on the first `free` steps."""
    p, d = start.astype(np.float64), np.zeros(3)
    path, inside, patience, stands = [p], 1, round(options.patience / options.step), False
    for i in range(1, steps + 1):
        found = GRID.sample(values, p[None])[0].astype(np.float64)
        size = np.linalg.norm(found[:3])
        blind = i * options.step <= options.blind + 1e-9
        if blind or (found[3] <= (LEFT if stands else options.bound) and size > 1e-9):
            inside = i
        elif i - inside > patience:
            break
        if size > 1e-9:
            keep = options.inertia if i > 1 else 0.0
            d = keep * d + (1 - keep) * found[:3] / size
        d = d / np.linalg.norm(d)
        stands = False
        if found[3] >= 1:
            probes = p + GRID.spacing * np.concatenate([np.eye(3), -np.eye(3)])
            level = GRID.sample(values, probes)[:, 3].astype(np.float64)
            normal = (level[:3] - level[3:]) / np.linalg.norm(level[:3] - level[3:])
            stands = d @ normal >= options.slide_sine and normal[1] > BELOW
            if i < free and d @ normal < options.slide_sine:
                back = options.pull * (found[3] - 1)
                d = d - (max(d @ normal, 0) + back) * normal
                d = d / np.linalg.norm(d)
        p = p + options.step * d
        path.append(p)
    return path[: inside + 1]


@pytest.mark.parametrize("seed", range(6))
def test_growth_equals_its_readable_twin(seed: int) -> None:
    """Through a swirling field whose distance rises outward: the twin's path, resampled."""
    rng = np.random.default_rng(seed)
    at = GRID.centres()
    axis = rng.normal(size=3)
    direction = (np.cross(axis, at) + 0.2 * axis + at).astype(np.float32)
    distance = (0.5 + 6 * np.linalg.norm(at, axis=-1)).astype(np.float32)
    options = replace(FREE, slide_sine=0.6, bound=1.4, inertia=0.5, blind=0.01)
    starts = rng.normal(0, 0.02, (12, 3)).astype(np.float32)
    field = constant((0, 1, 0))
    found = grow(
        field, signed_volume(field, direction, distance), starts, np.full(len(starts), 0.1), options
    )
    values = np.concatenate([direction, distance[..., None]], axis=3)
    steps, free = int(options.reach * 0.1 / options.step), int(0.1 / options.step)
    for start, points in zip(starts, found.points.reshape(12, -1, 3), strict=True):
        path = np.array(growth_twin(values, start, steps, free, options))
        share = np.linspace(0, len(path) - 1, options.points)
        expected = [np.interp(share, np.arange(len(path)), path[:, k]) for k in range(3)]
        np.testing.assert_allclose(points, np.stack(expected, 1), atol=2e-5)


def test_strands_do_not_depend_on_each_other() -> None:
    """Every second root alone gives the same strands; points stand at equal steps."""
    roots = scalp_roots(ball_head())
    whole = follow_ball(FREE, roots)
    half = Roots(*(getattr(roots, f.name)[::2] for f in fields(roots)))
    np.testing.assert_array_equal(
        follow_ball(FREE, half).points, whole.select(np.arange(0, len(whole), 2)).points
    )
    step = np.linalg.norm(whole.segments()[0], axis=1).reshape(len(whole), -1)[:, 20:]
    assert (np.ptp(step, axis=1) < 0.2 * step.mean(axis=1)).mean() > 0.9


def test_the_step_hardly_matters() -> None:
    """Half the step with the inertia of the same way: the same strand within a millimetre."""
    roots = scalp_roots(ball_head())
    coarse = follow_ball(replace(FREE, inertia=0.0), roots)
    fine = follow_ball(replace(FREE, inertia=0.0, step=0.0005), roots)
    both = np.minimum(coarse.lengths(), fine.lengths()) > 0.02
    assert both.mean() > 0.9
    apart = np.linalg.norm(coarse.points - fine.points, axis=1).reshape(len(roots), -1)
    assert np.median(apart[both].max(axis=1)) < 2e-3


def test_a_strand_does_not_depend_on_how_many_others_are_grown() -> None:
    """Some of the roots, grown alone, give exactly the strands that they give among all."""
    roots, hull = scalp_roots(ball_head()), shell_hull()
    some = np.random.default_rng(0).permutation(len(roots))[:15]
    few = Roots(
        roots.positions[some],
        roots.normals[some],
        roots.uv[some],
        roots.triangle[some],
        roots.barycentric[some],
    )
    among, alone = (
        track(
            SCENE,
            MASKS,
            hull,
            combed_field(hull.grid),
            r,
            Waves(0.006, 0.04, 0.0),
            DISTANCE,
            TiedHair(),
            Options(cover=0.0),
        )
        for r in (roots, few)
    )
    np.testing.assert_array_equal(among.select(some).points, alone.points)


def test_a_strand_that_comes_back_into_the_hair_goes_on() -> None:
    """A gap shorter than `patience` is crossed; a longer one ends the strand before it."""
    x = GRID.centres()[..., 0]
    gap = np.where((x > 0.05) & (x < 0.07), 2.0, 0.5).astype(np.float32)
    patient, impatient = (
        run(constant((1, 0, 0)), gap, replace(FREE, patience=p, blind=0.0), way=0.05)
        for p in (0.03, 0.01)
    )
    assert patient.tips[0, 0] == pytest.approx(0.1, abs=2e-3)
    assert impatient.tips[0, 0] == pytest.approx(0.05, abs=8e-3)


def test_sliding_strands_are_pulled_back_to_the_surface() -> None:
    """Beyond I = 1 the strand returns instead of drifting away from the hair."""
    distance = (1 + 10 * GRID.centres()[..., 1]).astype(np.float32)
    field = constant((0.97, 0.24, 0))
    assert field.direction is not None
    starts = np.array([[-0.1, 0.02, 0.0]], np.float32)
    options = replace(FREE, slide_sine=0.5, reach=1.0, inertia=0.0, blind=0.0, bound=3.0)
    free, pulled = (
        grow(
            field,
            signed_volume(field, field.direction, distance),
            starts,
            np.full(len(starts), 0.1),
            replace(options, pull=p),
        )
        for p in (0.0, 1.0)
    )
    assert abs(pulled.tips[0, 1]) < 0.5 * free.tips[0, 1]


def test_hair_that_photos_show_and_no_strand_reaches_gets_strands() -> None:
    """Hair is combed down from a crown without roots: strands are led to it from around."""
    everywhere = scalp_roots(ball_head())
    around = np.hypot(*everywhere.positions.T[[0, 2]]) > 0.035
    columns = ("positions", "normals", "uv", "triangle", "barycentric")
    roots = Roots(*(getattr(everywhere, name)[around] for name in columns))
    hull = shell_hull()
    field = combed_field(hull.grid)
    on_crown = []
    for cover in (0.0, 2.0):
        options = replace(FREE, reach=1.0, cover=cover)
        found = track(SHARP, SHARP_MASKS, hull, field, roots, Waves(), DISTANCE, LOOSE, options)
        near = np.hypot(*found.points.T[[0, 2]]) < 0.025
        on_crown.append(int((near & (found.points[:, 1] > 0)).sum()))
        np.testing.assert_array_equal(found.roots, roots.positions)
    assert on_crown[0] == 0
    assert on_crown[1] > 50
