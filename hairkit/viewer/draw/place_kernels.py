"""Interpolation of hair from guides, and opacity by depth: compiled twins of three shaders.

`viewer_guides.comp`, `viewer_place.comp` and `viewer_opacity.comp` do the same on a GPU; tests
compare both. Everything is float32.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from hairkit.parallel import compiled_with

shared: Callable[[Any], Any] = compiled_with(fastmath=True, _nrt=False)
"""Compiles a function that allocates nothing, so that array views are not reference-counted."""
allocating: Callable[[Any], Any] = compiled_with(fastmath=True)
"""The same for a function that makes arrays."""
inlined: Callable[[Any], Any] = njit(fastmath=True, error_model="numpy", inline="always")
"""Inlines a function, so that the compiler can vectorise loops around it."""
SLICES, TILE = 32, 8
"""Depth slices of the view; edge of a view cell in pixels, as in viewer_hair.glsl."""
OPACITY_UNIT = np.float32(4096)
_FAR_BEHIND = np.float32(-1)
_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)
_QUARTER, _TINY, _CLOSE = np.float32(0.25), np.float32(1e-8), np.float32(1e-4)
_MIDDLE, _BESIDE = np.float32(0.4 / 4096), np.float32(0.15 / 4096)
_NEAREST, _PER_TILE, _FAR = np.float32(0.01), np.float32(1 / TILE), np.float32(1e9)


@allocating
def guide_turns(rest, now):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the rotations (G, m, 4), x, y, z, w, of guides (G, m, 3) since rest."""
    count, points = now.shape[:2]
    turns = np.empty((count, points, 4), np.float32)
    for g in range(count):
        for k in range(points):
            before, after = max(k - 1, 0), min(k + 1, points - 1)
            ax, ay, az = _direction(rest, g, before, after)
            bx, by, bz = _direction(now, g, before, after)
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            w = _ONE + ax * bx + ay * by + az * bz
            square = x * x + y * y + z * z + w * w
            if square > _TINY:
                size = _ONE / np.sqrt(square)
                turns[g, k, 0], turns[g, k, 1] = x * size, y * size
                turns[g, k, 2], turns[g, k, 3] = z * size, w * size
            else:
                turns[g, k, 0] = turns[g, k, 1] = turns[g, k, 3] = _ZERO
                turns[g, k, 2] = _ONE
    return turns


@inlined
def _direction(points, g, a, b):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    x = points[g, b, 0] - points[g, a, 0]
    y = points[g, b, 1] - points[g, a, 1]
    z = points[g, b, 2] - points[g, a, 2]
    size = _ONE / np.sqrt(max(x * x + y * y + z * z, np.float32(1e-20)))
    return x * size, y * size, z * size


@inlined
def project_point(camera, x, y, z):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return pixel x, y, depth-buffer depth and axial depth of a point; below 0: behind."""
    w = camera[12] * x + camera[13] * y + camera[14] * z + camera[15]
    over = _ONE / max(w, _CLOSE)
    px = (camera[0] * x + camera[1] * y + camera[2] * z + camera[3]) * over
    py = (camera[4] * x + camera[5] * y + camera[6] * z + camera[7]) * over
    pz = (camera[8] * x + camera[9] * y + camera[10] * z + camera[11]) * over
    depth = camera[16] * x + camera[17] * y + camera[18] * z + camera[19]
    if camera[23] > _HALF and depth < _NEAREST:
        depth = _FAR_BEHIND
    return (
        (px * _HALF + _HALF) * camera[20],
        (py * _HALF + _HALF) * camera[21],
        pz * _HALF + _HALF,
        depth,
    )


@inlined
def pixels_per_metre(camera, depth):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the scale of the picture at an axial depth, pixels per metre."""
    return camera[22] / max(depth, _CLOSE) if camera[23] > _HALF else camera[22]


@inlined
def count_hidden(ax, ay, az, bx, by, bz, solid):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return how many of a stroke's ends and its middle are behind meshes, 0 to 3.

    Ends a and b in pixels of the frame and depth; `solid` (W, H) is the depth buffer of meshes.
    """
    hidden = _behind(ax, ay, az, solid) + _behind(bx, by, bz, solid)
    return hidden + _behind(_HALF * (ax + bx), _HALF * (ay + by), _HALF * (az + bz), solid)


@inlined
def _behind(x, y, depth, solid):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return 1 if a mesh, `solid` (W, H), is nearer than a point in pixels of the frame; else 0."""
    column = min(max(np.int64(x), 0), solid.shape[0] - 1)
    row = min(max(np.int64(y), 0), solid.shape[1] - 1)
    return 1 if depth > solid[column, row] else 0


@shared
def place_hair(  # type: ignore[no-untyped-def]
    first_chunk, last_chunk, guides, turns, followed, weights, offsets, widths, camera, slices,
    wider, count, places, seen, filled, used, frame,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Interpolate chunks of `count` strands, and splat their segments into the view cells.

    Each point keeps its offset from the mean of three guides, rotated with the nearest one.
    Writes `places` (S, m, 3) in metres and `seen` (S, m, 4), the results of `project_point`. Each
    chunk also writes its part of `filled` (chunks, SLICES, tiles y, tiles x) and of `frame`
    (chunks, 4), the lowest and highest pixel. `used` are the tiles that the last picture left
    filled: first column and row, and the ends of both.
    """
    chunks = filled.shape[0]
    for chunk in range(first_chunk, last_chunk):
        filled[chunk, :, used[1] : used[3], used[0] : used[2]] = 0
        frame[chunk, :2], frame[chunk, 2:] = _FAR, -_FAR
        _place_chunk(
            guides, turns, followed, weights, offsets, widths, camera, slices, wider,
            count * chunk // chunks, count * (chunk + 1) // chunks, places, seen, filled[chunk],
            frame[chunk],
        )  # fmt: skip


@shared
def _place_chunk(  # type: ignore[no-untyped-def]
    guides, turns, followed, weights, offsets, widths, camera, slices, wider, first, last, places,
    seen, filled, frame,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    low_x, low_y, high_x, high_y = frame[0], frame[1], frame[2], frame[3]
    for s in range(first, last):
        for k in range(offsets.shape[1]):
            x, y, z = _place(guides, turns, followed, weights, offsets, s, k)
            places[s, k, 0], places[s, k, 1], places[s, k, 2] = x, y, z
            px, py, pz, depth = project_point(camera, x, y, z)
            seen[s, k, 0], seen[s, k, 1], seen[s, k, 2], seen[s, k, 3] = px, py, pz, depth
            if depth > _ZERO:
                low_x, low_y = min(low_x, px), min(low_y, py)
                high_x, high_y = max(high_x, px), max(high_y, py)
        for k in range(1, offsets.shape[1]):
            depth = seen[s, k, 3]
            if depth > _ZERO and seen[s, k - 1, 3] > _ZERO:
                width = widths[s, k] * wider * pixels_per_metre(camera, depth)
                _fill(filled, seen, s, k, slices, width)
    frame[0], frame[1], frame[2], frame[3] = low_x, low_y, high_x, high_y


@inlined
def _place(  # type: ignore[no-untyped-def]
    guides, turns, followed, weights, offsets, s, k
):  # pragma: no cover - compiled
    a, b, c = followed[s, 0], followed[s, 1], followed[s, 2]
    u, v, w = weights[s, 0], weights[s, 1], weights[s, 2]
    ox, oy, oz = offsets[s, k, 0], offsets[s, k, 1], offsets[s, k, 2]
    qx, qy, qz, qw = turns[a, k, 0], turns[a, k, 1], turns[a, k, 2], turns[a, k, 3]
    ix, iy, iz = (
        qy * oz - qz * oy + qw * ox,
        qz * ox - qx * oz + qw * oy,
        qx * oy - qy * ox + qw * oz,
    )
    x = u * guides[a, k, 0] + v * guides[b, k, 0] + w * guides[c, k, 0]
    y = u * guides[a, k, 1] + v * guides[b, k, 1] + w * guides[c, k, 1]
    z = u * guides[a, k, 2] + v * guides[b, k, 2] + w * guides[c, k, 2]
    return (
        x + ox + _TWO * (qy * iz - qz * iy),
        y + oy + _TWO * (qz * ix - qx * iz),
        z + oz + _TWO * (qx * iy - qy * ix),
    )


@shared
def _fill(filled, seen, s, k, slices, width) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Splat the segment from point k - 1 to k into the cells at its quarters."""
    ax, ay = seen[s, k - 1, 0], seen[s, k - 1, 1]
    x, y = seen[s, k, 0] - ax, seen[s, k, 1] - ay
    opacity = _HALF * np.sqrt(x * x + y * y) * width / np.float32(TILE * TILE)
    whole = np.uint32(opacity * OPACITY_UNIT + _HALF)
    near = seen[s, k - 1, 3]
    depth = seen[s, k, 3] - near
    for part in (_QUARTER, _ONE - _QUARTER):
        column, line = (ax + part * x) * _PER_TILE, (ay + part * y) * _PER_TILE
        if column < _ZERO or line < _ZERO:
            continue
        i, j = np.int64(column), np.int64(line)
        if i >= filled.shape[2] or j >= filled.shape[1]:
            continue
        layer = np.int64((near + part * depth - slices[0]) * slices[1])
        filled[min(max(layer, 0), SLICES - 1), j, i] += whole


@shared
def accumulate_opacity(first, last, filled, used, opacity) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write rows of the optical depth (SLICES + 1, tiles y, tiles x) of hair before each slice.

    A coarse form of deep opacity maps (Yuksel and Keyser 2008) along the line of sight; each tile
    is smoothed with its neighbours. `filled` is the result of `place_hair`. Only tiles `used` are
    written, in rows `first` to `last` of them.
    """
    chunks, slices, rows, columns = filled.shape
    left, top, right = used[0], used[1], used[2]
    for j in range(top + first, top + last):
        up, down = max(j - 1, 0), min(j + 1, rows - 1)
        for i in range(left, right):
            opacity[0, j, i] = _ZERO
        for layer in range(slices):
            before, after = opacity[layer, j], opacity[layer + 1, j]
            for i in range(left, right):
                after[i] = before[i]
            for chunk in range(chunks):
                here = filled[chunk, layer, j]
                above, below = filled[chunk, layer, up], filled[chunk, layer, down]
                for i in range(left, right):
                    beside = here[max(i - 1, 0)] + here[min(i + 1, columns - 1)]
                    beside += above[i] + below[i]
                    after[i] += _MIDDLE * np.float32(here[i]) + _BESIDE * np.float32(beside)
