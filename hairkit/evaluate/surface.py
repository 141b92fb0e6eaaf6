"""First visible surfaces: depth pictures of strands and head, drawn without a GPU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from hairkit.camera import Camera
from hairkit.stored import BoolArray, Float32Array, Float64Array


@dataclass(frozen=True, eq=False)
class Surface:
    """Depth of the first thing each pixel of one view sees."""

    camera: Camera
    depth: Float32Array
    """(H, W) metres along the optical axis, infinite where nothing is seen."""

    def behind(self, points: npt.ArrayLike) -> Float64Array:
        """Return (N,) how far points (N, 3) lie behind the surface, metres.

        Negative in front of it (minus infinity over background); plus infinity outside the picture.
        """
        row, column, inside = pixel_indices(self.camera, points)
        result = np.full(len(inside), np.inf)
        depth = self.camera.depth(points)[inside]
        result[inside] = depth - self.depth[row[inside], column[inside]]
        return result


def near_some_surface(
    points: npt.ArrayLike, surfaces: Sequence[Surface], depth: float
) -> BoolArray:
    """Return (N,) which points (N, 3) some view sees at most `depth` metres behind its surface."""
    near = np.zeros(len(np.asarray(points)), bool)
    for surface in surfaces:
        rest = np.flatnonzero(~near)
        near[rest] = surface.behind(np.asarray(points)[rest]) <= depth
    return near


def first_surface(
    camera: Camera,
    strand_points: npt.ArrayLike,
    mesh: tuple[npt.NDArray[np.float32], npt.NDArray[np.int32]] | None,
    *,
    footprint: int = 5,
) -> Surface:
    """Draw points along strands and a mesh into a depth picture.

    Parameters
    ----------
    strand_points : (N, 3) array
        Close enough (1 mm) that footprints join up to a closed surface.
    mesh : (vertices, faces), optional
        Triangles that hide what is behind them, both sides.
    footprint : int
        Odd edge in pixels of the square that a point covers.
    """
    depth = splat_depth(camera, strand_points)
    if footprint > 1:
        # Every point covering a square is the running minimum of every point covering one pixel.
        kernel = np.ones((footprint, footprint), np.uint8)
        depth = np.asarray(cv2.erode(depth, kernel, borderValue=np.inf), np.float32)
    if mesh is not None:
        depth = np.minimum(depth, mesh_depth(camera, *mesh))
    return Surface(camera, depth)


def splat_depth(camera: Camera, points: npt.ArrayLike) -> Float32Array:
    """Return (H, W) the least depth of the points (N, 3) on each pixel, infinite elsewhere."""
    row, column, inside = pixel_indices(camera, points)
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    _scatter_minimum(depth, row[inside], column[inside], camera.depth(points)[inside])
    return depth


def mesh_depth(
    camera: Camera, vertices: npt.NDArray[np.float32], faces: npt.NDArray[np.int32]
) -> Float32Array:
    """Return (H, W) depth of triangles (F, 3) at pixel centres, infinite where there is none."""
    pixels, z = camera.project(vertices), camera.depth(vertices)
    # Perspective depth is linear in the picture only as 1 / z.
    value = 1 / z if camera.model == "perspective" else z
    finite = np.isfinite(pixels[:, 0]) & np.isfinite(pixels[:, 1])
    usable = faces[finite[faces].all(axis=1)]
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    _fill_triangles(depth, pixels, value, usable.astype(np.int64), camera.model == "perspective")
    return depth


def pixel_indices(
    camera: Camera, points: npt.ArrayLike
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], BoolArray]:
    """Return row, column (N,) of the pixel of each point (N, 3) and whether it is in the picture."""
    xy = camera.project(points)
    inside = (
        np.isfinite(xy).all(axis=-1)
        & (xy[..., 0] >= 0)
        & (xy[..., 1] >= 0)
        & (xy[..., 0] < camera.width)
        & (xy[..., 1] < camera.height)
    )
    index = np.where(inside[..., None], xy, 0).astype(np.int64)
    return index[..., 1], index[..., 0], inside


@njit(cache=True)
def _scatter_minimum(
    depth: Float32Array,
    row: npt.NDArray[np.int64],
    column: npt.NDArray[np.int64],
    value: Float64Array,
) -> None:  # pragma: no cover - compiled
    for i in range(len(value)):
        if value[i] < depth[row[i], column[i]]:
            depth[row[i], column[i]] = value[i]


@njit(cache=True)
def _fill_triangles(
    depth: Float32Array,
    pixels: Float64Array,
    value: Float64Array,
    faces: npt.NDArray[np.int64],
    inverse: bool,
) -> None:  # pragma: no cover - compiled
    height, width = depth.shape
    for f in range(len(faces)):
        a, b, c = faces[f]
        ax, ay = pixels[a]
        bx, by = pixels[b]
        cx, cy = pixels[c]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        left = max(0, int(np.floor(min(ax, bx, cx) - 0.5)))
        right = min(width - 1, int(np.ceil(max(ax, bx, cx))))
        top = max(0, int(np.floor(min(ay, by, cy) - 0.5)))
        bottom = min(height - 1, int(np.ceil(max(ay, by, cy))))
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                x, y = column + 0.5, row + 0.5
                wb = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                wc = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                wa = 1 - wb - wc
                if wa < 0 or wb < 0 or wc < 0:
                    continue
                z = wa * value[a] + wb * value[b] + wc * value[c]
                if inverse:
                    z = 1 / z
                if z < depth[row, column]:
                    depth[row, column] = z
