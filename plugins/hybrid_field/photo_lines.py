"""Lines that follow the 2D orientation in each photo, lifted onto the front of the hull."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from hairkit import Camera, Hull, Mask, Strands
from hairkit.arrays import Float32Array, Int64Array
from hairkit.field.sampling_kernels import copy_point
from hairkit.field.view_fusion import DEPTH_SHRINK, FusedViews
from hairkit.parallel import compiled, compiled_with, parallel_for
from hairkit.types.volume import outer_products

from .options import Options

PIXELS = 2.0
"""Step along a line in a photo, pixels."""
CONFIDENT = 0.25
"""Least confidence along a line, of a pixel and, as a share of the best one, of a cell."""
DEPTH_JUMP = 0.008
"""Metres by which the hull's front may change in one step along a line."""
STEP = 0.002
"""Metres between a segment's points."""
SMOOTHING = 3.0
"""Gaussian in points under which lifted lines are smoothed: the hull's front has steps."""
REACH = 9
"""Points on either side that have weight in it."""
LINE_SPACING = 10
"""Pixels between the lines that are followed in a photo."""
FEWEST = 5
"""Points of the shortest segment."""
MIN_COSINE = 0.8
"""Cosine of the sharpest turn in one step; beyond 37 degrees it is another strand."""
LEAST_TRACE = 1e-6
"""Certainty below which the tensors along a line are unknown."""
MIN_LINES = 64
"""Least number of lines worth a call on another thread."""


def lift_photo_lines(
    cameras: Sequence[Camera], masks: Sequence[Mask], fused: FusedViews, options: Options
) -> Strands:
    """Return lines that follow the 2D orientation in each photo, lifted to the hull's front."""
    found: list[Strands] = []
    views = zip(cameras, masks, fused.orientations, fused.fronts, strict=True)
    for camera, mask, oriented, front in views:
        weight = (oriented.confidence * mask.hair).astype(np.float32)
        rows, columns = _seeds(weight, LINE_SPACING)
        steps = int(options.longest / PIXELS * camera.focal / _median_depth(front))
        lines = np.empty((len(rows), 2 * max(steps // 2, FEWEST) + 1, 3), np.float32)
        counts = np.zeros(len(rows), np.int64)
        photo = Photo(oriented.angle, weight, front)
        parallel_for(
            _follow_photo, len(rows), photo, rows, columns, lines, counts, min_chunk=MIN_LINES
        )
        # one by one: a line has a point for each pixel, many times as many as it keeps
        lifted = lift_lines(camera, lines, counts)
        long = lifted.lengths() >= (FEWEST - 1) * STEP
        found.append(lifted.select(long).resampled_by_length(STEP))
    return join_lines(found)


def join_lines(parts: Sequence[Strands]) -> Strands:
    """Return the lines of all parts, one after the other."""
    counts = np.concatenate([part.counts for part in parts])
    return Strands(
        np.concatenate([part.points for part in parts]), np.concatenate([[0], np.cumsum(counts)])
    )


def lift_lines(camera: Camera, lines: Float32Array, counts: Int64Array) -> Strands:
    """Return all long lines in the head frame, smooth, with their points as close as pixels.

    `lines` (N, M, 3) are u, v and axial depth, and `counts` (N,) the points that each has of them.
    """
    long = counts >= FEWEST
    packed = lines[np.arange(lines.shape[1]) < np.where(long, counts, 0)[:, None]]
    offsets = np.concatenate([[0], np.cumsum(counts[long])])
    # rows of zeros between the lines, and of each point the weight that it is smoothed with
    row = np.arange(len(packed)) + REACH * np.repeat(np.arange(long.sum()), counts[long])
    spaced = np.zeros((len(packed) + REACH * long.sum(), 4))
    spaced[row] = np.column_stack(
        [camera.unproject(packed[:, :2], packed[:, 2]), np.ones(len(row))]
    )
    smooth = gaussian_filter1d(spaced, SMOOTHING, 0, mode="constant", radius=REACH)[row]
    return Strands((smooth[:, :3] / smooth[:, 3:]).astype(np.float32), offsets)


def agreeing(lines: Strands, hull: Hull, volume: Float32Array, angle_deg: float) -> Strands:
    """Return the lines that differ by at most an angle from the tensors (X, Y, Z, 6) along them.

    A tensor's trace is its certainty, so the mean over a line is one of the certain cells.
    """
    tensor = hull.grid.sample(volume, lines.points)
    twice = [1, 1, 1, 2, 2, 2]  # what lies off the diagonal
    along = np.add.reduceat((tensor * outer_products(lines.tangents())) @ twice, lines.offsets[:-1])
    trace = np.add.reduceat(tensor[:, :3].sum(axis=1, dtype=np.float64), lines.offsets[:-1])
    share = along / np.maximum(trace, LEAST_TRACE)
    return lines.select(share >= np.cos(np.radians(angle_deg)) ** 2)


def _median_depth(front: Float32Array) -> float:
    """Return the median axial depth of a hull's front, metres."""
    seen = front[np.isfinite(front)]
    return float(np.median(seen)) if len(seen) else 1.0


def _seeds(weight: Float32Array, spacing: int) -> tuple[Int64Array, Int64Array]:
    """Return rows and columns (N,) of the most confident pixel of each square of `spacing`."""
    height, width = (n // spacing for n in weight.shape)
    squares = weight[: height * spacing, : width * spacing]
    squares = squares.reshape(height, spacing, width, spacing).swapaxes(1, 2)
    squares = squares.reshape(height, width, spacing * spacing)
    best = squares.argmax(axis=2)
    row, column = np.nonzero(squares.max(axis=2) > CONFIDENT)
    inside = best[row, column]
    return row * spacing + inside // spacing, column * spacing + inside % spacing


class Photo(NamedTuple):
    """One view's maps, of which `front` is `DEPTH_SHRINK` times smaller than the others."""

    angle: Float32Array
    """(H, W) strand angle, radians."""
    weight: Float32Array
    """(H, W) confidence on hair, 0 elsewhere."""
    front: Float32Array
    """(h, w) axial depth of the hull's front, metres, infinite beyond it."""


@compiled_with(allocates=True)
def _follow_photo(
    first: int,
    last: int,
    photo: Photo,
    rows: Int64Array,
    columns: Int64Array,
    lines: Float32Array,
    counts: Int64Array,
) -> None:
    """Write u, v, depth of lines `first` to `last` in order into lines (N, M, 3), counts (N,).

    Each line is followed both ways from the middle of its seed, a pixel's row and column (N,).
    """
    half = lines.shape[1] // 2
    for s in range(first, last):
        x, y = columns[s] + 0.5, rows[s] + 0.5
        back = np.empty((half, 3), np.float32)
        ahead = np.empty((half, 3), np.float32)
        before = _follow_line(photo, x, y, -1.0, back)
        after = _follow_line(photo, x, y, 1.0, ahead)
        counts[s] = join(back, before, ahead, after, lines[s])


@compiled
def join(
    back: npt.NDArray[np.floating[Any]],
    before: int,
    ahead: npt.NDArray[np.floating[Any]],
    after: int,
    line: npt.NDArray[np.floating[Any]],
) -> int:
    """Write the first `before` points of back (A, 3) reversed, then the first `after` of ahead
    (B, 3), into line (M, 3); return the number of points.

    Both begin at the seed, which is written once.
    """
    turn = max(before - 1, 0)
    for k in range(turn):
        copy_point(back[turn - k], line[k])
    for k in range(after):
        copy_point(ahead[k], line[turn + k])
    return turn + after


@compiled_with(inside=True)
def _follow_line(photo: Photo, x: float, y: float, sign: float, line: Float32Array) -> int:
    """Write u, v, depth (M, 3) of a line from a pixel on, and return its number of points.

    It starts along the angle times `sign` and ends where the photo is unsure, the hull's front
    jumps or the angle bends sharply.
    """
    height, width = photo.angle.shape
    rows, columns = photo.front.shape
    dx, dy, before = 0.0, 0.0, 0.0
    for k in range(len(line)):
        i, j = int(y), int(x)
        if i < 0 or j < 0 or i >= height or j >= width or photo.weight[i, j] < CONFIDENT:
            return k
        depth = photo.front[min(i // DEPTH_SHRINK, rows - 1), min(j // DEPTH_SHRINK, columns - 1)]
        if not np.isfinite(depth) or (k > 0 and abs(depth - before) > DEPTH_JUMP):
            return k
        before = depth
        line[k, 0], line[k, 1], line[k, 2] = x, y, depth
        c, s = np.cos(photo.angle[i, j]), np.sin(photo.angle[i, j])
        if k == 0:
            c, s = sign * c, sign * s
        elif c * dx + s * dy < 0:
            c, s = -c, -s
        if k > 0 and c * dx + s * dy < MIN_COSINE:
            return k + 1
        dx, dy = c, s
        x += PIXELS * c
        y += PIXELS * s
    return len(line)
