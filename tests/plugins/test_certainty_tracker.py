"""Laws of strand tracking: in made-up fields around a ball of a head."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numba
import numpy as np
import pytest
from hairkit_plugins import certainty_tracker, tensor_diffusion, visual_hull
from hairkit_plugins.certainty_tracker import Options, _smoothed, _trimmed, track

from hairkit.head import Roots
from hairkit.options import describe
from hairkit.stored import BoolArray, Float32Array, Float64Array
from hairkit.strands import Strands
from hairkit.testing import scalp_roots, turn_scene
from hairkit.volume import Hull, OrientationField, VoxelGrid, outer_products
from hairkit.waves import Waves

BALL = 0.1
SPACING = 0.01
GRID = VoxelGrid.around(np.full(3, -0.27), np.full(3, 0.27), SPACING)
CENTRES = GRID.centres().astype(np.float64)
DISTANCE = np.linalg.norm(CENTRES, axis=-1) - BALL
UP = np.array([0.0, 1.0, 0.0])
FREE = Options(waves=False, slide_sine=0.0, u_share=1.0, smoothing=0, max_length=0.13)
"""Nothing but the walk through the field."""
ALL_THREADS = numba.config.NUMBA_NUM_THREADS


@pytest.fixture(autouse=True)
def _all_threads_again() -> Iterator[None]:
    yield
    numba.set_num_threads(ALL_THREADS)


def roots_where(keep: Callable[[Float64Array], BoolArray]) -> Roots:
    """Roots of the ball's scalp whose normals pass."""
    roots = scalp_roots(turn_scene().head)
    picked = keep(roots.normals.astype(np.float64))
    return Roots(
        roots.positions[picked] * (BALL / np.linalg.norm(roots.positions[picked], axis=1))[:, None],
        roots.normals[picked],
        roots.uv[picked],
        roots.triangle[picked],
        roots.barycentric[picked],
    )


def with_normals(normals: Float64Array) -> Roots:
    """Roots on the ball with these normals."""
    count = len(normals)
    weights = np.full((count, 3), 1 / 3, np.float32)
    uv, triangle = np.zeros((count, 2), np.float32), np.zeros(count, np.int32)
    return Roots((BALL * normals).astype(np.float32), normals, uv, triangle, weights)


def filled(hair: BoolArray | None = None) -> Hull:
    """Hair everywhere outside of the head, or where it is told."""
    outside = DISTANCE > -SPACING
    return Hull(
        GRID, outside if hair is None else hair & outside, outside, DISTANCE.astype(np.float32)
    )


def field_along(directions: Float64Array, growth: Float64Array) -> OrientationField:
    """The field of unit directions (3,) or (X, Y, Z, 3), and its growth (X, Y, Z)."""
    everywhere = np.broadcast_to(directions, CENTRES.shape)
    tensor = outer_products(everywhere).astype(np.float32)
    sure = np.ones(GRID.shape, np.float32)
    return OrientationField(GRID, tensor, sure, growth.astype(np.float32))


def constant(direction: Float64Array) -> OrientationField:
    """One direction everywhere, in which hair also grows."""
    unit = direction / np.linalg.norm(direction)
    return field_along(unit, CENTRES @ unit)


def run(field: OrientationField, hull: Hull, roots: Roots, options: Options) -> Strands:
    """Track; no photos are needed without waves."""
    return track(turn_scene(), (), (), hull, field, roots, options)


def polylines(strands: Strands) -> Float64Array:
    """Points (S, M, 3) of strands with equal counts."""
    return strands.points.astype(np.float64).reshape(len(strands), -1, 3)


def off_deg(strands: Strands, direction: Float64Array, after: float) -> Float64Array:
    """Angles of all segments that start beyond a share of the strand to a signed direction."""
    steps = np.diff(polylines(strands), axis=1)
    steps = steps[:, int(after * steps.shape[1]) :]
    cosine = steps @ direction / np.linalg.norm(steps, axis=2) / np.linalg.norm(direction)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def crown(normals: Float64Array) -> BoolArray:
    return np.asarray(normals[:, 1] > 0.93)


@pytest.mark.parametrize("direction", [[0.3, 0.8, 0.2], [-0.5, 0.7, -0.3], [0.0, 1.0, 0.0]])
def test_in_a_constant_field_strands_are_straight_along_it(direction: list[float]) -> None:
    """Away from the root every segment points the way the hair grows, within a degree."""
    along = np.array(direction) / np.linalg.norm(direction)
    roots = roots_where(lambda normals: normals @ along > 0.7)
    strands = run(constant(along), filled(), roots, FREE)
    assert len(roots) > 20
    assert off_deg(strands, along, after=0.5).max() < 1
    np.testing.assert_allclose(strands.lengths(), FREE.max_length, atol=0.006)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_growth_decides_which_way_a_field_is_followed(sign: float) -> None:
    """The tensors of both directions are the same; strands follow the growth."""
    sideways = sign * np.array([1.0, 0.0, 0.0])
    roots = roots_where(lambda normals: (np.abs(normals[:, 0]) < 0.2) & (normals[:, 1] > 0.5))
    strands = run(constant(sideways), filled(), roots, FREE)
    assert len(roots) > 4
    assert off_deg(strands, sideways, after=0.5).max() < 3


def test_every_root_has_its_strand() -> None:
    """As many strands as roots, in their order, each starts at its root; equal point counts."""
    roots = scalp_roots(turn_scene().head)
    strands = run(constant(-UP), filled(), roots, replace(Options(waves=False), points=40))
    assert len(strands) == len(roots)
    np.testing.assert_array_equal(strands.roots, roots.positions)
    np.testing.assert_array_equal(strands.root_uv, roots.uv)
    assert (strands.counts == 40).all()
    segments = np.linalg.norm(np.diff(polylines(strands), axis=1), axis=2)
    assert (segments > 0).all()


def test_a_root_where_nothing_is_known_still_has_a_strand() -> None:
    """Without field and hair around it a strand is one step long, and the push off the head."""
    empty = field_along(np.zeros(3), CENTRES[..., 1])
    far = filled(CENTRES[..., 1] < -0.2)
    options = replace(FREE, blind_steps=0, max_score=3)
    strands = run(empty, far, roots_where(crown), options)
    np.testing.assert_allclose(strands.lengths(), options.step * SPACING, atol=FREE.clearance)


@pytest.mark.parametrize("clearance", [0.0, 0.001, 0.004])
@pytest.mark.parametrize("wound", [False, True])
def test_strands_stay_out_of_the_head(
    clearance: float, wound: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the field leads through the head they go round, at the clearance; also when wound."""
    waves = Waves(0.008, 0.04, 0.3)
    monkeypatch.setattr(certainty_tracker, "measure_waves", lambda *_: waves)
    roots = scalp_roots(turn_scene().head)
    options = Options(clearance=clearance, waves=wound, max_length=0.4)
    strands = run(constant(np.array([0.1, -1.0, 0.2])), filled(), roots, options)
    free = np.ones(len(strands.points), bool)
    free[strands.offsets[:-1]] = False
    distance = np.linalg.norm(strands.points[free], axis=1) - BALL
    assert distance.min() > clearance - 0.0007  # the distance is interpolated in cells of 1 cm
    assert GRID.sample(filled().head_distance, strands.points[free]).min() > clearance - 1e-4
    assert np.median(strands.tips[:, 1]) < -0.1


def test_strands_end_where_the_hair_ends() -> None:
    """The uncertain steps beyond the last hair are cut off: tips are a step from its border."""
    hair = CENTRES[..., 1] < 0.17
    hull = replace(filled(hair), loose=hair & (DISTANCE > -SPACING))
    border = GRID.origin[1] + SPACING * np.ceil((0.17 - GRID.origin[1]) / SPACING - 0.5)
    for max_score in (1, 4, 8):
        options = replace(FREE, max_score=max_score)
        strands = run(constant(UP), hull, roots_where(crown), options)
        assert np.abs(strands.tips[:, 1] - border).max() < 1.1 * options.step * SPACING


def gap(thickness: float) -> Hull:
    """Hair above the crown with a layer of no hair in it."""
    y = CENTRES[..., 1]
    hair = (y < 0.16) | (y > 0.16 + thickness)
    return replace(filled(hair), loose=hair & (DISTANCE > -SPACING))


@pytest.mark.parametrize(("max_score", "crosses"), [(2, False), (4, False), (8, True), (20, True)])
def test_gaps_are_crossed_within_the_steps_that_may_be_uncertain(
    max_score: int, crosses: bool
) -> None:
    """Three cells of gap are six steps: a strand crosses it straight on, or ends before."""
    options = replace(FREE, max_score=max_score, max_length=0.12)
    strands = run(constant(UP), gap(0.03), roots_where(crown), options)
    tops = strands.tips[:, 1]
    assert ((tops > 0.2) if crosses else (tops < 0.17)).all()


def test_sharp_turns_are_uncertain() -> None:
    """The field bends by 70 degrees at a plane: followed when allowed, else the strand ends."""
    bent = np.array([np.sin(np.radians(70)), np.cos(np.radians(70)), 0.0])
    above = CENTRES[..., 1] > 0.16
    field = field_along(np.where(above[..., None], bent, UP), CENTRES @ (UP + bent))
    kind, strict = (
        run(field, filled(), roots_where(crown), replace(FREE, max_turn_deg=limit, inertia=0.0))
        for limit in (90, 25)
    )
    assert (kind.tips - kind.roots)[:, 0].min() > 0.02
    assert off_deg(kind, bent, after=0.9).max() < 2
    assert strict.tips[:, 1].max() < 0.18
    assert (strict.lengths() < 0.8 * kind.lengths()).all()


@pytest.mark.parametrize(("blind_steps", "arrives"), [(0, False), (8, True)])
def test_the_first_steps_may_be_blind(blind_steps: int, arrives: bool) -> None:
    """Hair that starts 4 cm over the scalp is reached only by strands that need not see at first.

    Without, they end at their first steps.
    """
    hair = DISTANCE > 0.04
    hull = replace(filled(hair), loose=(hair | (DISTANCE < 0.01)) & (DISTANCE > -SPACING))
    options = replace(FREE, blind_steps=blind_steps, max_score=2)
    strands = run(constant(UP), hull, roots_where(crown), options)
    lengths = strands.lengths()
    assert ((lengths > 0.1) if arrives else (lengths < 0.02)).all()


def test_no_strand_is_longer_than_allowed() -> None:
    """What pushing off the head adds is at most the clearance."""
    roots = roots_where(lambda normals: normals[:, 1] > 0.5)
    for limit in (0.02, 0.07):
        lengths = run(constant(UP), filled(), roots, replace(FREE, max_length=limit)).lengths()
        assert (lengths <= limit + FREE.clearance).all()
        assert (lengths > limit - FREE.step * SPACING).all()


def test_strands_that_meet_the_skin_of_the_hair_slide_along_it() -> None:
    """A field that leads out of a tube at 25 degrees: with sliding strands follow it to its end."""
    tube = np.hypot(CENTRES[..., 0], CENTRES[..., 2]) < 0.07
    hair = (tube & (CENTRES[..., 1] > 0)) & (CENTRES[..., 1] < 0.25)
    hull = replace(filled(hair), loose=hair & (DISTANCE > -SPACING))
    oblique = np.array([np.sin(np.radians(25)), np.cos(np.radians(25)), 0.0])
    options = replace(FREE, max_length=0.2)
    straight, sliding, never = (
        run(constant(oblique), hull, roots_where(crown), replace(options, **change))
        for change in ({}, {"slide_sine": 0.9}, {"slide_sine": 0.9, "slide_share": 0.0})
    )
    assert straight.tips[:, 1].max() < 0.25 + options.step * SPACING
    assert sliding.tips[:, 1].min() > straight.tips[:, 1].min() + 0.03
    assert (np.hypot(sliding.points[:, 0], sliding.points[:, 2]) < 0.07 + 1.5 * SPACING).all()
    np.testing.assert_array_equal(straight.points, never.points)


def test_without_sliding_the_skin_bends_nothing() -> None:
    """Through a slanted gap, which is entered again at an angle, a strand goes straight on."""
    plane = CENTRES @ np.array([0.6, 0.8, 0.0])
    hair = (plane < 0.13) | (plane > 0.16)
    hull = replace(filled(hair), loose=hair & (DISTANCE > -SPACING))
    options = replace(FREE, max_score=12)
    field = constant(UP)
    unknown = np.where(hair[..., None], field.tensor, 0)
    strands = run(replace(field, tensor=unknown), hull, roots_where(crown), options)
    reference = run(field, filled(), roots_where(crown), options)
    np.testing.assert_allclose(strands.points, reference.points, atol=2e-3)


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
    same, kept = _trimmed(points, counts, 0.3)
    assert kept.tolist() == [11]
    np.testing.assert_array_equal(same, points)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_trimming_follows_the_rule_of_the_thesis(share: float) -> None:
    """Random strands, up first or down first, have as many points left as the loop says."""
    rng = np.random.default_rng(6)
    for _ in range(60):
        steps = rng.choice([-1.0, -1.0, 0.0, 1.0], rng.integers(2, 25)).tolist()
        points, counts = heights(*steps)
        assert _trimmed(points, counts, share)[1].tolist() == [trimmed_twin(steps, share)]


@pytest.mark.parametrize(
    "steps", [[1] * 8, [-1] * 8, [1, 1, 1, -1, -1, -1], [-1] * 9 + [1, 1], [0, 0, 0]]
)
def test_rising_falling_and_little_curled_strands_are_not_trimmed(steps: list[int]) -> None:
    """Up then down is an arch, no U; a tip that turns up a little may."""
    points, counts = heights(*steps)
    assert _trimmed(points, counts, 0.3)[1].tolist() == [len(steps) + 1]
    bowl, full = heights(-1, 1, 1, 1)
    assert _trimmed(bowl, full, 1.0)[1].tolist() == [5]


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
        smooth = _smoothed(points, iterations)
        np.testing.assert_array_equal(smooth[:, 0], points[:, 0])
        after = np.linalg.norm(np.diff(smooth, axis=1), axis=2)
        np.testing.assert_allclose(after, before, atol=1e-6)
        rough.append(roughness(smooth))
    assert rough[2] < 0.7 * rough[1] < 0.7 * 0.8 * rough[0]
    np.testing.assert_array_equal(_smoothed(points, 0), points)


def test_smoothing_leaves_straight_strands() -> None:
    """A line has nothing to smooth, however uneven its segments."""
    t = np.cumsum(np.random.default_rng(8).uniform(0.001, 0.01, 20))
    line = (t[None, :, None] * np.array([0.6, -0.8, 0.0])).astype(np.float32)
    np.testing.assert_allclose(_smoothed(line, 5), line, atol=1e-6)


def test_the_number_of_threads_does_not_change_a_byte() -> None:
    """One thread and all threads give the same strands."""
    results = []
    for threads in (1, ALL_THREADS):
        numba.set_num_threads(threads)
        strands = run(constant(-UP), filled(), scalp_roots(turn_scene().head), Options(waves=False))
        results.append(strands.points.tobytes())
    assert results[0] == results[1]


def test_waves_are_wound_unless_the_option_says_no(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wound strands start at the same roots and are longer by about the length of the helix."""
    waves = Waves(0.006, 0.04, 0.3)
    monkeypatch.setattr(certainty_tracker, "measure_waves", lambda *_: waves)
    roots = roots_where(crown)
    options = replace(FREE, max_length=0.15, points=200)
    plain, wound = (
        run(constant(UP), filled(), roots, replace(options, waves=w)) for w in (False, True)
    )
    np.testing.assert_array_equal(plain.roots, wound.roots)
    helix = np.hypot(1, 2 * np.pi * waves.radius / waves.pitch)
    ratio = (wound.lengths() / plain.lengths()).mean()
    assert 1 + 0.75 * (helix - 1) < ratio < helix


@pytest.mark.parametrize("plugin", [visual_hull, tensor_diffusion, certainty_tracker])
def test_the_page_has_every_option_with_its_default(project: Path, plugin: ModuleType) -> None:
    """The tables of docs/reconstruction.md are those of the code."""
    page = (project / "docs" / "reconstruction.md").read_text()
    for info in describe(plugin.Options):
        default = str(info.default).lower() if info.type is bool else info.default
        assert f"| `{info.name}` | {default} |" in page, info.name
