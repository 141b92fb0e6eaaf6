"""First visible surfaces: depth pictures of strands and head, drawn without a GPU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit, prange

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.cameras.projection_kernels import head_depth, pack_cameras, project_row
from hairkit.types.camera import Camera
from hairkit.types.head import Head

HAIR_FOOTPRINT_PX = 5
"""Edge of the square a sample covers: samples 1 mm apart close up at 1 to 3 pixels a mm."""

HEAD_TOLERANCE = 0.003
"""Pictures show hair at most this far under the head's surface, metres."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Depth of the first thing each pixel of one view sees."""

    camera: Camera
    depth: Float32Array
    """(H, W) metres along the optical axis, infinite where nothing is seen."""

    def behind(self, points: npt.NDArray[np.float32]) -> Float64Array:
        """Return (N,) how far points (N, 3) lie behind the surface, metres.

        Negative in front of it (minus infinity over background); plus infinity outside the picture.
        """
        result: Float64Array = _behind(_packed(self.camera), self.depth, points)
        return result


def near_some_surface(
    points: npt.NDArray[np.float32], surfaces: Sequence[Surface], depth: float
) -> BoolArray:
    """Return (N,) which points (N, 3) some view sees at most `depth` metres behind its surface."""
    near = np.zeros(len(points), bool)
    for surface in surfaces:
        rest = np.flatnonzero(~near)
        near[rest] = surface.behind(points[rest]) <= depth
    return near


def first_surface(
    camera: Camera,
    points: npt.NDArray[np.float32],
    head: Head | None,
    *,
    footprint: int = HAIR_FOOTPRINT_PX,
) -> Surface:
    """Draw samples of strands (N, 3) and a head into a depth picture.

    Each sample covers a square of `footprint` pixels (odd); the head hides from both sides.
    """
    depth = point_depth(camera, points)
    # Each sample covering a square is the running minimum of each covering one pixel.
    kernel = np.ones((footprint, footprint), np.uint8)
    depth = np.asarray(cv2.erode(depth, kernel, borderValue=np.inf), np.float32)
    if head is not None:
        depth = np.minimum(depth, head_depth(head, camera))
    return Surface(camera, depth)


def point_depth(
    camera: Camera, points: npt.NDArray[np.float32], radius: float = 0.0
) -> Float32Array:
    """Return (H, W) the least depth of discs about points (N, 3), infinite where there is none.

    A disc of `radius` metres covers the pixel that holds its middle and all whose centres it holds.
    """
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    _splat(_packed(camera), np.ascontiguousarray(points, np.float32), radius, depth)
    return depth


def _packed(camera: Camera) -> Float64Array:
    row: Float64Array = pack_cameras([camera])[0]
    return row


@njit(cache=True, parallel=True)
def _behind(
    row: Float64Array, depth: Float32Array, points: npt.NDArray[np.float32]
) -> Float64Array:  # pragma: no cover - compiled
    height, width = depth.shape
    result = np.full(len(points), np.inf)
    for i in prange(len(points)):
        u, v, z = project_row(row, points[i, 0], points[i, 1], points[i, 2])
        if u >= 0 and v >= 0 and u < width and v < height:
            result[i] = z - depth[int(v), int(u)]
    return result


@njit(cache=True)
def _splat(
    row: Float64Array, points: npt.NDArray[np.float32], radius: float, depth: Float32Array
) -> None:  # pragma: no cover - compiled
    height, width = depth.shape
    for i in range(len(points)):
        u, v, z = project_row(row, points[i, 0], points[i, 1], points[i, 2])
        if u >= 0 and v >= 0 and u < width and v < height:
            depth[int(v), int(u)] = min(depth[int(v), int(u)], z)
        reach = radius * row[12] / (1.0 if row[15] > 0.5 else z)
        if not (0.5 <= reach < 1e4 and abs(u) < 1e6 and abs(v) < 1e6):
            continue
        for y in range(max(0, int(v - reach)), min(height, int(v + reach) + 1)):
            for x in range(max(0, int(u - reach)), min(width, int(u + reach) + 1)):
                if (x + 0.5 - u) ** 2 + (y + 0.5 - v) ** 2 <= reach * reach:
                    depth[y, x] = min(depth[y, x], z)


def front_values(
    camera: Camera,
    points: npt.NDArray[np.float32],
    values: npt.NDArray[np.uint8],
    head: Head | None = None,
) -> UInt8Array:
    """Return (H, W) the value (N,) of the front sample within a pixel of each pixel.

    0 where there is none or `head` stands before it, so values should begin at 1.
    """
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    picture = np.zeros(depth.shape, np.uint8)
    if head is not None:
        depth = head_depth(head, camera) + np.float32(HEAD_TOLERANCE)
    _paint(_packed(camera), points, values, depth, picture)
    return picture


@njit(cache=True)
def _paint(
    row: Float64Array,
    points: npt.NDArray[np.float32],
    values: npt.NDArray[np.uint8],
    depth: Float32Array,
    picture: npt.NDArray[np.uint8],
) -> None:  # pragma: no cover - compiled
    height, width = depth.shape
    for i in range(len(points)):
        u, v, z = project_row(row, points[i, 0], points[i, 1], points[i, 2])
        if not (u >= 0 and v >= 0 and u < width and v < height):
            continue
        for y in range(max(0, int(v) - 1), min(height, int(v) + 2)):
            for x in range(max(0, int(u) - 1), min(width, int(u) + 2)):
                if z < depth[y, x]:
                    depth[y, x] = z
                    picture[y, x] = values[i]
