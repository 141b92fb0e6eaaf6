"""Laws of fusing the views' orientations and of filling the rest of the hair."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.tensor_diffusion import Options, solve_field

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.cameras.projection_kernels import pack_camera
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.field.view_fusion import Fading, LooseCells, OrientedView, add_planes
from hairkit.testing import ball_head
from hairkit.types.camera import Camera, CameraModel
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.volume import Hull, OrientationField, VoxelGrid, symmetric_matrices
from hairkit.types.waves import Waves

RADIUS = 0.06
CENTRE = np.array([0.0, 0.16, 0.0])
"""A bun of hair on top of the head; it is round, so that every camera sees half of it."""
SPACING = 0.008
ALONG = np.array([0.5, -0.75, 0.433])
PLAIN = Options(scalp_weight=0.0, pool=0.0, unslant=False, smoothness=1e-3)
"""Fusion and nothing else."""


def turn(model: CameraModel = "perspective") -> tuple[Camera, ...]:
    """Eight cameras around the bun, on two levels."""
    return tuple(
        Camera.on_turn(
            45.0 * i,
            elevation_deg=12.0 * (i % 2),
            distance=0.6,
            target=CENTRE,
            focal=540.0 if model == "perspective" else 900.0,
            width=120,
            height=120,
            model=model,
        )
        for i in range(8)
    )


def bun() -> Hull:
    """The bun in a grid that is symmetric about the vertical axis."""
    low, high = CENTRE - 0.08, CENTRE + 0.08
    low[1] -= 0.04
    grid = VoxelGrid.around(low, high, SPACING)
    centres = grid.centres().astype(np.float64)
    distance = np.linalg.norm(centres, axis=-1) - 0.1
    hair = (np.linalg.norm(centres - CENTRE, axis=-1) < RADIUS) & (distance > 0)
    return Hull(grid, hair, hair, distance.astype(np.float32))


def seen(camera: Camera, along: Float64Array = ALONG) -> OrientationMap:
    """The exact image angle of strands along `along`, which depends on the pixel alone."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    dx, dy, dz = camera.rotation @ along
    if camera.model == "perspective":
        dx = dx - dz * (x - camera.centre[0]) / camera.focal
        dy = dy - dz * (y - camera.centre[1]) / camera.focal
    angle = wrap_angle(np.arctan2(dy, dx) + 0 * x)
    return OrientationMap(angle, np.ones(x.shape, np.float32))


def all_hair(camera: Camera) -> Mask:
    """A picture full of hair: which cell is seen is the hull's affair."""
    return Mask(np.full((camera.height, camera.width), HAIR, np.uint8), True)


def solve(
    options: Options = PLAIN,
    *,
    cameras: tuple[Camera, ...] | None = None,
    maps: tuple[OrientationMap, ...] | None = None,
    masks: tuple[Mask, ...] | None = None,
    hull: Hull | None = None,
    waves: Waves | None = None,
) -> OrientationField:
    """Solve the bun's field, of straight hair by default."""
    cameras = turn() if cameras is None else cameras
    hull = bun() if hull is None else hull
    scene = Scene(tuple("abcdefgh"[: len(cameras)]), cameras, ball_head())
    return solve_field(
        scene,
        tuple(all_hair(camera) for camera in cameras) if masks is None else masks,
        tuple(seen(camera) for camera in cameras) if maps is None else maps,
        hull,
        waves or Waves(),
        measure_scalp_distance(scene.head, hull),
        Parting(),
        options,
    )


def main_directions(field: OrientationField, cells: BoolArray) -> Float64Array:
    """The eigenvectors (N, 3) of the largest eigenvalues."""
    vectors: Float64Array = np.linalg.eigh(symmetric_matrices(field.tensor[cells]))[1][:, :, 2]
    return vectors


def off_deg(directions: Float64Array, along: Float64Array = ALONG) -> Float64Array:
    """Angles in degrees between undirected directions and one known."""
    cosine = np.abs(directions @ along) / np.linalg.norm(along)
    return np.degrees(np.arccos(np.clip(cosine, 0, 1)))


def depth_in_bun(hull: Hull) -> Float64Array:
    return np.asarray(RADIUS - np.linalg.norm(hull.grid.centres() - CENTRE, axis=-1))


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
@pytest.mark.parametrize("along", [ALONG, np.array([0.2, -0.3, -0.9]), np.array([0, 1.0, 0])])
def test_exact_angles_give_the_true_direction(along: Float64Array, model: CameraModel) -> None:
    """Within 2 degrees where it is visible, and where it is not: diffusion keeps constants."""
    cameras = turn(model)
    field = solve(cameras=cameras, maps=tuple(seen(camera, along) for camera in cameras))
    hull = bun()
    shallow = hull.dense & (depth_in_bun(hull) < 0.01)
    assert (field.confidence[shallow] > 0).mean() > 0.95
    assert off_deg(main_directions(field, hull.dense), along).max() < 2


def test_straight_hair_survives_the_default_options() -> None:
    """Pooling, slant and prior leave a straight field away from the scalp as it is."""
    cameras = turn()
    maps = [seen(camera) for camera in cameras]
    field = solve(Options(), maps=tuple(maps))
    far = bun().dense & (bun().head_distance > 0.05)
    assert np.median(off_deg(main_directions(field, far))) < 2


def test_tight_curls_hang_along_the_prior_whatever_the_maps_say() -> None:
    """Orientation maps of coils are noise: other maps give the same field; not so without coils."""
    cameras, across = turn(), np.array([1.0, 0.0, 0.0])
    others = tuple(seen(camera, across) for camera in cameras)
    for waves, same in ((Waves(0.007, 0.027), True), (Waves(), False)):
        first, second = (solve(Options(), maps=maps, waves=waves) for maps in (None, others))
        assert np.isfinite(first.tensor).all()
        assert np.allclose(first.tensor, second.tensor, atol=1e-4) == same


def test_the_slant_of_waves_is_removed_before_views_are_fused() -> None:
    """Views that all show the same slant beside the truth give the truth; untreated they do not."""
    slant = 0.3
    waves = Waves(0.005, 0.03, slant)
    upright = np.array([0.0, 1.0, 0.0])
    maps = tuple(seen(camera, upright) for camera in turn("orthographic"))
    slanted = tuple(OrientationMap(wrap_angle(m.angle + slant), m.confidence) for m in maps)
    for unslant in (True, False):
        options = replace(PLAIN, unslant=unslant, see_through=0.0)
        field = solve(options, cameras=turn("orthographic"), maps=slanted, waves=waves)
        shallow = bun().dense & (field.confidence > 0.3)
        error = np.median(off_deg(main_directions(field, shallow), upright))
        assert error < 1 if unslant else error > 5


def test_what_lies_unseen_inside_is_filled_from_around() -> None:
    """With only visible cells fused, the core of the bun still gets the direction."""
    field = solve(replace(PLAIN, see_through=0.0))
    core = bun().dense & (depth_in_bun(bun()) > 0.035)
    assert field.confidence[core].max() == 0
    assert off_deg(main_directions(field, core)).max() < 2


def test_seeing_through_falls_off_with_depth() -> None:
    """Deep cells are less sure than shallow ones, and more so the less is seen through."""
    hull = bun()
    deep = hull.dense & (depth_in_bun(hull) > 0.03)
    shallow = hull.dense & (depth_in_bun(hull) < 0.015)
    maps = [seen(camera) for camera in turn()]
    faint = tuple(OrientationMap(found.angle, 0.1 * found.confidence) for found in maps)
    much, little = (
        solve(replace(PLAIN, see_through=s), maps=faint).confidence for s in (0.04, 0.01)
    )
    assert 0 < little[deep].mean() < 0.5 * much[deep].mean() < 0.4 * much[shallow].mean()


@pytest.mark.parametrize("how", ["confidence", "mask"])
def test_views_that_know_nothing_have_no_say(how: str) -> None:
    """A view of confidence 0, or with no hair where the bun is, changes no byte by its angles."""
    cameras = turn()
    maps = [seen(camera) for camera in cameras]
    masks = [all_hair(camera) for camera in cameras]
    corner = np.zeros((120, 120), np.uint8)
    corner[0, 0] = HAIR
    results = []
    for turned in (0.0, 1.0):
        angle = wrap_angle(maps[3].angle + turned)
        trust = maps[3].confidence * (0 if how == "confidence" else 1)
        maps[3] = OrientationMap(angle, trust)
        masks[3] = Mask(corner, True) if how == "mask" else masks[3]
        results.append(solve(maps=tuple(maps), masks=tuple(masks)))
    assert results[0].tensor.tobytes() == results[1].tensor.tobytes()
    trusted = seen(cameras[3])
    maps[3] = OrientationMap(wrap_angle(trusted.angle + 1.0), trusted.confidence)
    masks[3] = all_hair(cameras[3])
    wrong = solve(maps=tuple(maps), masks=tuple(masks))
    assert np.abs(wrong.tensor - results[0].tensor).max() > 0.1


def test_a_more_confident_view_has_more_say() -> None:
    """Of two views that a third contradicts, the field leans to whom is trusted."""
    cameras = turn()

    def error(trust: float) -> float:
        maps = [seen(camera) for camera in cameras]
        shaken = wrap_angle(maps[2].angle + 0.4)
        maps[2] = OrientationMap(shaken, np.full(shaken.shape, trust, np.float32))
        return float(off_deg(main_directions(solve(maps=tuple(maps)), bun().dense)).mean())

    assert error(0.05) < 0.5 * error(1.0)


def test_one_view_alone_is_not_certain() -> None:
    """A single plane leaves the direction in it open: certainty 0, by any number of its pixels."""
    cameras = (turn()[0],)
    hull = bun()
    assert solve(cameras=turn()[:2]).confidence[hull.dense].max() > 0.1
    weight = replace(PLAIN, scalp_weight=0.1)  # something must be known for the solver
    alone = solve(weight, cameras=cameras).confidence
    far = hull.dense & (hull.head_distance > weight.scalp_reach)
    assert alone[far].max() < 1e-6


def test_cells_that_too_few_views_see_are_not_fused() -> None:
    """Raising `min_views` only removes certainty."""
    some, most = (solve(replace(PLAIN, see_through=0.0, min_views=n)).confidence for n in (1, 4))
    assert (most <= some + 1e-6).all()
    assert np.count_nonzero(most) < np.count_nonzero(some)


def quarter_turned(six: Float32Array, times: int) -> Float32Array:
    """Turn a field (X, Y, Z, 6) about the vertical axis, the tensors with it."""
    angle = np.pi / 2 * times
    c, s = np.round([np.cos(angle), np.sin(angle)])
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    turned = np.rot90(six, times, axes=(2, 0))
    matrices = rotation @ symmetric_matrices(turned) @ rotation.T
    pick = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
    return matrices[..., pick[0], pick[1]].astype(np.float32)


@pytest.mark.parametrize("times", [1, 3])
def test_turning_the_whole_scene_turns_the_field(times: int) -> None:
    """Cameras, hull and head turned by quarter turns: the field turns with them."""
    angle = np.pi / 2 * times
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    hull, cameras = bun(), turn()
    turned_cameras, maps = [], [seen(camera) for camera in cameras]
    for camera in cameras:
        matrix = camera.camera_from_head.copy()
        matrix[:3, :3] = camera.rotation @ rotation.T
        turned_cameras.append(replace(camera, camera_from_head=matrix))
    maps[1] = OrientationMap(wrap_angle(maps[1].angle + 0.5), maps[1].confidence)
    options = replace(PLAIN, tolerance=1e-6)
    straight = solve(options, cameras=cameras, maps=tuple(maps))
    turned = solve(options, cameras=tuple(turned_cameras), maps=tuple(maps))
    wanted = quarter_turned(straight.tensor, times)
    close = np.abs(turned.tensor - wanted).max(axis=-1)[hull.dense] < 0.02
    assert close.mean() > 0.99  # a cell may fall on the other side of a pixel's edge
    assert np.abs(wanted - straight.tensor).max() > 0.3


def test_the_prior_acts_only_near_the_scalp() -> None:
    """Beyond its reach no certainty changes; within it, certainty grows by the prior's weight."""
    hull = bun()
    bare, combed = (solve(replace(PLAIN, scalp_weight=w)).confidence for w in (0.0, 0.1))
    near = hull.loose & (hull.head_distance < PLAIN.scalp_reach)
    np.testing.assert_array_equal(bare[~near], combed[~near])
    sure = near & (combed < 1)
    assert sure.any()
    np.testing.assert_allclose((combed - bare)[sure], 0.1, atol=1e-6)


def test_a_heavy_prior_decides_at_the_scalp_and_a_light_one_does_not() -> None:
    """With lift far above the flow hair stands up from the head, where the prior is strong."""
    hull = bun()
    near = hull.dense & (hull.head_distance < 0.5 * PLAIN.scalp_reach)
    outward = hull.grid.centres()[near].astype(np.float64)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    cosines = []
    for weight in (1e-6, 50.0):
        field = solve(replace(PLAIN, scalp_weight=weight, scalp_lift=5.0))
        cosines.append(np.abs(np.sum(main_directions(field, near) * outward, axis=1)).mean())
    assert cosines[1] > 0.95
    assert cosines[0] < cosines[1] - 0.1


def test_kept_cells_keep_what_was_fused() -> None:
    """With Dirichlet conditions fused cells have their own direction, whatever the smoothness."""
    cameras, hull = turn(), bun()
    maps = [seen(camera) for camera in cameras]
    maps[2] = OrientationMap(wrap_angle(maps[2].angle + 0.5), maps[2].confidence)
    rough = replace(PLAIN, see_through=0.0, smoothness=1e-4, tolerance=1e-4)
    fused = solve(rough, maps=tuple(maps))
    soft, hard = (
        solve(replace(rough, smoothness=1.0, hard=h), maps=tuple(maps)) for h in (False, True)
    )
    known = hull.dense & (fused.confidence > 0.3)
    gaps = [np.abs(f.tensor - fused.tensor)[known].max() for f in (soft, hard)]
    assert gaps[1] < 0.02 < gaps[0]


def test_fields_are_finite_and_zero_outside_the_hair() -> None:
    """Tensors live in the loose hull; trace is near 1, confidence in [0, 1]."""
    field, hull = solve(Options()), bun()
    assert not field.tensor[~hull.loose].any()
    assert not field.confidence[~hull.loose].any()
    np.testing.assert_allclose(field.tensor[hull.loose][:, :3].sum(axis=1), 1, atol=0.05)
    assert field.confidence.min() >= 0
    assert field.confidence.max() <= 1


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
def test_planes_equal_their_twin(model: CameraModel) -> None:
    """Cell by cell: the plane through the ray and the seen direction, weighted by depth."""
    camera = turn(model)[1]
    rng = np.random.default_rng(5)
    points = (CENTRE + rng.uniform(-0.09, 0.09, (300, 3))).astype(np.float32)
    inner = rng.random(300) < 0.9
    angle = rng.uniform(0, np.pi, (120, 120)).astype(np.float32)
    certainty = (rng.random((120, 120)) * (rng.random((120, 120)) < 0.8)).astype(np.float32)
    front = rng.uniform(0.5, 0.65, (40, 40)).astype(np.float32)
    for see_through in (0.0, 0.03):
        planes, count = np.zeros((300, 6)), np.zeros(300, np.int64)
        view = OrientedView(pack_camera(camera), angle, certainty, front)
        cells, fading = LooseCells(points, inner), Fading(see_through, 0.01)
        add_planes(0, 300, view, fading, cells, planes, count)
        for i, point in enumerate(points.astype(np.float64)):
            wanted = twin_plane(camera, point, angle, certainty, front, see_through, 0.01)
            wanted = wanted if inner[i] else np.zeros((3, 3))
            np.testing.assert_allclose(symmetric_matrices(planes[i]), wanted, atol=1e-4)
            assert count[i] == (wanted.any())


def twin_plane(
    camera: Camera,
    point: Float64Array,
    angle: Float32Array,
    certainty: Float32Array,
    front: Float32Array,
    see_through: float,
    free_depth: float,
) -> Float64Array:
    """The weighted plane `w N N^T` (3, 3) that one view gives a point."""
    column, row = np.floor(camera.project(point)).astype(int)
    if not (0 <= column < camera.width and 0 <= row < camera.height):
        return np.zeros((3, 3))
    weight = float(certainty[row, column])
    depth = camera.to_camera(point)[2] - front[row // 3, column // 3] - free_depth
    if depth > 0:
        weight *= np.exp(-depth / see_through) if see_through else 0
    if weight < 1e-4:
        return np.zeros((3, 3))
    direction = np.cos(angle[row, column]) * camera.rotation[0]
    direction = direction + np.sin(angle[row, column]) * camera.rotation[1]
    normal = np.cross(camera.view_direction(point), direction)
    normal /= np.linalg.norm(normal)
    return weight * np.outer(normal, normal)
