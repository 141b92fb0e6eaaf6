"""Laws of wisps: thin locks that the opened masks do not hold."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.field.wisps import find_wisps
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.volume import Hull, VoxelGrid

BALL = 0.1
HEAD = ball_head(rings=24)
GRID = VoxelGrid.around([-0.14, -0.14, -0.14], [0.14, 0.14, 0.14], 0.005)
CAMERAS = tuple(
    Camera.on_turn(45.0 * k, distance=0.7, focal=600.0, width=270, height=360) for k in range(8)
)


def cap() -> Hull:
    """Return hair 12 mm thick on the upper half of the ball."""
    centres = GRID.centres().astype(np.float64)
    distance = np.linalg.norm(centres, axis=-1) - BALL
    hair = (distance > 0) & (distance < 0.012) & (centres[..., 1] > 0)
    return Hull(GRID, hair, hair, distance.astype(np.float32))


def course() -> Float64Array:
    """Return a lock (M, 3) from the hairline in front, out and down over the bare half."""
    down = np.linspace(0.3, -0.9, 60)
    off = BALL + 0.012 + 0.01 * np.sin(np.linspace(0, np.pi, 60))
    return off[:, None] * np.stack([0 * down, np.sin(down), np.cos(down)], axis=1)


def masks(lock: Float64Array | None) -> Sequence[Mask]:
    """Return what the views see of the cap and, where it is given, a lock one pixel wide."""
    cells = GRID.centres_of(cap().dense).astype(np.float64)
    return [_seen(camera, cells, lock) for camera in CAMERAS]


def _seen(camera: Camera, cells: Float64Array, lock: Float64Array | None) -> Mask:
    surface = head_depth(HEAD, camera)
    labels = np.where(np.isfinite(surface), PERSON, BACKGROUND).astype(np.uint8)
    hair = cv2.dilate(_drawn(camera, cells, surface), np.ones((7, 7), np.uint8))
    if lock is not None:
        hair |= _drawn(camera, lock, surface)
    labels[hair > 0] = HAIR
    return Mask(labels, True)


def _drawn(camera: Camera, points: Float64Array, surface: Float32Array) -> UInt8Array:
    """Return (H, W) 1 where points (N, 3) are seen in front of the head."""
    drawn = np.zeros(surface.shape, np.uint8)
    x, y = camera.project(points).astype(np.int64).T
    front = camera.depth(points) < surface[y, x]
    drawn[y[front], x[front]] = 1
    return drawn


def test_a_lock_one_pixel_wide_is_found_whole() -> None:
    """Its cells lie along it from the hairline to its end, and its share is small."""
    lock = course()
    (wisp,) = find_wisps(masks(lock), CAMERAS, HEAD, cap())
    below = lock[lock[:, 1] < -0.03]
    assert cKDTree(wisp.cells[:, :3]).query(below)[0].max() < 0.012
    assert cKDTree(lock).query(wisp.cells[:, :3])[0].max() < 0.012
    ends = wisp.cells[[wisp.cells[:, 3].argmin(), wisp.cells[:, 3].argmax()], 1]
    assert ends[0] > ends[1] + 0.05
    assert 0 < wisp.share < 0.01


def test_hair_without_locks_has_no_wisps() -> None:
    """The edge of the hair is none."""
    assert find_wisps(masks(None), CAMERAS, HEAD, cap()) == ()
