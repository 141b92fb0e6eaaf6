"""Draw lit meshes into a picture and its depth: the compiled twin of skin.frag.

A depth buffer is stored column by column, as the kernels of the hair read it; pictures are stored
row by row. Strips of columns are drawn apart, each on one thread. All float32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Int32Array, Int64Array, UInt8Array
from hairkit.simulation.lanes import stage
from hairkit.simulation.vectors import HALF, ONE, TWO, ZERO, Number, Vector, inlined
from hairkit.viewer.draw.mesh_kernels import MeshData, MeshState, pixel_middles
from hairkit.viewer.draw.shade_kernels import TONES

STRIP = 32
"""Columns of a strip: 128 bytes of each row, two lines of a cache."""
_LAST, _BYTE, _QUARTER = np.float32(TONES - 1), np.float32(255), np.float32(0.25)
LINEAR = tuple(np.float32(c) for c in (0.305306011, 0.682171111, 0.012522878))
"""Cubic from sRGB to linear (Chilliant 2012, "sRGB approximations for HLSL")."""
_EDGE = np.float32(1e-4)
"""How far a pixel may lie beside a face, of the face's height: roundings leave no gaps."""


class Albedo(NamedTuple):
    """A picture, its mipmaps, and how they are shown."""

    pixels: UInt8Array
    """(N, 3) sRGB, the levels one after the other, lowest row first."""
    levels: Int32Array
    """(L, 3) first pixel, width and height of each level; none: white."""
    tones: UInt8Array
    """(TONES,) tones of radiance, see `tone_table`."""


@stage
def restore(
    first: int,
    last: int,
    region: Int64Array,
    picture: UInt8Array,
    depth: Float32Array,
    to_picture: UInt8Array,
    to_depth: Float32Array,
) -> None:
    """Copy columns of a region, the values of `region.Region`, of a picture and its depth."""
    for y in range(region[1], region[3]):
        for x in range(region[0] + first, region[0] + last):
            for c in range(4):
                to_picture[y, x, c] = picture[y, x, c]
    for x in range(region[0] + first, region[0] + last):
        for y in range(region[1], region[3]):
            to_depth[x, y] = depth[x, y]


@stage
def draw_faces(
    first_strip: int,
    last_strip: int,
    mesh: MeshData,
    state: MeshState,
    albedo: Albedo,
    depth: Float32Array,
    picture: UInt8Array,
) -> None:
    """Draw the seen faces in strips of columns into a picture (H, W, 4) and its depth (W, H)."""
    chunks, count = len(state.counts), len(mesh.faces)
    for strip in range(first_strip, last_strip):
        left, right = strip * STRIP, min((strip + 1) * STRIP, depth.shape[0]) - 1
        for chunk in range(chunks):
            if state.covered[chunk, 0] > right or state.covered[chunk, 2] <= left:
                continue
            start = count * chunk // chunks
            for at in range(start, start + state.counts[chunk]):
                if state.columns[at, 0] <= right and state.columns[at, 1] >= left:
                    begin = max(int(state.columns[at, 0]), left)
                    end = min(int(state.columns[at, 1]), right)
                    _draw_face(mesh, state, state.front[at], albedo, begin, end, depth, picture)


@stage
def _draw_face(
    mesh: MeshData,
    state: MeshState,
    face: int,
    albedo: Albedo,
    begin: int,
    end: int,
    depth: Float32Array,
    picture: UInt8Array,
) -> None:
    """Draw a face in the columns from `begin` to `end`."""
    seen, flesh, oil, uv = state.seen, state.flesh, state.oil, mesh.uv
    a, b, c = mesh.faces[face, 0], mesh.faces[face, 1], mesh.faces[face, 2]
    ax, ay, az = seen[a, 0], seen[a, 1], seen[a, 2]
    bx, by, cx, cy = seen[b, 0] - ax, seen[b, 1] - ay, seen[c, 0] - ax, seen[c, 1] - ay
    bz, cz = seen[b, 2] - az, seen[c, 2] - az
    over = ONE / (bx * cy - cx * by)
    top, bottom = pixel_middles(ay, by + ay, cy + ay, depth.shape[1])
    level = _mip_level(albedo, uv, (a, b, c), (bx, by, cx, cy), over)
    for column in range(begin, end + 1):
        x = np.float32(column) + HALF - ax
        for row in range(top, bottom + 1):
            y = np.float32(row) + HALF - ay
            v, w = (x * cy - cx * y) * over, (bx * y - x * by) * over  # barycentric coordinates
            u = ONE - v - w
            if min(u, v, w) < -_EDGE:
                continue
            z = az + v * bz + w * cz
            if z < ZERO or z >= depth[column, row]:
                continue
            depth[column, row] = z
            red = green = blue = ONE
            if level >= 0:
                across = u * uv[a, 0] + v * uv[b, 0] + w * uv[c, 0]
                up = u * uv[a, 1] + v * uv[b, 1] + w * uv[c, 1]
                red, green, blue = _texel(albedo, level, across, up)
            red = red * (u * flesh[a, 0] + v * flesh[b, 0] + w * flesh[c, 0])
            green = green * (u * flesh[a, 1] + v * flesh[b, 1] + w * flesh[c, 1])
            blue = blue * (u * flesh[a, 2] + v * flesh[b, 2] + w * flesh[c, 2])
            red += u * oil[a, 0] + v * oil[b, 0] + w * oil[c, 0]
            green += u * oil[a, 1] + v * oil[b, 1] + w * oil[c, 1]
            blue += u * oil[a, 2] + v * oil[b, 2] + w * oil[c, 2]
            picture[row, column, 0] = _tone(albedo.tones, red)
            picture[row, column, 1] = _tone(albedo.tones, green)
            picture[row, column, 2] = _tone(albedo.tones, blue)


@inlined
def _tone(tones: UInt8Array, x: Number) -> np.uint8:
    tone: np.uint8 = tones[min(int(_LAST * np.sqrt(max(x, ZERO)) + HALF), TONES - 1)]
    return tone


@inlined
def _mip_level(
    albedo: Albedo,
    uv: Float32Array,
    corners: tuple[int, int, int],
    sides: tuple[Number, Number, Number, Number],
    over: Number,
) -> int:
    """Return the level of which a pixel of the face holds about one texel; -1 without a picture.

    `sides` are x and y of the sides from the first corner, pixels, and `over` 1 / their product.
    """
    if len(albedo.levels) == 0:
        return -1
    (a, b, c), (bx, by, cx, cy) = corners, sides
    wide, high = np.float32(albedo.levels[0, 1]), np.float32(albedo.levels[0, 2])
    du, dv = (uv[b, 0] - uv[a, 0]) * wide, (uv[b, 1] - uv[a, 1]) * high
    eu, ev = (uv[c, 0] - uv[a, 0]) * wide, (uv[c, 1] - uv[a, 1]) * high
    ux, vx = (du * cy - eu * by) * over, (dv * cy - ev * by) * over
    uy, vy = (eu * bx - du * cx) * over, (ev * bx - dv * cx) * over
    square = max(ux * ux + vx * vx, uy * uy + vy * vy)
    level, most = 0, len(albedo.levels) - 1
    while square > TWO and level < most:  # the next level holds a quarter of the texels
        square *= _QUARTER
        level += 1
    return level


@inlined
def _texel(albedo: Albedo, level: int, across: Number, up: Number) -> Vector:
    """Return the linear colour of a level between its four nearest texels."""
    start, wide, high = albedo.levels[level, 0], albedo.levels[level, 1], albedo.levels[level, 2]
    x = min(max(across * np.float32(wide) - HALF, ZERO), np.float32(wide - 1))
    y = min(max(up * np.float32(high) - HALF, ZERO), np.float32(high - 1))
    i, j = int(x), int(y)
    s, t = x - np.float32(i), y - np.float32(j)
    low, beside = start + j * wide + i, min(i + 1, wide - 1) - i
    over = low + (min(j + 1, high - 1) - j) * wide
    p, q = (ONE - s) * (ONE - t) / _BYTE, s * (ONE - t) / _BYTE
    m, n = (ONE - s) * t / _BYTE, s * t / _BYTE
    red, green, blue = ZERO, ZERO, ZERO
    for share, at in ((p, low), (q, low + beside), (m, over), (n, over + beside)):
        red += share * np.float32(albedo.pixels[at, 0])
        green += share * np.float32(albedo.pixels[at, 1])
        blue += share * np.float32(albedo.pixels[at, 2])
    return _linear(red), _linear(green), _linear(blue)


@inlined
def _linear(x: Number) -> Number:
    """Return sRGB as linear light, off by less than a 256th."""
    a, b, c = LINEAR
    return x * (x * (x * a + b) + c)
