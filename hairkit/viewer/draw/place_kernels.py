"""Interpolation of hair from guides, and opacity by depth: compiled twins of three shaders.

`viewer_guides.comp`, `viewer_place.comp` and `viewer_opacity.comp` do the same on a GPU; tests
compare both. Everything is float32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, UInt32Array
from hairkit.rendering.gl_camera import NEAREST
from hairkit.simulation import vectors as v
from hairkit.simulation.lanes import four, put, put_four, stage, three
from hairkit.simulation.vectors import HALF, ONE, TWO, ZERO, Frame, Number, Vector, inlined
from hairkit.viewer.draw.records import (
    Chunks,
    Guides,
    HairData,
    HairState,
    Projection,
    Strokes,
    ViewCells,
)

SLICES, TILE = 32, 8
"""Depth slices of the view; edge of a view cell in pixels."""
OPACITY_UNIT = np.float32(4096)
"""What an opacity of 1 adds to a view cell."""
PARTED, TOGETHER = (np.float32(np.cos(np.radians(angle))) for angle in (45.0, 22.5))
"""Cosines of half the angle between the turns of two guides: from 90 degrees on they share no hair,
up to 45 degrees they share it as at rest."""
LANES = 8
"""Points of a strand that are worked on together."""
STRETCH = 4
"""Row of the stretch in `Guides.turns`."""
MOST_STRETCH = np.float32(4.0)
"""Largest stretch of a segment that is drawn: places stay finite where a simulation diverges."""
SHORTEST = np.float32(1e-9)
"""Least length of a segment, metres."""
MIDDLE, BESIDE = np.float32(0.4), np.float32(0.15)
"""Weights of a tile and of each of its four neighbours in its smoothed opacity; they add to 1."""
CLOSE = np.float32(1e-4)
"""Least divisor of a projection, metres."""
_NEAREST, _FAR_BEHIND, _FAR = np.float32(NEAREST), np.float32(-1), np.float32(1e9)
_QUARTER, _THREE, _TINY = np.float32(0.25), np.float32(3), np.float32(1e-8)
_MIDDLE, _BESIDE = MIDDLE / OPACITY_UNIT, BESIDE / OPACITY_UNIT
_PER_TILE = np.float32(1 / TILE)


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
    """(G, 4, m) rotation, w, x, y, z, of a frame carried from the first segment to each one."""


def segments(rows: Float32Array) -> Float32Array:
    """Return (G, m, 4) unit direction and length of the segments to the points of guides."""
    edges = np.diff(rows, axis=1, prepend=rows[:, :1])
    lengths = np.maximum(np.linalg.norm(edges, axis=2, keepdims=True), SHORTEST)
    return np.concatenate([edges / lengths, lengths], axis=2, dtype=np.float32)


@stage
def carry_frames(
    first: int, last: int, rest: Float32Array, now: Float32Array, frames: Float32Array
) -> None:
    """Write how a frame turns from the first segment of guides at rest to each segment of `now`.

    It is carried along without twist (Bishop 1975, "There is more than one way to frame a curve"),
    so that it changes no faster than the guide bends. `rest` are `segments`.
    """
    for g in range(first, last):
        before = rest[g, 1, 0], rest[g, 1, 1], rest[g, 1, 2]
        frame = ONE, ZERO, ZERO, ZERO
        for k in range(1, now.shape[1]):
            way, _ = _segment(now[g], k)
            frame = v.unit(v.product(_between(before, way), frame))
            put_four(frames[g], k, frame)
            before = way


@stage
def turn_guides(first: int, last: int, rest: RestGuides, now: Guides) -> None:
    """Write rotation and stretch of the segments of guides since rest."""
    carry_frames(first, last, rest.segments, now.points, now.turns)
    for g in range(first, last):
        turns = now.turns[g]
        for k in range(1, now.points.shape[1]):
            w, x, y, z = four(rest.frames[g], k)
            put_four(turns, k, v.product(four(turns, k), (w, -x, -y, -z)))
            _, length = _segment(now.points[g], k)
            turns[STRETCH, k] = min(length / rest.segments[g, k, 3], MOST_STRETCH)


@inlined
def _segment(points: Float32Array, k: int) -> tuple[Vector, Number]:
    """Return unit direction and length of the segment to point k of a guide (m, 3)."""
    x, y, z = points[k, 0], points[k, 1], points[k, 2]
    edge = v.minus((x, y, z), (points[k - 1, 0], points[k - 1, 1], points[k - 1, 2]))
    length = max(np.sqrt(v.dot(edge, edge)), SHORTEST)
    return (edge[0] / length, edge[1] / length, edge[2] / length), length


@inlined
def _between(a: Vector, b: Vector) -> Frame:
    """Return the least rotation, not normalised, from a unit vector to another."""
    w, (x, y, z) = ONE + v.dot(a, b), v.cross(a, b)
    if x * x + y * y + z * z + w * w <= _TINY:  # opposite
        return ZERO, ZERO, ZERO, ONE
    return w, x, y, z


@inlined
def project_point(camera: Projection, place: Vector) -> Frame:
    """Return pixel x, y, depth-buffer depth and axial depth of a point; below 0: behind."""
    right, down, deep, away = camera.clip
    over = ONE / max(v.dot(away, place) + away[3], CLOSE)
    x, y = (v.dot(right, place) + right[3]) * over, (v.dot(down, place) + down[3]) * over
    z = (v.dot(deep, place) + deep[3]) * over
    depth = v.dot(camera.forward, place) + camera.offset
    if camera.perspective and depth < _NEAREST:
        depth = _FAR_BEHIND
    return (
        (x * HALF + HALF) * camera.width,
        (y * HALF + HALF) * camera.height,
        z * HALF + HALF,
        depth,
    )


@inlined
def pixels_per_metre(camera: Projection, depth: Number) -> Number:
    """Return the scale of the picture at an axial depth, pixels per metre."""
    return camera.focal / max(depth, CLOSE) if camera.perspective else camera.focal


@inlined
def count_hidden(a: Vector, b: Vector, solid: Float32Array) -> int:
    """Return how many of a stroke's ends and its middle are behind meshes, 0 to 3.

    Ends a and b in pixels of the columns and depth; `solid` (W, H) is the depth buffer of meshes.
    """
    return _behind(a, solid) + _behind(b, solid) + _behind(v.times(HALF, v.plus(a, b)), solid)


@inlined
def _behind(pixel: Vector, solid: Float32Array) -> int:
    """Return 1 if a mesh, `solid` (W, H), is nearer than a point in pixels and depth; else 0."""
    column = min(max(int(pixel[0]), 0), solid.shape[0] - 1)
    row = min(max(int(pixel[1]), 0), solid.shape[1] - 1)
    return 1 if pixel[2] > solid[column, row] else 0


@stage
def place_hair(
    first_chunk: int,
    last_chunk: int,
    guides: Guides,
    hair: HairData,
    strokes: Strokes,
    state: HairState,
    cells: ViewCells,
    chunks: Chunks,
) -> None:
    """Interpolate chunks of the strands, and splat their segments into the view cells.

    Each segment keeps its length at rest, times the stretch of the nearest guide, and turns as the
    three guides on the mean. Guides that turn apart from the nearest one lose their share: hair
    between them goes with the nearest, as locks do, and is neither stretched nor folded. Writes
    `places` and `seen` of the state; each chunk also writes its part of `filled` and its corners.
    """
    count, used = len(chunks.corners), cells.used
    for chunk in range(first_chunk, last_chunk):
        filled, corners = cells.filled[chunk], chunks.corners[chunk]
        filled[:, used[1] : used[3], used[0] : used[2]] = 0
        corners[:2], corners[2:] = _FAR, -_FAR
        for s in range(strokes.hairs * chunk // count, strokes.hairs * (chunk + 1) // count):
            _turn_edges(guides, hair, s, chunks.way[chunk])
            _place_strand(guides, hair, s, chunks.way[chunk], strokes.camera, state, corners)
            _fill_strand(state.seen[s], hair.widths[s], strokes, filled)


@inlined
def _place_strand(
    guides: Guides,
    hair: HairData,
    s: int,
    way: Float32Array,
    camera: Projection,
    state: HairState,
    corners: Float32Array,
) -> None:
    """Add up the segments (3, M) from the root, and project the points."""
    a, b, c = hair.followed[s, 0], hair.followed[s, 1], hair.followed[s, 2]
    f, g, h = hair.weights[s, 0], hair.weights[s, 1], hair.weights[s, 2]
    roots, places, seen = guides.points, state.places[s], state.seen[s]
    for d in range(3):
        way[d, 0] += f * roots[a, 0, d] + g * roots[b, 0, d] + h * roots[c, 0, d]
    place = ZERO, ZERO, ZERO
    low_x, low_y, high_x, high_y = corners[0], corners[1], corners[2], corners[3]
    for k in range(len(places)):
        place = v.plus(place, three(way, k))
        places[k, 0], places[k, 1], places[k, 2] = place
        x, y, z, depth = project_point(camera, place)
        seen[k, 0], seen[k, 1], seen[k, 2], seen[k, 3] = x, y, z, depth
        if depth > ZERO:
            low_x, low_y = min(low_x, x), min(low_y, y)
            high_x, high_y = max(high_x, x), max(high_y, y)
    corners[0], corners[1], corners[2], corners[3] = low_x, low_y, high_x, high_y


@stage
def _turn_edges(guides: Guides, hair: HairData, s: int, way: Float32Array) -> None:
    """Write `way` (3, M), the segments to the points of a strand, from the turns of its guides.

    M is a multiple of `LANES`, so that all is vectorised.
    """
    near, second = guides.turns[hair.followed[s, 0]], guides.turns[hair.followed[s, 1]]
    third, edges = guides.turns[hair.followed[s, 2]], hair.edges[s]
    f, g, h = hair.weights[s, 0], hair.weights[s, 1], hair.weights[s, 2]
    for start in range(0, edges.shape[1], LANES):
        for lane in range(LANES):
            k = start + lane
            a, b, c = four(near, k), four(second, k), four(third, k)
            p, q = g * _share(_inner(a, b)), h * _share(_inner(a, c))
            turn = f * a[0] + p * b[0] + q * c[0]
            axis = (
                f * a[1] + p * b[1] + q * c[1],
                f * a[2] + p * b[2] + q * c[2],
                f * a[3] + p * b[3] + q * c[3],
            )
            edge, stretch = three(edges, k), near[STRETCH, k]
            aside = v.plus(v.cross(axis, edge), v.times(turn, edge))
            twice = TWO * stretch / max(v.dot(axis, axis) + turn * turn, _TINY)
            put(way, k, v.plus(v.times(stretch, edge), v.times(twice, v.cross(axis, aside))))


@inlined
def _inner(a: Frame, b: Frame) -> Number:
    """Return the inner product of quaternions: the cosine of half the angle between the turns."""
    cosine: Number = a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[0] * b[0]
    return cosine


@inlined
def _share(along: Number) -> Number:
    """Return by how much, and with which sign, the turn of another than the nearest guide counts.

    `along` is the inner product of both quaternions.
    """
    t: Number = min(max((max(along, -along) - PARTED) / (TOGETHER - PARTED), ZERO), ONE)
    t = t * t * (_THREE - TWO * t)
    return t if along >= ZERO else -t


@inlined
def _fill_strand(
    seen: Float32Array, widths: Float32Array, strokes: Strokes, filled: UInt32Array
) -> None:
    """Splat the segments of a strand before the camera."""
    for k in range(1, len(seen)):
        depth = seen[k, 3]
        if depth > ZERO and seen[k - 1, 3] > ZERO:
            width = widths[k] * strokes.wider * pixels_per_metre(strokes.camera, depth)
            _fill(filled, seen, k, width, strokes.near, strokes.slices_per_metre)


@stage
def _fill(
    filled: UInt32Array,
    seen: Float32Array,
    k: int,
    width: Number,
    nearest: Number,
    per_metre: Number,
) -> None:
    """Splat the segment from point k - 1 to k into the cells at its quarters."""
    ax, ay = seen[k - 1, 0], seen[k - 1, 1]
    x, y = seen[k, 0] - ax, seen[k, 1] - ay
    opacity = HALF * np.sqrt(x * x + y * y) * width / np.float32(TILE * TILE)
    whole = np.uint32(opacity * OPACITY_UNIT + HALF)
    near = seen[k - 1, 3]
    depth = seen[k, 3] - near
    for part in (_QUARTER, ONE - _QUARTER):
        column, line = (ax + part * x) * _PER_TILE, (ay + part * y) * _PER_TILE
        if column < ZERO or line < ZERO:
            continue
        i, j = int(column), int(line)
        if i >= filled.shape[2] or j >= filled.shape[1]:
            continue
        layer = int((near + part * depth - nearest) * per_metre)
        filled[min(max(layer, 0), SLICES - 1), j, i] += whole


@stage
def accumulate_opacity(first: int, last: int, cells: ViewCells) -> None:
    """Write rows of the optical depth of hair before each slice.

    A coarse form of deep opacity maps (Yuksel and Keyser 2008) along the line of sight; each tile
    is smoothed with its neighbours. Only tiles `used` are written, in rows `first` to `last` of
    them.
    """
    filled, opacity = cells.filled, cells.opacity
    chunks, slices, rows, columns = filled.shape
    left, top, right = cells.used[0], cells.used[1], cells.used[2]
    for j in range(top + first, top + last):
        up, down = max(j - 1, 0), min(j + 1, rows - 1)
        for i in range(left, right):
            opacity[0, j, i] = ZERO
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
