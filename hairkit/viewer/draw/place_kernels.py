"""Interpolation of hair from guides, and opacity by depth: compiled twins of three shaders.

`viewer_guides.comp`, `viewer_place.comp` and `viewer_opacity.comp` do the same on a GPU; tests
compare both. Everything is float32.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from hairkit.arrays import Float32Array
from hairkit.parallel import compiled_with

shared: Callable[[Any], Any] = compiled_with(fastmath=True)
"""Compiles a function that threads share."""
inlined: Callable[[Any], Any] = njit(fastmath=True, error_model="numpy", inline="always")
"""Inlines a function, so that the compiler can vectorise loops around it."""
SLICES, TILE = 32, 8
"""Depth slices of the view; edge of a view cell in pixels, as in viewer_hair.glsl."""
OPACITY_UNIT = np.float32(4096)
PARTED, TOGETHER = np.cos(np.radians(45.0)), np.cos(np.radians(22.5))
"""Cosines of half the angle between the turns of two guides: from 90 degrees on they share no hair,
up to 45 degrees they share it as at rest."""
LANES = 8
"""Points of a strand that are worked on together."""
MOST_STRETCH = 4.0
"""Largest stretch of a segment that is drawn: places stay finite where a simulation diverges."""
SHORTEST = 1e-9
"""Least length of a segment, metres."""
_PARTED, _TOGETHER = np.float32(PARTED), np.float32(TOGETHER)
_MOST_STRETCH = np.float32(MOST_STRETCH)
_FAR_BEHIND = np.float32(-1)
_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)
_QUARTER, _TINY, _CLOSE = np.float32(0.25), np.float32(1e-8), np.float32(1e-4)
_MIDDLE, _BESIDE = np.float32(0.4 / 4096), np.float32(0.15 / 4096)
_NEAREST, _PER_TILE, _FAR = np.float32(0.01), np.float32(1 / TILE), np.float32(1e9)


def in_lanes(values: Float32Array, fill: Float32Array) -> Float32Array:
    """Return (N, C, M) of values (N, m, C): by component, with `fill` (C,) up to a multiple of
    `LANES` points."""
    count, points, components = values.shape
    padded = np.empty((count, components, -(-points // LANES) * LANES), np.float32)
    padded[:] = fill[:, None]
    padded[:, :, :points] = values.transpose(0, 2, 1)
    return padded


class RestGuides(NamedTuple):
    """The guides at rest."""

    segments: Float32Array
    """(G, m, 4) unit direction and length, metres, of the segment to each point; 0 to the root."""
    frames: Float32Array
    """(G, 4, m) rotation, x, y, z, w, of a frame carried from the first segment to each one."""


def segments(rows: Float32Array) -> Float32Array:
    """Return (G, m, 4) unit direction and length of the segments to the points of guides."""
    edges = np.diff(rows, axis=1, prepend=rows[:, :1])
    lengths = np.maximum(np.linalg.norm(edges, axis=2, keepdims=True), SHORTEST)
    return np.concatenate([edges / lengths, lengths], axis=2, dtype=np.float32)


@shared
def carry_frames(
    first: int, last: int, rest: Float32Array, now: Float32Array, frames: Float32Array
) -> None:  # pragma: no cover - compiled
    """Write how a frame turns from the first segment of guides at rest to each segment of `now`.

    It is carried along without twist (Bishop 1975, "There is more than one way to frame a curve"),
    so that it changes no faster than the guide bends. `rest` are `segments`.
    """
    for g in range(first, last):
        ax, ay, az = rest[g, 1, 0], rest[g, 1, 1], rest[g, 1, 2]
        x, y, z, w = _ZERO, _ZERO, _ZERO, _ONE
        for k in range(1, now.shape[1]):
            bx, by, bz, _ = _segment(now, g, k)
            tx, ty, tz, tw = _between(ax, ay, az, bx, by, bz)
            x, y, z, w = _multiply(tx, ty, tz, tw, x, y, z, w)
            over = _ONE / np.sqrt(x * x + y * y + z * z + w * w)
            x, y, z, w = x * over, y * over, z * over, w * over
            frames[g, 0, k], frames[g, 1, k], frames[g, 2, k], frames[g, 3, k] = x, y, z, w
            ax, ay, az = bx, by, bz


@shared
def turn_guides(
    first: int,
    last: int,
    rest: Float32Array,
    rest_frames: Float32Array,
    now: Float32Array,
    turns: Float32Array,
) -> None:  # pragma: no cover - compiled
    """Write rotation and stretch (G, 5, M) of the segments to the points of guides since rest.

    `rest` and `rest_frames` are those of `RestGuides`, `now` (G, m, 3) are the guides' points.
    """
    carry_frames(first, last, rest, now, turns)
    for g in range(first, last):
        for k in range(1, now.shape[1]):
            x, y, z, w = turns[g, 0, k], turns[g, 1, k], turns[g, 2, k], turns[g, 3, k]
            a, b, c = rest_frames[g, 0, k], rest_frames[g, 1, k], rest_frames[g, 2, k]
            x, y, z, w = _multiply(x, y, z, w, -a, -b, -c, rest_frames[g, 3, k])
            turns[g, 0, k], turns[g, 1, k], turns[g, 2, k], turns[g, 3, k] = x, y, z, w
            _, _, _, length = _segment(now, g, k)
            turns[g, 4, k] = min(length / rest[g, k, 3], _MOST_STRETCH)


@inlined
def _segment(points, g, k):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return unit direction and length of the segment to point k of a guide."""
    x = points[g, k, 0] - points[g, k - 1, 0]
    y = points[g, k, 1] - points[g, k - 1, 1]
    z = points[g, k, 2] - points[g, k - 1, 2]
    length = max(np.sqrt(x * x + y * y + z * z), np.float32(SHORTEST))
    return x / length, y / length, z / length, length


@inlined
def _between(ax, ay, az, bx, by, bz):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the least rotation, not normalised, from a unit vector to another."""
    w = _ONE + ax * bx + ay * by + az * bz
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    if x * x + y * y + z * z + w * w <= _TINY:  # opposite
        return _ZERO, _ZERO, _ONE, _ZERO
    return x, y, z, w


@inlined
def _multiply(ax, ay, az, aw, bx, by, bz, bw):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the rotation b followed by a, quaternions."""
    return (
        aw * bx + bw * ax + ay * bz - az * by,
        aw * by + bw * ay + az * bx - ax * bz,
        aw * bz + bw * az + ax * by - ay * bx,
        aw * bw - ax * bx - ay * by - az * bz,
    )


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
    first_chunk, last_chunk, guides, turns, followed, weights, edges, widths, camera, slices,
    wider, count, way, places, seen, filled, used, frame,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Interpolate chunks of `count` strands, and splat their segments into the view cells.

    Each segment keeps its length at rest, times the stretch of the nearest guide, and turns as the
    three guides on the mean. Guides that turn apart from the nearest one lose their share: hair
    between them goes with the nearest, as locks do, and is neither stretched nor folded. `edges`
    are (S, 3, M) and `turns` (G, 5, M), see `in_lanes`; `way` (chunks, 3, M) is scratch.
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
            guides, turns, followed, weights, edges, widths, camera, slices, wider,
            count * chunk // chunks, count * (chunk + 1) // chunks, way[chunk], places, seen,
            filled[chunk], frame[chunk],
        )  # fmt: skip


@shared
def _place_chunk(  # type: ignore[no-untyped-def]
    guides, turns, followed, weights, edges, widths, camera, slices, wider, first, last, way,
    places, seen, filled, frame,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    points = guides.shape[1]
    low_x, low_y, high_x, high_y = frame[0], frame[1], frame[2], frame[3]
    for s in range(first, last):
        a, b, c = followed[s, 0], followed[s, 1], followed[s, 2]
        u, v, w = weights[s, 0], weights[s, 1], weights[s, 2]
        _turn_edges(turns[a], turns[b], turns[c], u, v, w, edges[s], way)
        for d in range(3):
            way[d, 0] += u * guides[a, 0, d] + v * guides[b, 0, d] + w * guides[c, 0, d]
        x = y = z = _ZERO
        for k in range(points):
            x, y, z = x + way[0, k], y + way[1, k], z + way[2, k]
            places[s, k, 0], places[s, k, 1], places[s, k, 2] = x, y, z
            px, py, pz, depth = project_point(camera, x, y, z)
            seen[s, k, 0], seen[s, k, 1], seen[s, k, 2], seen[s, k, 3] = px, py, pz, depth
            if depth > _ZERO:
                low_x, low_y = min(low_x, px), min(low_y, py)
                high_x, high_y = max(high_x, px), max(high_y, py)
        for k in range(1, points):
            depth = seen[s, k, 3]
            if depth > _ZERO and seen[s, k - 1, 3] > _ZERO:
                width = widths[s, k] * wider * pixels_per_metre(camera, depth)
                _fill(filled, seen, s, k, slices, width)
    frame[0], frame[1], frame[2], frame[3] = low_x, low_y, high_x, high_y


@shared
def _turn_edges(near, second, third, u, v, w, edges, way) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Write `way` (3, M), the segments to the points of a strand with `edges` (3, M) at rest.

    From the turns (5, M) of its guides, of weights u, v and w. M is a multiple of `LANES`, so that
    all is vectorised.
    """
    for start in range(0, edges.shape[1], LANES):
        for lane in range(LANES):
            k = start + lane
            ax, ay, az, aw = near[0, k], near[1, k], near[2, k], near[3, k]
            bx, by, bz, bw = second[0, k], second[1, k], second[2, k], second[3, k]
            cx, cy, cz, cw = third[0, k], third[1, k], third[2, k], third[3, k]
            b = v * _share(ax * bx + ay * by + az * bz + aw * bw)
            c = w * _share(ax * cx + ay * cy + az * cz + aw * cw)
            x, y, z = u * ax + b * bx + c * cx, u * ay + b * by + c * cy, u * az + b * bz + c * cz
            turn = u * aw + b * bw + c * cw
            ex, ey, ez = edges[0, k], edges[1, k], edges[2, k]
            ix, iy = y * ez - z * ey + turn * ex, z * ex - x * ez + turn * ey
            iz = x * ey - y * ex + turn * ez
            stretch = near[4, k]
            twice = _TWO * stretch / max(x * x + y * y + z * z + turn * turn, _TINY)
            way[0, k] = stretch * ex + twice * (y * iz - z * iy)
            way[1, k] = stretch * ey + twice * (z * ix - x * iz)
            way[2, k] = stretch * ez + twice * (x * iy - y * ix)


@inlined
def _share(along):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return by how much, and with which sign, the turn of another than the nearest guide counts.

    `along` is the product of both quaternions: the cosine of half the angle between the turns.
    """
    t = min(max((abs(along) - _PARTED) / (_TOGETHER - _PARTED), _ZERO), _ONE)
    t = t * t * (np.float32(3) - _TWO * t)
    return t if along >= _ZERO else -t


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
