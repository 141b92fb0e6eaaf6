"""Lines that follow the 2D orientation in each photo, lifted onto the front of the hull."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numba import njit, prange

from hairkit import Camera, Hull, Mask, OrientationMap, Strands
from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.cameras.projection_kernels import PackedCamera, pack_camera, perspective_divisor
from hairkit.field.sampling_kernels import sample_at
from hairkit.field.view_fusion import DEPTH_SHRINK, front_depths
from hairkit.parallel import compiled, parallel_for

PIXELS = 2.0
"""Step along a line in a photo."""
CONFIDENT = 0.25
"""Least confidence along a line, both of a pixel and, as a share of the best, of a cell."""
DEPTH_JUMP = 0.008
"""Metres by which the hull's front may change in one step along a line."""
STEP = 0.002
"""Metres between a segment's points."""
SMOOTHING = 3.0
"""Points over which lifted lines are smoothed: the hull's front is a staircase."""
FEWEST = 5
"""Points of the shortest segment."""


class LineOptions(Protocol):
    """What following lines asks of the plugin's options."""

    @property
    def line_spacing(self) -> int: ...
    @property
    def longest(self) -> float: ...


def lifted_lines(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    hull: Hull,
    options: LineOptions,
) -> Strands:
    """Return lines that follow the 2D orientation in each photo, lifted to the hull's front."""
    found = []
    fronts = front_depths(cameras, orientations, hull)
    for camera, mask, oriented, front in zip(cameras, masks, orientations, fronts, strict=True):
        weight = (oriented.confidence * mask.hair).astype(np.float32)
        seeds = _seeds(weight, options.line_spacing)
        steps = int(options.longest / PIXELS * camera.focal / _middle(front))
        lines = np.empty((len(seeds), 2 * max(steps // 2, FEWEST) + 1, 3), np.float32)
        counts = np.zeros(len(seeds), np.int64)
        _follow_photo(oriented.angle, weight, front, DEPTH_SHRINK, seeds, lines, counts)
        found.append(lifted(camera, lines, counts))
    points = np.concatenate([points for points, _ in found])
    counts = np.concatenate([counts for _, counts in found])
    return _even(points, counts)


def lifted(
    camera: Camera, lines: Float32Array, counts: Int64Array
) -> tuple[Float32Array, Int64Array]:
    """Return packed smooth points (P, 3) in the head frame of all long lines, and their counts."""
    long = np.flatnonzero(counts >= FEWEST)
    offsets = np.concatenate([[0], np.cumsum(counts[long])])
    points = np.empty((offsets[-1], 3), np.float32)
    shift = np.arange(int(3 * SMOOTHING) + 1)
    weights = np.exp(-0.5 * (shift / SMOOTHING) ** 2)
    parallel_for(_lift, len(long), pack_camera(camera), lines, long, offsets, weights, points)
    return points, counts[long]


def agreeing(lines: Strands, hull: Hull, volume: Float32Array, angle_deg: float) -> Strands:
    """Return the lines whose points on average run along the tensors (X, Y, Z, 6) where these are
    sure, whose traces are."""
    share = np.empty(len(lines))
    grid = hull.grid
    _share_along(grid.origin, grid.spacing, volume, lines.points, lines.offsets, share)
    return lines.select(share >= np.cos(np.radians(angle_deg)) ** 2)


def _middle(front: Float32Array) -> float:
    seen = front[np.isfinite(front)]
    return float(np.median(seen)) if len(seen) else 1.0


def _seeds(weight: Float32Array, spacing: int) -> Int64Array:
    """Return (N, 2) row and column of the most confident pixel of each square of `spacing`."""
    height, width = (n // spacing for n in weight.shape)
    squares = weight[: height * spacing, : width * spacing]
    squares = squares.reshape(height, spacing, width, spacing).swapaxes(1, 2)
    squares = squares.reshape(height, width, spacing * spacing)
    best = squares.argmax(axis=2)
    row, column = np.nonzero(squares.max(axis=2) > CONFIDENT)
    inside = best[row, column]
    return np.stack([row * spacing + inside // spacing, column * spacing + inside % spacing], 1)


@njit(cache=True, parallel=True)
def _follow_photo(angle, weight, front, shrink, seeds, lines, counts):  # type: ignore[no-untyped-def]
    """Write u, v, depth of each line's points in order into lines (N, M, 3), counts into (N,)."""
    half = lines.shape[1] // 2
    for s in prange(len(seeds)):
        back = np.empty((half, 3), np.float32)
        ahead = np.empty((half, 3), np.float32)
        before = _follow_one(angle, weight, front, shrink, seeds[s], -1.0, back)
        after = _follow_one(angle, weight, front, shrink, seeds[s], 1.0, ahead)
        counts[s] = join(back, before, ahead, after, lines[s])


@njit(cache=True)
def join(back, before, ahead, after, line):  # type: ignore[no-untyped-def]
    """Write `before` points backwards and `after` points ahead, which both begin at the seed, in
    order into line (M, 3); returns their number."""
    total = 0
    for k in range(before - 1, 0, -1):  # the seed itself is the first point of `ahead`
        line[total] = back[k]
        total += 1
    for k in range(after):
        line[total] = ahead[k]
        total += 1
    return total


@njit(cache=True)
def _follow_one(angle, weight, front, shrink, seed, sign, line):  # type: ignore[no-untyped-def]
    height, width = angle.shape
    y, x = seed[0] + 0.5, seed[1] + 0.5
    dx, dy, before = 0.0, 0.0, 0.0
    for k in range(len(line)):
        i, j = int(y), int(x)
        if i < 0 or j < 0 or i >= height or j >= width or weight[i, j] < CONFIDENT:
            return k
        depth = front[min(i // shrink, front.shape[0] - 1), min(j // shrink, front.shape[1] - 1)]
        if not np.isfinite(depth) or (k > 0 and abs(depth - before) > DEPTH_JUMP):
            return k
        before = depth
        line[k, 0], line[k, 1], line[k, 2] = x, y, depth
        c, s = np.cos(angle[i, j]), np.sin(angle[i, j])
        if k == 0:
            c, s = sign * c, sign * s
        elif c * dx + s * dy < 0:
            c, s = -c, -s
        if k > 0 and c * dx + s * dy < 0.8:  # a bend of more than 37 degrees is another strand
            return k + 1
        dx, dy = c, s
        x += PIXELS * c
        y += PIXELS * s
    return len(line)


@compiled
def _lift(
    first: int,
    last: int,
    camera: PackedCamera,
    lines: Float32Array,
    chosen: Int64Array,
    offsets: Int64Array,
    weights: Float64Array,
    points: Float32Array,
) -> None:
    """Write the chosen lines (K,) of u, v, depth (N, M, 3) smoothed into points (P, 3)."""
    for k in range(first, last):
        rough = np.empty((offsets[k + 1] - offsets[k], 3))
        for i in range(len(rough)):
            _unproject(camera, lines[chosen[k], i], rough[i])
        _smooth(rough, weights, points[offsets[k] : offsets[k + 1]])


@compiled
def _unproject(camera: PackedCamera, pixel: Float32Array, point: Float64Array) -> None:
    """Write the head frame point (3,) of pixel u, v and axial depth: `Camera.unproject`."""
    depth = np.float64(pixel[2])
    scale = perspective_divisor(camera, depth)
    x = (pixel[0] - camera.centre_u) / camera.focal * scale - camera.translation[0]
    y = (pixel[1] - camera.centre_v) / camera.focal * scale - camera.translation[1]
    z = depth - camera.translation[2]
    for axis in range(3):
        point[axis] = x * camera.right[axis] + y * camera.down[axis] + z * camera.forward[axis]


@njit(cache=True)
def _smooth(rough, weights, smooth):  # type: ignore[no-untyped-def]
    """Write a line (M, 3) smoothed by a kernel, whose one half is weights (R,), into smooth (M,
    3); beyond the ends there is nothing."""
    reach = len(weights) - 1
    for i in range(len(rough)):
        x, y, z, norm = 0.0, 0.0, 0.0, 0.0
        for j in range(max(i - reach, 0), min(i + reach + 1, len(rough))):
            weight = weights[abs(i - j)]
            x += weight * rough[j, 0]
            y += weight * rough[j, 1]
            z += weight * rough[j, 2]
            norm += weight
        smooth[i, 0], smooth[i, 1], smooth[i, 2] = x / norm, y / norm, z / norm


def _even(points: Float32Array, counts: Int64Array) -> Strands:
    strands = Strands(points, np.concatenate([[0], np.cumsum(counts)]))
    if not len(strands):
        return strands
    strands = strands.select(strands.lengths() >= (FEWEST - 1) * STEP)
    return strands.resampled_by_length(STEP) if len(strands) else strands


@njit(cache=True, parallel=True)
def _share_along(origin, spacing, volume, points, offsets, share):  # type: ignore[no-untyped-def]
    """Write for each line the share of the tensors' traces that lies along its tangents, (S,)."""
    for s in prange(len(share)):
        tensor, d = np.empty(6), np.empty(3)
        along, trace = 0.0, 0.0
        for i in range(offsets[s], offsets[s + 1]):
            ahead = min(i, offsets[s + 1] - 2)  # the last point has the tangent of the one before
            square = 0.0
            for axis in range(3):
                d[axis] = np.float64(points[ahead + 1, axis]) - points[ahead, axis]
                square += d[axis] * d[axis]
            sample_at(origin, spacing, volume, points[i], tensor)
            trace += tensor[0] + tensor[1] + tensor[2]
            if square > 0:
                along += _quadratic(tensor, d) / square
        share[s] = along / max(trace, 1e-6)


@njit(cache=True, inline="always")
def _quadratic(t, d):  # type: ignore[no-untyped-def]
    """Return d T d of a tensor (6,) and a vector (3,)."""
    x, y, z = d[0], d[1], d[2]
    square = t[0] * x * x + t[1] * y * y + t[2] * z * z
    return square + 2 * (t[3] * x * y + t[4] * x * z + t[5] * y * z)
