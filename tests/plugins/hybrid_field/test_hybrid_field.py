"""Laws of the patent's four fields, of the segments they stand on, and of their blend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from bun import ALONG, CENTRE, all_hair, bun, off_deg, seen, turn
from hairkit_plugins.hybrid_field import Options, solve_field
from hairkit_plugins.hybrid_field.four_fields import internal_distance, surface_structure
from hairkit_plugins.hybrid_field.photo_lines import (
    CONFIDENT,
    DEPTH_JUMP,
    MIN_COSINE,
    PIXELS,
    SMOOTHING,
    Photo,
    _follow_photo,
    agreeing,
    lift_lines,
)
from hairkit_plugins.hybrid_field.ribbons import SURFACE, Band, ribbons
from hairkit_plugins.hybrid_field.segments import Way, find_segments, orient_segments
from scipy import ndimage

from hairkit.field.diffusion import CellGraph
from hairkit.field.growth_prior import growth_potential, measure_scalp_distance
from hairkit.field.view_fusion import DEPTH_SHRINK, fuse_views
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull, VoxelGrid, cell_slopes, outer_products
from hairkit.types.waves import Waves

SPACING = 0.006
LONG, SHORT = 0.2, 0.01
"""Longest ways through hair, metres."""
PLAIN = Options(scalp_weight=0.0, pool=0.0, unslant=False, outward=0.0)


def hair() -> Hull:
    """The bun, in finer cells."""
    return bun(SPACING)


def photos() -> tuple[tuple[Camera, ...], tuple[Mask, ...], tuple[OrientationMap, ...]]:
    views = turn()
    return views, tuple(map(all_hair, views)), tuple(map(seen, views))


def segments(options: Options = PLAIN) -> tuple[Strands, Hull]:
    views, masks, maps = photos()
    hull = hair()
    growth = growth_potential(hull, measure_scalp_distance(ball_head(), hull))
    fused = fuse_views(views, masks, maps, hull, Waves(), options)
    way = Way(growth, ball_head(), Parting(), LONG)
    return find_segments(views, masks, fused, hull, way, options), hull


def test_segments_run_along_the_hair_they_were_seen_on() -> None:
    """Lines lifted from photos and lines through cells follow the true direction."""
    found, hull = segments()
    chords = (found.tips - found.roots).astype(np.float64)
    assert len(found) > 200
    assert np.median(off_deg(chords)) < 5
    assert hull.grid.sample(hull.dense.astype(np.float32), found.points).mean() > 0.4


def test_segments_are_no_longer_than_allowed() -> None:
    """`longest` bounds them, but for half the rounding of both halves."""
    found, _ = segments(replace(PLAIN, longest=0.02))
    assert found.lengths().max() < 0.02 + 0.012


def test_a_line_is_lifted_and_smoothed_the_same_wherever_it_stands_in_the_pack() -> None:
    """The compiled lift of many lines is, line by line, a truncated Gaussian along points that
    the camera sees where the line was followed."""
    camera = turn()[0]
    rng = np.random.default_rng(3)
    lines = rng.uniform(40, 80, (5, 30, 3)).astype(np.float32)
    lines[..., 2] = rng.uniform(0.4, 0.6, (5, 30))
    counts = np.array([30, 2, 5, 12, 30])
    lifted = lift_lines(camera, lines, counts)
    points, kept = lifted.points, lifted.counts
    np.testing.assert_array_equal(kept, [30, 5, 12, 30])
    ends = np.cumsum(kept)
    for line, last, count in zip(lines[[0, 2, 3, 4]], ends, kept, strict=True):
        pixel = line[:count].astype(np.float64)
        local = np.ones((count, 3))
        local[:, :2] = (pixel[:, :2] - camera.centre) / camera.focal
        local = local * pixel[:, 2:] - camera.translation
        away = np.subtract.outer(np.arange(count), np.arange(count))
        weight = np.exp(-0.5 * (away / SMOOTHING) ** 2) * (np.abs(away) <= 3 * SMOOTHING)
        smooth = weight @ (local @ camera.rotation) / weight.sum(axis=1, keepdims=True)
        np.testing.assert_allclose(points[last - count : last], smooth, atol=1e-6)


def test_lines_agree_with_the_tensors_along_them_only() -> None:
    """A line along the field stays; one square to it, and one where nothing is known, go."""
    hull = hair()
    volume = np.zeros((*hull.grid.shape, 6), np.float32)
    volume[hull.loose] = outer_products([0.0, 1.0, 0.0])
    course = np.linspace(-0.02, 0.02, 9)[:, None]
    lines = [CENTRE + course * [0, 1.0, 0], CENTRE + course * [1.0, 0, 0], [[9, 9, 9], [9, 8, 9]]]
    kept = agreeing(Strands.from_list(lines), hull, volume, 35.0)
    np.testing.assert_allclose(kept.points, lines[0], atol=1e-6)


def test_segments_agree_on_which_end_is_the_root() -> None:
    """Parallel segments of mixed signs come out with one sign, that of the growth."""
    hull = hair()
    rng = np.random.default_rng(1)
    roots = (CENTRE + rng.uniform(-0.03, 0.03, (60, 3))).astype(np.float32)
    course = np.linspace(0, 0.02, 8)[:, None] * np.array([0.0, 1.0, 0.0])
    points = roots[:, None] + course
    points[::3] = points[::3, ::-1]
    growth = hull.grid.centres()[..., 1]
    growth = growth + 0.004 * rng.standard_normal(growth.shape).astype(np.float32)
    mixed = Strands(points.reshape(-1, 3).astype(np.float32), np.arange(61) * 8)
    way = Way(growth.astype(np.float32), ball_head(), Parting(), LONG)
    result = orient_segments(mixed, hull, way)
    assert ((result.tips - result.roots)[:, 1] > 0).all()
    np.testing.assert_array_equal(np.sort(result.points[:, 1]), np.sort(mixed.points[:, 1]))


def test_segments_of_short_hair_run_as_it_is_combed() -> None:
    """Its ends lie everywhere, so a potential that rises against the comb counts in long hair
    alone."""
    hull = hair()
    at = CENTRE + np.array([[0.0, 0.0, 0.06], [0.01, 0.0, 0.06]])
    points = at[:, None] + np.linspace(0, 0.02, 8)[:, None] * np.array([0.0, -1.0, 0.0])
    downward = Strands(points.reshape(-1, 3).astype(np.float32), np.arange(3) * 8)
    rising = hull.grid.centres()[..., 1].astype(np.float32)
    for length, sign in ((SHORT, -1), (LONG, 1)):
        result = orient_segments(downward, hull, Way(rising, ball_head(), Parting(), length))
        assert (sign * (result.tips - result.roots)[:, 1] > 0).all()


def test_hair_beside_the_head_hangs() -> None:
    """A tuft that stands out lets the potential rise upwards below it: weakly, so hair hangs. On
    the skin and above the head the potential decides."""
    hull = hair()
    course = np.linspace(0, 0.02, 8)[:, None] * np.array([0.0, 1.0, 0.0])
    rising = (0.3 * hull.grid.centres()[..., 1]).astype(np.float32)
    beside = 0.03 + hull.grid.centres()[..., 0]
    for distance, sign in ((beside, -1), (beside - 0.03, 1), (hull.head_distance, 1)):
        hanging = replace(hull, head_distance=distance.astype(np.float32))
        upward = Strands((CENTRE + course).astype(np.float32), [0, 8])
        result = orient_segments(upward, hanging, Way(rising, ball_head(), Parting(), LONG))
        assert (sign * (result.tips - result.roots)[:, 1] > 0).all()


def test_ribbons_widen_segments_along_the_surface() -> None:
    """A wider ribbon covers more cells, all directions unit where one segment runs alone."""
    hull = hair()
    course = CENTRE + [0, 0, 0.055] + np.linspace(-0.02, 0.02, 21)[:, None] * [0, 1.0, 0]
    lone = Strands.from_list([course])
    thin, wide = (ribbons(lone, hull, reach) for reach in (0.0, 0.012))
    assert wide.on.sum() > 1.5 * thin.on.sum()
    drawn = thin.direction[thin.on]
    np.testing.assert_allclose(np.linalg.norm(drawn, axis=1), 1, atol=1e-5)
    assert (drawn[:, 1] > 0.99).all()


def test_surface_structure_keeps_ribbons_and_spreads_them() -> None:
    """Dirichlet on ribbons; everywhere else of the bun the one direction there is."""
    hull = hair()
    course = CENTRE + [0, 0, 0.05] + np.linspace(-0.02, 0.02, 21)[:, None] * [0, 1.0, 0]
    band = ribbons(Strands.from_list([course]), hull, 0.0)
    field = surface_structure(CellGraph.of(hull.loose), band, 1e-4)
    np.testing.assert_allclose(field[band.on], band.direction[band.on], atol=0.02)
    np.testing.assert_allclose(field, np.broadcast_to([0, 1, 0], field.shape), atol=0.03)


def test_internal_distance_is_0_in_the_head_1_on_strands_and_grows_outward() -> None:
    """Harmonic between: within the bounds of its Dirichlet values."""
    grid = VoxelGrid.around(np.full(3, -0.2), np.full(3, 0.2), 0.005)
    away = np.linalg.norm(grid.centres(), axis=-1)
    hair = (away > 0.1) & (away < 0.14)
    hull = Hull(grid, hair, hair, (away - 0.1).astype(np.float32))
    rng = np.random.default_rng(0)
    spots = rng.standard_normal((4000, 3))
    spots *= 0.135 / np.linalg.norm(spots, axis=1, keepdims=True)
    strands = Strands(np.repeat(spots, 2, axis=0).astype(np.float32), np.arange(4001) * 2)
    value = internal_distance(hull, strands, 1e-4)
    assert abs(float(np.median(value[away < 0.08]))) < 0.02
    on = grid.sample(value, spots.astype(np.float32))
    assert abs(float(np.median(on)) - 1) < 0.15
    assert (value[(away > 0.17) & (away < 0.19)] > 1.2).all()
    between = (away > 0.108) & (away < 0.122)
    assert 0.1 < float(np.median(value[between])) < 0.9


def test_one_direction_everywhere_comes_back_signed() -> None:
    """Exact angles: the blend lies along the hair, with one sign over nearly all of the bun."""
    views, masks, maps = photos()
    scene = Scene(tuple("abcdefgh"), views, ball_head())
    hull = hair()
    field = solve_field(
        scene,
        masks,
        maps,
        hull,
        Waves(),
        measure_scalp_distance(scene.head, hull),
        Parting(),
        PLAIN,
    )
    assert field.direction is not None
    direction = field.direction[hull.dense].astype(np.float64)
    assert np.median(off_deg(direction)) < 4
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1, atol=1e-4)
    majority = np.abs(np.sign(direction @ ALONG).mean())
    assert majority > 0.8


def test_without_segments_the_inner_field_alone_speaks() -> None:
    """Photos without any sure pixel still give a field: that of the scalp's combing."""
    views, masks, maps = photos()
    blank = tuple(OrientationMap(found.angle, 0 * found.confidence) for found in maps)
    scene = Scene(tuple("abcdefgh"), views, ball_head())
    hull = hair()
    distance = measure_scalp_distance(scene.head, hull)
    options = Options(pool=0.0, unslant=False)
    field = solve_field(scene, masks, blank, hull, Waves(), distance, Parting(), options)
    assert field.direction is not None
    assert np.isfinite(field.direction).all()
    assert field.internal_distance is not None


def test_partings_do_not_turn_coils() -> None:
    """The field of coils is the same whatever the parting says."""
    views, masks, maps = photos()
    scene = Scene(tuple("abcdefgh"), views, ball_head())
    hull, coils = hair(), Waves(0.004, 0.011)
    distance = measure_scalp_distance(scene.head, hull)
    one, other = (
        solve_field(scene, masks, maps, hull, coils, distance, parting, PLAIN).direction
        for parting in (Parting(), Parting(swept_back=True))
    )
    assert one is not None
    np.testing.assert_array_equal(one, other)


def test_an_empty_band_has_no_direction() -> None:
    """No segments, no ribbons."""
    hull = hair()
    band = ribbons(Strands(np.zeros((0, 3), np.float32), np.zeros(1, np.int64)), hull, 0.004)
    assert isinstance(band, Band)
    assert not band.on.any()
    assert not band.direction.any()


def test_a_line_in_a_photo_equals_its_readable_twin() -> None:
    """Steps of two pixels along the angle, both ways, until one of the four reasons to end."""
    rng = np.random.default_rng(5)
    y, x = np.mgrid[0:60, 0:60]
    angle = wrap_angle(0.6 + 0.02 * x + 0.015 * y + rng.normal(0, 0.25, x.shape))
    angle = angle.astype(np.float32)
    weight = np.clip(1.2 - np.hypot(x - 30, y - 30) / 28, 0, 1).astype(np.float32)
    front = (0.5 + 1e-4 * np.arange(400).reshape(20, 20)).astype(np.float32)
    front[8:10, 12:] = np.inf
    front[14:, 3:] += 0.02
    rows, columns = (part.ravel() for part in np.mgrid[4:60:8, 4:60:8])
    lines = np.zeros((len(rows), 41, 3), np.float32)
    counts = np.zeros(len(rows), np.int64)
    _follow_photo(0, len(rows), Photo(angle, weight, front), rows, columns, lines, counts)
    for row, column, line, count in zip(rows, columns, lines, counts, strict=True):
        parts = []
        for sign in (-1.0, 1.0):
            at, way, part = np.array([column + 0.5, row + 0.5]), None, []
            while len(part) < 20:
                j, i = np.floor(at).astype(int)
                if not (0 <= i < 60 and 0 <= j < 60 and weight[i, j] >= CONFIDENT):
                    break
                depth = float(front[i // DEPTH_SHRINK, j // DEPTH_SHRINK])
                if not np.isfinite(depth) or (part and abs(depth - part[-1][2]) > DEPTH_JUMP):
                    break
                part.append([*at, depth])
                turn = np.array([np.cos(angle[i, j]), np.sin(angle[i, j])])
                turn = sign * turn if way is None else turn * (1 if turn @ way >= 0 else -1)
                if way is not None and turn @ way < MIN_COSINE:
                    break
                way, at = turn, at + PIXELS * turn
            parts.append(part)
        expected = [*parts[0][:0:-1], *parts[1]]
        assert count == len(expected)
        if count:
            np.testing.assert_allclose(line[:count], expected, atol=1e-3)
    assert len(set(counts.tolist())) > 5


def test_ribbons_equal_their_readable_twin() -> None:
    """Every cell under a ribbon has the weighted mean of the tangents drawn on it."""
    found, hull = segments()
    reach = 2 * SPACING
    band = ribbons(found, hull, reach)
    occupancy = ndimage.gaussian_filter(hull.dense.astype(np.float32), SURFACE)
    points, along = found.points.astype(np.float64), found.tangents().astype(np.float64)
    side = np.cross(along, hull.grid.sample(cell_slopes(occupancy), found.points))
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    total, weight = np.zeros((*hull.grid.shape, 3)), np.zeros(hull.grid.shape)
    for share in np.linspace(-1, 1, 9):
        cells = hull.grid.nearest_cell((points + share * reach * side).astype(np.float64))
        part = np.exp(-2 * share**2)
        np.add.at(total, tuple(cells.T), part * along)
        np.add.at(weight, tuple(cells.T), part)
    drawn = (weight > 0) & hull.loose
    by_band = np.zeros(hull.grid.shape, bool)
    by_band[hull.loose] = band.on
    assert (drawn != by_band).mean() < 1e-4  # a point on the border of two cells
    same = drawn & by_band
    drawn_by_band = band.direction[same[hull.loose]]
    difference = np.abs(total[same] / weight[same, None] - drawn_by_band).max(axis=1)
    assert np.quantile(difference, 0.99) < 1e-3
