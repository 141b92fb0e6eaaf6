"""Laws of the visual hull, on balls and boxes of hair whose masks are drawn ray by ray."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hairkit_plugins.visual_hull import MOST_HAIR, Options, build_hull
from hairkit_plugins.visual_hull.carving import BEYOND
from scipy import ndimage

from hairkit.arrays import BoolArray, Float64Array
from hairkit.errors import InputError, OptionError
from hairkit.options import describe, make_options
from hairkit.testing import ball_head
from hairkit.types.camera import Camera, CameraModel
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.scene import Scene
from hairkit.types.volume import Hull, VoxelGrid

BALL = 0.1
HEIGHT, WIDTH = 162, 130
PIXEL = 1 / 300
"""Metres that a pixel covers at the middle of the head."""
COARSE = Options(voxel_size=0.008, slack=7.0, opening=0.0)
"""Slack and opening are for pictures 1080 high: 7 is one pixel here."""

Solid = Callable[[Float64Array], BoolArray]


def cameras_around(model: CameraModel = "perspective", count: int = 8) -> list[Camera]:
    """Cameras of an even turn, the first in front."""
    return [
        Camera.on_turn(
            360 * i / count,
            distance=1.0,
            focal=1 / PIXEL,
            width=WIDTH,
            height=HEIGHT,
            model=model,
        )
        for i in range(count)
    ]


def cap(points: Float64Array) -> BoolArray:
    """Hair as a ball around the head's upper back, which leaves the face free."""
    return np.linalg.norm(points - [0.0, 0.04, -0.05], axis=-1) < 0.11


def cap_with_a_lock(points: Float64Array) -> BoolArray:
    """The cap, and a thin lock that stands up from it."""
    x, y, z = np.moveaxis(points, -1, 0)
    return cap(points) | ((np.hypot(x - 0.02, z) < 0.005) & (y > 0.1) & (y < 0.19))


def plait(points: Float64Array) -> BoolArray:
    """Hair behind the head as a column that hangs far down."""
    x, y, z = np.moveaxis(points, -1, 0)
    return (np.hypot(x, z + 0.12) < 0.04) & (y > -0.2) & (y < 0.08)


def curtains(points: Float64Array) -> BoolArray:
    """A thick shell around the head with a window in front of the face."""
    x, _, z = np.moveaxis(points, -1, 0)
    return (np.linalg.norm(points, axis=-1) < 0.14) & ~((np.abs(x) < 0.06) & (z > 0))


def drawn(camera: Camera, solid: Solid) -> Mask:
    """March along the ray of every pixel: hair or head, whichever comes first."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    start, way = camera.rays(np.stack([x, y], axis=-1))
    start = start + np.sum((camera.position - start) * way, axis=-1, keepdims=True) * way
    picture = np.full(x.shape, BACKGROUND, np.uint8)
    for along in np.arange(0.8, 1.2, 0.008):
        row, column = np.nonzero(picture == BACKGROUND)
        points = (start + along * way)[row, column]
        first = np.where(np.sum(points**2, axis=-1) < BALL**2, PERSON, BACKGROUND)
        picture[row, column] = np.where(solid(points), HAIR, first)
    return Mask(picture, True)


@cache
def true_views(solid: Solid, model: CameraModel) -> tuple[Scene, tuple[Mask, ...]]:
    """The scene of the turn and its masks of three labels."""
    cameras = cameras_around(model)
    names = tuple(str(i) for i in range(len(cameras)))
    masks = tuple(drawn(camera, solid) for camera in cameras)
    return Scene(names, tuple(cameras), ball_head(24)), masks


def views_of(
    solid: Solid, model: CameraModel = "perspective", labels: bool = True
) -> tuple[Scene, tuple[Mask, ...]]:
    """The true views, or what is left of them when nobody said where the person is."""
    scene, masks = true_views(solid, model)
    if labels:
        return scene, masks
    return scene, tuple(Mask(np.where(m.hair, HAIR, BACKGROUND), False) for m in masks)


def without(scene: Scene, masks: tuple[Mask, ...], view: int) -> tuple[Scene, tuple[Mask, ...]]:
    """Leave out one view."""
    rest = [i for i in range(len(masks)) if i != view]
    names, cameras = zip(*[(scene.names[i], scene.cameras[i]) for i in rest], strict=True)
    return Scene(names, cameras, scene.head), tuple(masks[i] for i in rest)


def held(hull: Hull, cells: BoolArray, points: Sequence[float] | Float64Array) -> BoolArray:
    """Whether points (..., 3) lie in the cells, false beyond the grid."""
    index = np.floor(hull.grid.index_from_head(points) + 0.5).astype(int)
    inside = ((index >= 0) & (index < hull.grid.shape)).all(axis=-1)
    index = np.clip(index, 0, np.array(hull.grid.shape) - 1)
    return np.asarray(inside & cells[tuple(np.moveaxis(index, -1, 0))])


def lost(small: tuple[Hull, BoolArray], large: tuple[Hull, BoolArray]) -> int:
    """Count cells well inside the small body that the large one, on another grid, lacks."""
    inner = ndimage.binary_erosion(small[1])
    return int(np.count_nonzero(~held(*large, small[0].grid.centres()[inner].astype(np.float64))))


def true_cells(hull: Hull, solid: Solid, margin: float = PIXEL) -> BoolArray:
    """Cells of the hair outside the head that are nearer to no surface than the margin."""
    centres = hull.grid.centres().astype(np.float64)
    shifts = margin * np.concatenate([np.eye(3), -np.eye(3)])
    inside = np.all([solid(centres + shift) for shift in shifts], axis=0)
    return np.asarray(inside & (np.linalg.norm(centres, axis=-1) > BALL))


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
@pytest.mark.parametrize("labels", [True, False])
@pytest.mark.parametrize("solid", [cap, plait, curtains], ids=lambda solid: solid.__name__)
def test_the_hull_holds_the_true_hair(solid: Solid, labels: bool, model: CameraModel) -> None:
    """With exact cameras no cell of the solid is carved, also behind the head.

    This holds where masks tell the person from the background, and where they know hair only.
    """
    scene, masks = views_of(solid, model, labels)
    hull = build_hull(scene, masks, (), COARSE)
    wanted = true_cells(hull, solid)
    assert wanted.sum() > 100
    assert hull.loose[wanted].all()
    assert hull.dense[wanted].mean() > 0.99


def test_the_hull_is_no_larger_than_silhouettes_allow() -> None:
    """A cell of the hull projects onto hair, or onto the head that hides it, in every view."""
    scene, masks = views_of(cap)
    hull = build_hull(scene, masks, (), COARSE)
    points = hull.grid.centres()[hull.dense]
    for camera, mask in zip(scene.cameras, masks, strict=True):
        column, row = np.floor(camera.project(points)).astype(int).T
        seen = ndimage.binary_dilation(mask.person, iterations=2)
        assert seen[row, column].all()
    assert hull.dense.sum() < 1.5 * true_cells(hull, cap, 0).sum()


@pytest.mark.parametrize("labels", [True, False])
def test_dense_is_part_of_loose_and_loose_near_dense(labels: bool) -> None:
    """Loose reaches at most `loose_cells` beyond dense, but for the shell over the scalp."""
    scene, masks = views_of(cap, labels=labels)
    hull = build_hull(scene, masks, (), replace(COARSE, opening=14.0, slack=14.0, loose_cells=2))
    assert (hull.loose | ~hull.dense).all()
    far = hull.loose & ~ndimage.binary_dilation(hull.dense, iterations=2)
    assert hull.head_distance[far].max(initial=0) < 2 * COARSE.voxel_size


def test_wisps_are_loose_and_not_dense() -> None:
    """A lock that stands off, two pixels wide, is opened away; the body of the hair is not."""
    scene, masks = views_of(cap_with_a_lock)
    options = replace(COARSE, voxel_size=0.004, opening=14.0, loose_cells=5)
    hull = build_hull(scene, masks, (), options)
    lock = [[0.02, y, 0.0] for y in (0.145, 0.15)]
    assert held(hull, hull.loose, np.array(lock)).all()
    assert not held(hull, hull.dense, np.array(lock)).any()
    assert hull.dense[true_cells(hull, cap, 3 * PIXEL)].mean() > 0.97


def test_roots_lie_in_the_hull() -> None:
    """A shell over the scalp is loose even where no hair was seen on it."""
    scene, masks = views_of(plait)
    hull = build_hull(scene, masks, (), COARSE)
    scalp = scene.head.vertices[scene.head.scalp > 0.5].astype(np.float64)
    assert held(hull, hull.loose, 1.01 * scalp).all()


def test_no_hair_is_inside_the_head() -> None:
    """Dense cells are outside of it; left in by the option, they are not."""
    scene, masks = views_of(curtains)
    hull = build_hull(scene, masks, (), COARSE)
    assert hull.head_distance[hull.dense].min() > 0
    whole = build_hull(scene, masks, (), replace(COARSE, cut_head=False))
    assert whole.head_distance[whole.dense].min() < -0.02


@pytest.mark.parametrize("view", [0, 2, 5])
def test_leaving_out_a_view_lets_the_hull_grow(view: int) -> None:
    """One silhouette less can empty no cell; the same holds for votes that must be unanimous."""
    scene, masks = views_of(cap)
    full = build_hull(scene, masks, (), COARSE)
    fewer = build_hull(*without(scene, masks, view), (), COARSE)
    assert lost((full, full.loose), (fewer, fewer.loose)) == 0
    votes = replace(COARSE, mode="votes")
    all_of_them = build_hull(scene, masks, (), replace(votes, min_views=8))
    rest = build_hull(*without(scene, masks, view), (), replace(votes, min_views=7))
    assert lost((all_of_them, all_of_them.dense), (rest, rest.dense)) == 0


@pytest.mark.parametrize("mode", ["votes", "labels"])
def test_asking_fewer_views_lets_the_hull_grow(mode: str) -> None:
    """With one vote less to win no cell is lost."""
    scene, masks = views_of(cap)
    hulls = [
        build_hull(scene, masks, (), replace(COARSE, mode=mode, min_views=n)) for n in (8, 5, 4, 2)
    ]
    for small, large in itertools.pairwise(hulls):
        assert lost((small, small.dense), (large, large.dense)) == 0
    assert hulls[0].dense.sum() < hulls[-1].dense.sum()


def test_votes_are_the_count_of_masks() -> None:
    """A cell is in the thesis's hull exactly when enough pictures have hair at its pixel."""
    scene, masks = views_of(plait)
    options = replace(COARSE, mode="votes", min_views=4, slack=0.0, cut_head=False)
    hull = build_hull(scene, masks, (), options)
    centres = hull.grid.centres().astype(np.float64)
    votes = np.zeros(hull.grid.shape, int)
    for camera, mask in zip(scene.cameras, masks, strict=True):
        column, row = np.moveaxis(np.floor(camera.project(centres)).astype(int), -1, 0)
        here = (column >= 0) & (row >= 0) & (column < WIDTH) & (row < HEIGHT)
        hair = mask.hair[np.clip(row, 0, HEIGHT - 1), np.clip(column, 0, WIDTH - 1)]
        votes += here & hair
    parts, _ = ndimage.label(votes >= 4)
    largest = parts == np.bincount(parts[parts > 0]).argmax()
    assert (hull.dense == largest).mean() > 0.9999


def test_erosions_then_dilations_open_the_voted_hull() -> None:
    """The thesis's 2 and 2 make a subset; erosions alone a smaller one."""
    scene, masks = views_of(plait)
    votes = replace(COARSE, mode="votes", min_views=4, cut_head=False)
    plain, opened, eroded = (
        build_hull(scene, masks, (), replace(votes, erosions=e, dilations=d)).dense
        for e, d in ((0, 0), (1, 1), (1, 0))
    )
    np.testing.assert_array_equal(opened, ndimage.binary_opening(plain))
    np.testing.assert_array_equal(eroded, ndimage.binary_erosion(plain))


def test_what_a_view_sees_in_front_of_the_face_is_not_hair() -> None:
    """Silhouettes from the side cannot tell the window before the face; the person's label can."""
    scene, masks = views_of(curtains)
    x, y = np.meshgrid(np.linspace(-0.03, 0.03, 7), np.linspace(-0.04, 0.04, 7))
    window = np.stack([x, y, np.full(x.shape, 0.12)], axis=-1)
    votes = build_hull(scene, masks, (), replace(COARSE, mode="votes", min_views=2))
    labels = build_hull(scene, masks, (), COARSE)
    assert held(votes, votes.dense, window).mean() > 0.8
    assert not held(labels, labels.loose, window).any()


def test_skin_that_nearer_views_see_bare_bears_no_layer_of_hair() -> None:
    """Views from behind have hair there, but before the head, which is too small here."""
    scene, masks = views_of(cap)
    head = replace(scene.head, vertices=0.95 * scene.head.vertices)
    fine = replace(COARSE, voxel_size=0.004, front_margin=0.012)
    hull = build_hull(replace(scene, head=head), masks, (), fine)
    assert hull.grid.centres_of(hull.dense)[:, 2].max() < 0.08


def test_forgiving_a_view_keeps_more() -> None:
    """One view may err: no cell is lost by it, and a view with a wrong mask does no harm."""
    scene, masks = views_of(cap)
    strict = build_hull(scene, masks, (), replace(COARSE, forgive=0))
    kind = build_hull(scene, masks, (), replace(COARSE, forgive=1))
    assert lost((strict, strict.loose), (kind, kind.loose)) == 0
    assert kind.loose.sum() > strict.loose.sum()
    labels = masks[2].labels.copy()
    labels[:, : WIDTH // 2] = BACKGROUND
    wrong = (*masks[:2], Mask(labels, True), *masks[3:])
    wanted = true_cells(kind, cap)
    points = kind.grid.centres()[wanted].astype(np.float64)
    for forgive, right in ((0, False), (1, True)):
        hull = build_hull(scene, wrong, (), replace(COARSE, forgive=forgive))
        assert (held(hull, hull.loose, points).mean() > 0.995) == right


def test_the_misfit_of_the_scene_decides_whether_to_forgive() -> None:
    """Left to itself the hull forgives a view where the cameras are known to be off, else none."""
    scene, masks = views_of(cap)
    strict, kind = (build_hull(scene, masks, (), replace(COARSE, forgive=n)) for n in (0, 1))
    for residual, wanted in ((None, strict), (0.5, strict), (50.0, kind)):
        hull = build_hull(replace(scene, residual_px=residual), masks, (), COARSE)
        assert hull.loose.sum() == wanted.loose.sum()


def test_hair_beyond_the_border_of_a_picture_is_kept() -> None:
    """Two photos end above the plait's end; others see it all. Where hair ends inside, it ends."""
    scene, masks = views_of(plait)
    cut, ended = [], []
    cameras = list(scene.cameras)
    for i, mask in enumerate(masks):
        if i not in (2, 6):
            cut.append(mask)
            ended.append(mask)
            continue
        cameras[i] = replace(cameras[i], height=HEIGHT - 40)
        cut.append(Mask(mask.labels[:-40], True))
        labels = mask.labels[:-40].copy()
        labels[-6:][labels[-6:] == HAIR] = BACKGROUND
        ended.append(Mask(labels, True))
    short = replace(scene, cameras=tuple(cameras))
    low = np.array([0.0, -0.17, -0.12])
    assert cameras[2].project(low)[1] > HEIGHT - 40
    kept, lost_there = (build_hull(short, tuple(seen), (), COARSE) for seen in (cut, ended))
    assert held(kept, kept.dense, low)
    assert not held(lost_there, lost_there.loose, low)


def test_pictures_of_several_sizes_carve_together() -> None:
    """One photo of twice the resolution changes next to nothing."""
    scene, masks = views_of(cap)
    big = scene.cameras[3].resized(2 * WIDTH, 2 * HEIGHT)
    cameras = (*scene.cameras[:3], big, *scene.cameras[4:])
    mixed = (*masks[:3], drawn(big, cap), *masks[4:])
    one = build_hull(scene, masks, (), COARSE)
    other = build_hull(replace(scene, cameras=cameras), mixed, (), COARSE)
    assert other.dense.sum() == pytest.approx(one.dense.sum(), rel=0.03)


def test_the_finest_cells_allowed_fit_long_hair() -> None:
    """What can be judged before any stage runs is refused there: no allowed size is too fine."""
    (finest,) = (each.low for each in describe(Options) if each.name == "voxel_size")
    VoxelGrid.around([-0.225, -0.55, -0.225], [0.225, 0.1, 0.225], finest)
    with pytest.raises(OptionError, match=r"'0\.001', expected a number from 0\.0015"):
        make_options(Options, {"voxel_size": "0.001"}, "visual_hull")


def test_masks_that_call_everything_hair_bound_the_work(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Whole photos of hair are carved in larger cells, and a warning says so."""
    scene, masks = views_of(cap)
    assert build_hull(scene, masks, (), Options()).grid.spacing == Options().voxel_size
    assert caplog.text == ""
    everything = tuple(Mask(np.full_like(mask.labels, 255), True) for mask in masks)
    hull = build_hull(scene, everything, (), Options())
    assert np.count_nonzero(hull.loose) * Options().voxel_size ** 3 < 1.3 * MOST_HAIR
    assert "litres of hair" in caplog.text


def test_masks_that_do_not_overlap_in_space_are_an_error() -> None:
    """One line that says what to check."""
    scene, masks = views_of(cap)
    bare = []
    for i, mask in enumerate(masks):
        labels = np.zeros_like(mask.labels)
        labels[10:20, 60:70] = HAIR if i % 2 else BACKGROUND
        labels[120:130, 60:70] = BACKGROUND if i % 2 else HAIR
        bare.append(Mask(labels, True))
    with pytest.raises(InputError, match=r"^the hull is empty.*check masks and cameras$"):
        build_hull(scene, tuple(bare), (), COARSE)


def test_a_mask_for_every_camera_is_needed() -> None:
    """Both numbers are named."""
    scene, masks = views_of(cap)
    with pytest.raises(InputError, match="8 cameras but 7 masks"):
        build_hull(scene, masks[1:], (), COARSE)


def test_the_same_masks_give_the_same_hull() -> None:
    """Cell by cell."""
    scene, masks = views_of(curtains)
    first, second = (build_hull(scene, masks, (), COARSE) for _ in range(2))
    for name in ("dense", "loose", "head_distance"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_wide_hair_that_pictures_cut_off_ends_near_them() -> None:
    """Pictures of the middle alone: hair goes on beyond them by `BEYOND`, whoever sees it not."""
    half, (scene, masks) = 0.1, views_of(curtains)
    left, right = (WIDTH // 2 + side * round(half / PIXEL) for side in (-1, 1))
    cameras = [
        replace(c, width=right - left, centre=(c.centre[0] - left, c.centre[1]))
        for c in scene.cameras
    ]
    narrow = tuple(Mask(np.ascontiguousarray(mask.labels[:, left:right]), True) for mask in masks)
    hull = build_hull(replace(scene, cameras=tuple(cameras)), narrow, (), COARSE)
    across = np.linalg.norm(hull.grid.centres_of(hull.loose)[:, [0, 2]], axis=1)
    assert half + BEYOND < across.max() < (half + BEYOND) / np.cos(np.pi / 8) * 1.2
