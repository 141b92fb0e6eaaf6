"""Laws of depth maps."""

from __future__ import annotations

import numpy as np
import pytest
from ball_camera import camera_at

from hairkit.arrays import Float32Array, Float64Array
from hairkit.cameras.depth_raster import (
    depth_behind,
    head_depth,
    point_depth,
    splat_depth,
)
from hairkit.cameras.projection_kernels import pack_camera
from hairkit.testing import ball_head
from hairkit.types.camera import Camera, CameraModel
from hairkit.types.head import Capsules, Head

BALL = 0.1
MODELS: tuple[CameraModel, ...] = ("perspective", "orthographic")


def sphere_depth(camera: Camera) -> Float64Array:
    """The axial depth of the ball at every pixel's centre, infinity beside it."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    start, way = camera.rays(np.stack([x, y], axis=-1))
    along = -np.sum(start * way, axis=-1)
    square = BALL**2 - (np.sum(start * start, axis=-1) - along**2)
    hit = start + (along - np.sqrt(np.maximum(square, 0)))[..., None] * way
    return np.where(square > 0, camera.to_camera(hit)[..., 2], np.inf)


@pytest.mark.parametrize("model", MODELS)
def test_the_depth_of_a_ball_is_the_sphere_s(model: CameraModel) -> None:
    """A fine mesh of a ball has the depth of the formula, and covers the same pixels."""
    camera = camera_at(70, 20, model)
    depth, wanted = head_depth(ball_head(96), camera), sphere_depth(camera)
    inner = np.isfinite(wanted) & (wanted < wanted.min() + 0.6 * BALL)
    assert np.isfinite(depth[inner]).all()
    np.testing.assert_allclose(depth[inner], wanted[inner], atol=2e-4)
    assert (np.isfinite(depth) != np.isfinite(wanted)).mean() < 0.005


@pytest.mark.parametrize("model", MODELS)
def test_the_depth_of_a_large_slanted_triangle_is_its_plane_s(model: CameraModel) -> None:
    """Depth is right between far corners too, where it is not linear in the picture."""
    camera = camera_at(0, 0, model)
    corners = np.array([[-0.2, -0.3, -0.4], [0.3, -0.2, 0.1], [0.0, 0.4, 0.2]], np.float32)
    zero = np.zeros((1, 3), np.float32)
    capsules = Capsules(zero, zero, np.ones((1, 2), np.float32))
    head = Head(
        corners,
        np.array([[0, 1, 2]], np.int32),
        np.zeros((3, 2), np.float32),
        np.ones(3, np.float32),
        None,
        np.zeros((3, 3), np.float32),
        capsules,
    )
    depth = head_depth(head, camera)
    rows, columns = np.nonzero(np.isfinite(depth))
    assert len(rows) > 1000
    found = camera.unproject(np.stack([columns, rows], axis=-1) + 0.5, depth[rows, columns])
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0]).astype(np.float64)
    off_plane = (found - corners[0]) @ (normal / np.linalg.norm(normal))
    np.testing.assert_allclose(off_plane, 0, atol=1e-5)


def splatted(
    camera: Camera, points: Float32Array, radius: float, size: int, far: float = np.inf
) -> Float32Array:
    """Draw the points into an empty depth map of `size` x `size` pixels."""
    depth = np.full((size, size), far, np.float32)
    splat_depth(pack_camera(camera), points, radius, depth)
    return depth


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("size", [120, 40])
def test_a_splat_is_the_nearest_of_the_squares_over_a_pixel(model: CameraModel, size: int) -> None:
    """Point by point in NumPy: no pixel is deeper than any point drawn over it, none is missed."""
    camera = camera_at(20, 15, model)
    points = np.random.default_rng(2).normal(0, 0.08, (60, 3)).astype(np.float32)
    wanted = np.full((size, size), np.inf)
    for point in points.astype(np.float64):
        pixel = camera.project(point) * size / camera.height
        z = camera.to_camera(point)[2]
        scale = camera.focal / (z if model == "perspective" else 1)
        reach = 0.01 * scale * size / camera.height
        low = np.maximum(np.floor(pixel - reach), 0).astype(int)
        high = np.maximum(np.floor(pixel + reach) + 1, 0).astype(int)
        square = wanted[low[1] : high[1], low[0] : high[0]]
        np.minimum(square, z, out=square)
    np.testing.assert_allclose(splatted(camera, points, 0.01, size), wanted, rtol=1e-5)


@pytest.mark.parametrize("model", MODELS)
def test_a_splat_only_brings_nearer(model: CameraModel) -> None:
    """What is already in the map stays where it is nearer; the order of points does not matter."""
    camera = camera_at(0, 0, model)
    points = np.random.default_rng(3).normal(0, 0.05, (200, 3)).astype(np.float32)
    before = float(camera.to_camera(np.zeros(3))[2])
    depth = splatted(camera, points, 0.005, 120, far=before)
    assert depth.max() <= np.float32(before)
    assert (depth < before).any()
    np.testing.assert_array_equal(depth, splatted(camera, points[::-1], 0.005, 120, far=before))


def test_points_behind_the_camera_or_beside_the_picture_draw_nothing() -> None:
    """They leave the map as it is."""
    camera = camera_at(0, 0, "perspective")
    points = np.array([camera.position - camera.forward, [5.0, 0, 0], [0, -5.0, 0]], np.float32)
    assert not np.isfinite(splatted(camera, points, 0.01, 60)).any()


@pytest.mark.parametrize("model", MODELS)
def test_discs_equal_their_twin(model: CameraModel) -> None:
    """Pixel by pixel in NumPy: the nearest of the discs that hold its centre, or of middles."""
    camera = camera_at(20, 15, model)
    points = np.random.default_rng(4).normal(0, 0.08, (40, 3)).astype(np.float32)
    centres = np.stack(np.meshgrid(np.arange(120) + 0.5, np.arange(120) + 0.5), axis=-1)
    wanted = np.full((120, 120), np.inf)
    for point in points.astype(np.float64):
        pixel, z = camera.project(point), camera.to_camera(point)[2]
        reach = 0.012 * camera.focal / (z if model == "perspective" else 1)
        held = np.linalg.norm(centres - pixel, axis=-1) <= reach
        held |= (np.floor(centres) == np.floor(pixel)).all(axis=-1)
        wanted[held] = np.minimum(wanted[held], z)
    np.testing.assert_allclose(point_depth(camera, points, 0.012), wanted, rtol=1e-5)


@pytest.mark.parametrize("model", MODELS)
def test_depth_behind_equals_its_twin(model: CameraModel) -> None:
    """Point by point: its depth less the map's at its pixel, whatever the number of threads."""
    camera = camera_at(40, -10, model)
    rng = np.random.default_rng(6)
    depth = rng.uniform(0.6, 0.9, (120, 120)).astype(np.float32)
    points = rng.uniform(-0.3, 0.3, (20000, 3)).astype(np.float32)
    column, row = np.floor(camera.project(points)).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < 120) & (row < 120)
    wanted = np.full(len(points), np.inf)
    wanted[inside] = camera.depth(points)[inside] - depth[row[inside], column[inside]]
    found = depth_behind(camera, depth, points)
    np.testing.assert_allclose(found[inside], wanted[inside], atol=1e-9)
    assert np.isinf(found[~inside]).all()
