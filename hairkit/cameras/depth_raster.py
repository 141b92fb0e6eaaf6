"""Depth maps of meshes and points, drawn without a GPU.

Depth is axial, in metres; a pixel that nothing covers has infinite depth.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int32Array, UInt8Array, for_kernel
from hairkit.cameras.projection_kernels import (
    PackedCamera,
    Vector,
    pack_camera,
    perspective_divisor,
    project,
)
from hairkit.parallel import compiled, compiled_with, parallel_for
from hairkit.types.camera import Camera
from hairkit.types.head import Head

LEAST_AREA = 1e-12
"""Triangles of less than half this area, square pixels, are seen edge-on and not drawn."""
EDGE_SLACK = 1e-9
"""Barycentric coordinates this far below 0 count as inside: no pixel falls between faces."""
LARGEST_RADIUS = 1e4
"""Discs of more pixels than this are about points at the camera's centre and are not drawn."""
FARTHEST_PIXEL = 1e6
"""Discs farther than this from the picture's corner, pixels, are not drawn."""
HEAD_TOLERANCE = 0.003
"""Metres under the head's surface at which hair is still drawn: roots lie on or in the skin."""
SPLAT_CELLS = 0.75
"""Half edge, in cells, of squares that leave no gap between the neighbouring cells of a surface."""
MIN_POINTS = 4096
"""Least number of points that are worth another thread."""


Pixel = tuple[float, float]
"""u and v."""


def head_depth(head: Head, camera: Camera) -> Float32Array:
    """Return (H, W) the depth of the head's first surface at every pixel's centre."""
    return mesh_depth(head.vertices, head.faces, camera)


def mesh_depth(vertices: Float32Array, faces: Int32Array, camera: Camera) -> Float32Array:
    """Return (H, W) the depth of the first of the faces (F, 3) at every pixel's centre."""
    orthographic = camera.model == "orthographic"
    nearness = np.full((camera.height, camera.width), -np.inf if orthographic else 0, np.float32)
    corners = np.empty((len(vertices), 3))
    _project_vertices(pack_camera(camera), vertices.astype(np.float64), corners)
    _draw_faces(corners, for_kernel(faces), orthographic, nearness)
    if orthographic:
        return -nearness
    with np.errstate(divide="ignore"):
        return np.reciprocal(nearness, out=nearness)


def point_depth(
    camera: Camera, points: npt.NDArray[np.float32], radius: float = 0.0
) -> Float32Array:
    """Return (H, W) the least depth of discs about points (N, 3).

    A disc of `radius` metres covers the pixel that holds its middle and all whose centres it holds.
    """
    depth = _empty_depth(camera)
    _draw_discs(pack_camera(camera), for_kernel(np.asarray(points, np.float32)), radius, depth)
    return depth


def depth_behind(
    camera: Camera, depth: Float32Array, points: npt.NDArray[np.float32]
) -> Float64Array:
    """Return (N,) how far points (N, 3) lie behind a depth map (H, W), metres.

    Minus infinity where the map is empty; plus infinity outside the picture.
    """
    behind = np.full(len(points), np.inf)
    parallel_for(
        _compare_depth, len(points), pack_camera(camera), depth, for_kernel(points), behind,
        min_chunk=MIN_POINTS,
    )  # fmt: skip
    return behind


def front_values(
    camera: Camera,
    points: npt.NDArray[np.float32],
    values: npt.NDArray[np.uint8],
    head: Head | None = None,
) -> UInt8Array:
    """Return (H, W) the value (N,) of the front point within a pixel of each pixel.

    0 where there is none or `head` hides it, so values should begin at 1.
    """
    depth = _empty_depth(camera)
    picture = np.zeros(depth.shape, np.uint8)
    if head is not None:
        depth = head_depth(head, camera) + np.float32(HEAD_TOLERANCE)
    _draw_values(pack_camera(camera), for_kernel(points), for_kernel(values), depth, picture)
    return picture


def _empty_depth(camera: Camera) -> Float32Array:
    return np.full((camera.height, camera.width), np.inf, np.float32)


@compiled
def splat_depth(
    camera: PackedCamera, points: Float32Array, radius: float, depth: Float32Array
) -> None:
    """Lower `depth` (h, w) to the depth of points (N, 3) drawn as squares of half edge `radius`.

    `radius` is in metres. `depth` may be smaller than the picture: pixels are scaled by
    `h / camera.height`.
    """
    height, width = depth.shape
    scale = height / camera.height
    for i in range(len(points)):
        u, v, z = project(camera, points[i, 0], points[i, 1], points[i, 2])
        if z <= 0 and not camera.orthographic:
            continue
        reach = radius * camera.focal * scale / perspective_divisor(camera, z)
        left = max(int(np.floor(u * scale - reach)), 0)
        right = min(int(np.floor(u * scale + reach)) + 1, width)
        top = max(int(np.floor(v * scale - reach)), 0)
        bottom = min(int(np.floor(v * scale + reach)) + 1, height)
        for y in range(top, bottom):
            for x in range(left, right):
                depth[y, x] = min(depth[y, x], z)


@compiled
def _project_vertices(camera: PackedCamera, vertices: Float64Array, corners: Float64Array) -> None:
    """Write u, v (pixels) and depth of vertices (N, 3) into corners (N, 3)."""
    for i in range(len(vertices)):
        u, v, z = project(camera, vertices[i, 0], vertices[i, 1], vertices[i, 2])
        corners[i, 0], corners[i, 1], corners[i, 2] = u, v, z


@compiled
def _draw_faces(
    corners: Float64Array, faces: Int32Array, orthographic: bool, nearness: Float32Array
) -> None:
    """Raise `nearness` (H, W) to all faces that lie wholly before the camera.

    It is what is linear in the picture: 1 / depth, and -depth of an orthographic camera.
    """
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        za, zb, zc = corners[i, 2], corners[j, 2], corners[k, 2]
        if za > 0 and zb > 0 and zc > 0:
            near = (-za, -zb, -zc) if orthographic else (1 / za, 1 / zb, 1 / zc)
            a = corners[i, 0], corners[i, 1]
            b = corners[j, 0], corners[j, 1]
            c = corners[k, 0], corners[k, 1]
            _draw_triangle(a, b, c, near, nearness)


@compiled_with(inside=True)
def _draw_triangle(a: Pixel, b: Pixel, c: Pixel, near: Vector, nearness: Float32Array) -> None:
    """Raise `nearness` (H, W) to a triangle of corners u, v, row by row.

    The barycentric coordinates are linear along a row: where all are positive is a span of it.
    """
    height, width = nearness.shape
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if abs(area) < LEAST_AREA:
        return
    left = max(int(np.ceil(min(a[0], b[0], c[0]) - 0.5)), 0)
    right = min(int(np.floor(max(a[0], b[0], c[0]) - 0.5)), width - 1)
    top = max(int(np.ceil(min(a[1], b[1], c[1]) - 0.5)), 0)
    bottom = min(int(np.floor(max(a[1], b[1], c[1]) - 0.5)), height - 1)
    share = 1 / area
    step_a, step_b = (b[1] - c[1]) * share, (c[1] - a[1]) * share
    step_c = -step_a - step_b
    per_a, per_b, per_c = 1 / step_a, 1 / step_b, 1 / step_c
    step = step_a * near[0] + step_b * near[1] + step_c * near[2]
    px = left + 0.5
    for y in range(top, bottom + 1):
        py = y + 0.5
        wa = ((b[0] - px) * (c[1] - py) - (b[1] - py) * (c[0] - px)) * share
        wb = ((c[0] - px) * (a[1] - py) - (c[1] - py) * (a[0] - px)) * share
        wc = 1.0 - wa - wb
        first, last = _cut_span(0.0, float(right - left), wa, per_a)
        first, last = _cut_span(first, last, wb, per_b)
        first, last = _cut_span(first, last, wc, per_c)
        if first <= last:
            start = wa * near[0] + wb * near[1] + wc * near[2]
            for k in range(int(np.ceil(first)), int(last) + 1):
                value = np.float32(start + k * step)
                nearness[y, left + k] = max(nearness[y, left + k], value)


@compiled_with(inside=True)
def _cut_span(first: float, last: float, weight: float, per: float) -> tuple[float, float]:
    """Return the part of a span, `first` to `last`, where `weight + k / per` is not negative."""
    end = -(weight + EDGE_SLACK) * per
    return (max(first, end), last) if per > 0 else (first, min(last, end))


@compiled
def _draw_discs(
    camera: PackedCamera, points: Float32Array, radius: float, depth: Float32Array
) -> None:
    """Lower `depth` (H, W) to the discs of `point_depth`."""
    height, width = depth.shape
    for i in range(len(points)):
        u, v, z = project(camera, points[i, 0], points[i, 1], points[i, 2])
        if u >= 0 and v >= 0 and u < width and v < height:
            depth[int(v), int(u)] = min(depth[int(v), int(u)], z)
        reach = radius * camera.focal / perspective_divisor(camera, z)
        far = abs(u) >= FARTHEST_PIXEL or abs(v) >= FARTHEST_PIXEL
        if far or not 0.5 <= reach < LARGEST_RADIUS:
            continue
        for y in range(max(0, int(v - reach)), min(height, int(v + reach) + 1)):
            for x in range(max(0, int(u - reach)), min(width, int(u + reach) + 1)):
                if (x + 0.5 - u) ** 2 + (y + 0.5 - v) ** 2 <= reach * reach:
                    depth[y, x] = min(depth[y, x], z)


@compiled
def _compare_depth(
    first: int,
    last: int,
    camera: PackedCamera,
    depth: Float32Array,
    points: Float32Array,
    behind: Float64Array,
) -> None:
    """Write how far points `first` to `last` lie behind the depth map, where it sees them."""
    height, width = depth.shape
    for i in range(first, last):
        u, v, z = project(camera, points[i, 0], points[i, 1], points[i, 2])
        if u >= 0 and v >= 0 and u < width and v < height:
            behind[i] = z - depth[int(v), int(u)]


@compiled
def _draw_values(
    camera: PackedCamera,
    points: Float32Array,
    values: UInt8Array,
    depth: Float32Array,
    picture: UInt8Array,
) -> None:
    """Write values into the 3 x 3 pixels about each point that is the first there."""
    height, width = depth.shape
    for i in range(len(points)):
        u, v, z = project(camera, points[i, 0], points[i, 1], points[i, 2])
        if not (u >= 0 and v >= 0 and u < width and v < height):
            continue
        for y in range(max(0, int(v) - 1), min(height, int(v) + 2)):
            for x in range(max(0, int(u) - 1), min(width, int(u) + 2)):
                if z < depth[y, x]:
                    depth[y, x] = z
                    picture[y, x] = values[i]
