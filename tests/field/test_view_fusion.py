"""Laws of fusing the 2D orientations of all views into 3D directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bun import ALONG, CENTRE, all_hair, bun, depth_in_bun, main_directions, off_deg, seen, turn

from hairkit.arrays import Float32Array, Float64Array
from hairkit.cameras.projection_kernels import pack_camera
from hairkit.field.view_fusion import (
    Fading,
    FusedViews,
    FusionOptions,
    LooseCells,
    OrientedView,
    add_planes,
    fuse_views,
)
from hairkit.types.camera import Camera, CameraModel
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.volume import symmetric_matrices
from hairkit.types.waves import Waves

PLAIN = FusionOptions(pool=0.0, unslant=False)
VISIBLE = replace(PLAIN, see_through=0.0)


def fuse(
    options: FusionOptions = PLAIN,
    *,
    cameras: tuple[Camera, ...] | None = None,
    maps: tuple[OrientationMap, ...] | None = None,
    masks: tuple[Mask, ...] | None = None,
    waves: Waves | None = None,
    min_views: int = 1,
) -> FusedViews:
    """Fuse the views of the bun, whose cells are all dense; straight hair by default."""
    cameras = turn() if cameras is None else cameras
    masks = tuple(all_hair(camera) for camera in cameras) if masks is None else masks
    maps = tuple(seen(camera) for camera in cameras) if maps is None else maps
    return fuse_views(cameras, masks, maps, bun(), waves or Waves(), options, min_views)


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
@pytest.mark.parametrize("along", [ALONG, np.array([0.2, -0.3, -0.9]), np.array([0, 1.0, 0])])
def test_exact_angles_give_the_true_direction(along: Float64Array, model: CameraModel) -> None:
    """Within 2 degrees in every cell that any view knows; nearly all are known near the surface."""
    cameras = turn(model)
    fused = fuse(cameras=cameras, maps=tuple(seen(camera, along) for camera in cameras))
    known = fused.certainty > 0.05
    assert known[depth_in_bun(bun())[bun().loose] < 0.01].mean() > 0.95
    assert off_deg(main_directions(fused.tensor[known]), along).max() < 2


def test_one_view_alone_is_not_certain() -> None:
    """A single plane leaves the direction in it open: certainty 0, by any number of its pixels."""
    assert fuse(cameras=turn()[:2]).certainty.max() > 0.1
    assert fuse(cameras=turn()[:1]).certainty.max() < 1e-6


def test_the_slant_of_waves_is_removed_before_views_are_fused() -> None:
    """Views that all show the same slant beside the truth give the truth; untreated they do not."""
    slant = 0.3
    waves = Waves(0.005, 0.03, slant)
    upright = np.array([0.0, 1.0, 0.0])
    maps = tuple(seen(camera, upright) for camera in turn("orthographic"))
    slanted = tuple(OrientationMap(wrap_angle(m.angle + slant), m.confidence) for m in maps)
    for unslant in (True, False):
        options = replace(VISIBLE, unslant=unslant)
        fused = fuse(options, cameras=turn("orthographic"), maps=slanted, waves=waves)
        sure = fused.tensor[fused.certainty > 0.3]
        error = np.median(off_deg(main_directions(sure), upright))
        assert error < 1 if unslant else error > 5


def test_seeing_through_falls_off_with_depth() -> None:
    """Deep cells are less sure than shallow ones, and more so the less is seen through."""
    depth = depth_in_bun(bun())[bun().loose]
    deep, shallow = depth > 0.03, depth < 0.015
    maps = [seen(camera) for camera in turn()]
    faint = tuple(OrientationMap(found.angle, 0.1 * found.confidence) for found in maps)
    much, little = (fuse(replace(PLAIN, see_through=s), maps=faint).certainty for s in (0.04, 0.01))
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
        results.append(fuse(maps=tuple(maps), masks=tuple(masks)))
    assert results[0].tensor.tobytes() == results[1].tensor.tobytes()
    trusted = seen(cameras[3])
    maps[3] = OrientationMap(wrap_angle(trusted.angle + 1.0), trusted.confidence)
    masks[3] = all_hair(cameras[3])
    wrong = fuse(maps=tuple(maps), masks=tuple(masks))
    assert np.abs(wrong.tensor - results[0].tensor).max() > 0.1


def test_a_more_confident_view_has_more_say() -> None:
    """Of two views that a third contradicts, the field leans to whom is trusted."""
    cameras = turn()

    def error(trust: float) -> float:
        maps = [seen(camera) for camera in cameras]
        shaken = wrap_angle(maps[2].angle + 0.4)
        maps[2] = OrientationMap(shaken, np.full(shaken.shape, trust, np.float32))
        return float(off_deg(main_directions(fuse(maps=tuple(maps)).tensor)).mean())

    assert error(0.05) < 0.5 * error(1.0)


def test_cells_that_too_few_views_see_are_not_fused() -> None:
    """Raising `min_views` only removes certainty."""
    some, most = (fuse(VISIBLE, min_views=n).certainty for n in (1, 4))
    assert (most <= some + 1e-6).all()
    assert np.count_nonzero(most) < np.count_nonzero(some)


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
