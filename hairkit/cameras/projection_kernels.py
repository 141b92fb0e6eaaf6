"""Compiled projection shared by carving, fusion and depth maps: cameras packed as rows of
numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

from hairkit.arrays import Float32Array, Float64Array, Int32Array
from hairkit.types.camera import Camera
from hairkit.types.head import Head

PERSPECTIVE, ORTHOGRAPHIC = 0.0, 1.0


def pack_cameras(cameras: Sequence[Camera]) -> Float64Array:
    """Return (V, 20): rotation row by row (9), translation (3), focal, centre (2), model, position
    (3), height.

    Model is 0 for perspective and 1 for orthographic. `project_row` reads these rows.
    """
    rows = np.zeros((len(cameras), 20))
    for row, camera in zip(rows, cameras, strict=True):
        row[:9] = camera.rotation.ravel()
        row[9:12] = camera.translation
        row[12] = camera.focal
        row[13:15] = camera.centre
        row[15] = PERSPECTIVE if camera.model == "perspective" else ORTHOGRAPHIC
        row[16:19] = camera.position
        row[19] = camera.height
    return rows


@njit(cache=True, inline="always")
def project_row(row, x, y, z):  # type: ignore[no-untyped-def]
    """Return pixel u, v and axial depth of a head-frame point; depth <= 0 means behind the
    camera."""
    cx = row[0] * x + row[1] * y + row[2] * z + row[9]
    cy = row[3] * x + row[4] * y + row[5] * z + row[10]
    cz = row[6] * x + row[7] * y + row[8] * z + row[11]
    if row[15] > 0.5:
        return row[12] * cx + row[13], row[12] * cy + row[14], cz
    if cz <= 1e-6:
        return -1e9, -1e9, cz
    return row[12] * cx / cz + row[13], row[12] * cy / cz + row[14], cz


def head_depth(head: Head, camera: Camera) -> Float32Array:
    """Return (H, W) the axial depth of the head's first surface at every pixel, infinity where
    none is."""
    return mesh_depth(head.vertices, head.faces, camera)


def mesh_depth(vertices: Float32Array, faces: Int32Array, camera: Camera) -> Float32Array:
    """Return (H, W) the axial depth of the first face (F, 3) at every pixel, infinity where none
    is."""
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    _rasterize(pack_cameras([camera])[0], vertices.astype(np.float64), faces, depth)
    return depth


@njit(cache=True)
def _rasterize(row, vertices, faces, depth):  # type: ignore[no-untyped-def]
    height, width = depth.shape
    n = len(vertices)
    u = np.empty(n)
    v = np.empty(n)
    d = np.empty(n)
    for i in range(n):
        u[i], v[i], d[i] = project_row(row, vertices[i, 0], vertices[i, 1], vertices[i, 2])
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if d[a] <= 0 or d[b] <= 0 or d[c] <= 0:
            continue
        area = (u[b] - u[a]) * (v[c] - v[a]) - (v[b] - v[a]) * (u[c] - u[a])
        if abs(area) < 1e-12:
            continue
        left = max(int(np.floor(min(u[a], u[b], u[c]))), 0)
        right = min(int(np.ceil(max(u[a], u[b], u[c]))), width)
        top = max(int(np.floor(min(v[a], v[b], v[c]))), 0)
        bottom = min(int(np.ceil(max(v[a], v[b], v[c]))), height)
        for y in range(top, bottom):
            for x in range(left, right):
                px, py = x + 0.5, y + 0.5
                wa = ((u[b] - px) * (v[c] - py) - (v[b] - py) * (u[c] - px)) / area
                wb = ((u[c] - px) * (v[a] - py) - (v[c] - py) * (u[a] - px)) / area
                wc = 1.0 - wa - wb
                if wa >= -1e-9 and wb >= -1e-9 and wc >= -1e-9:
                    if row[15] > 0.5:
                        z = wa * d[a] + wb * d[b] + wc * d[c]
                    else:  # in perspective 1 / z is linear in the picture, z is not
                        z = 1.0 / (wa / d[a] + wb / d[b] + wc / d[c])
                    if z < depth[y, x]:
                        depth[y, x] = z


@njit(cache=True)
def splat_depth(row, points, radius, depth):  # type: ignore[no-untyped-def]
    """Lower `depth` (h, w) to the axial depth of points (N, 3) drawn as squares of `radius` metres.

    `depth` may be smaller than the picture: pixels are scaled by `h / picture height`.
    """
    height, width = depth.shape
    scale = height / row[19]
    for i in range(len(points)):
        u, v, z = project_row(row, points[i, 0], points[i, 1], points[i, 2])
        if z <= 0 and row[15] < 0.5:
            continue
        reach = radius * row[12] * scale / (1.0 if row[15] > 0.5 else z)
        left = max(int(np.floor(u * scale - reach)), 0)
        right = min(int(np.floor(u * scale + reach)) + 1, width)
        top = max(int(np.floor(v * scale - reach)), 0)
        bottom = min(int(np.floor(v * scale + reach)) + 1, height)
        for y in range(top, bottom):
            for x in range(left, right):
                depth[y, x] = min(depth[y, x], z)
