"""First visible surfaces of strands and head."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.cameras.depth_raster import depth_behind, head_depth, point_depth
from hairkit.types.camera import Camera
from hairkit.types.head import Head

HAIR_FOOTPRINT_PX = 5
"""Edge of the square a sample covers: samples 1 mm apart close up at 1 to 3 pixels a mm."""


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
        return depth_behind(self.camera, self.depth, points)


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
    """Draw samples of strands (N, 3) and a head into a depth map.

    Each sample covers a square of `footprint` pixels (odd); both sides of the head's faces hide.
    """
    depth = point_depth(camera, points)
    # Each sample covering a square is the running minimum of each covering one pixel.
    kernel = np.ones((footprint, footprint), np.uint8)
    depth = np.asarray(cv2.erode(depth, kernel, borderValue=np.inf), np.float32)
    if head is not None:
        depth = np.minimum(depth, head_depth(head, camera))
    return Surface(camera, depth)
