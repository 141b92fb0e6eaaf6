"""Oriented 3D segments from photos: lines lifted onto the hull and lines through outer cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numba import njit, prange
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit import Camera, Hull, Mask, OrientationMap, Strands
from hairkit.field_sampling import make_unit, principal_direction, sample_at
from hairkit.plane_fusion import DEPTH_SHRINK, FusedViews, front_depths
from hairkit.projection import pack_cameras
from hairkit.stored import Float32Array, Float64Array, Int64Array

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
NEIGHBOURS, ROUNDS = 8, 10
"""Segments that a segment compares its sign with, and how often."""


class SegmentOptions(Protocol):
    """What finding segments asks of the plugin's options."""

    @property
    def line_spacing(self) -> int: ...
    @property
    def longest(self) -> float: ...
    @property
    def agreement_deg(self) -> float: ...


def find_segments(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    fused: FusedViews,
    hull: Hull,
    growth: Float32Array,
    options: SegmentOptions,
) -> Strands:
    """Return segments root to tip, points `STEP` apart, in the head frame.

    Parameters
    ----------
    fused
        The maps of all views, and what they say together about the loose cells.
    growth
        (X, Y, Z) potential that grows root to tip: the first guess of a segment's sign.
    """
    certainty = fused.certainty
    volume = np.zeros((*hull.grid.shape, 6), np.float32)
    volume[hull.loose] = fused.tensor * np.minimum(certainty, 1)[:, None]
    lines = lifted_lines(cameras, masks, fused.orientations, hull, options)
    lines = _agreeing(lines, hull, volume, options.agreement_deg)
    inner = lines_through_cells(hull, volume, certainty, options.longest)
    points = np.concatenate([lines.points, inner.points])
    offsets = np.concatenate([lines.offsets, inner.offsets[1:] + lines.offsets[-1]])
    if len(offsets) == 1:
        return Strands(points, offsets)
    return directed(Strands(points, offsets), hull, growth)


def lifted_lines(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    hull: Hull,
    options: SegmentOptions,
) -> Strands:
    """Return lines that follow the 2D orientation in each photo, lifted to the hull's front."""
    found = []
    fronts = front_depths(cameras, orientations, hull)
    for camera, mask, oriented, front in zip(cameras, masks, orientations, fronts, strict=True):
        weight = (oriented.confidence * mask.hair).astype(np.float32)
        seeds = _seeds(weight, options.line_spacing)
        steps = int(options.longest / PIXELS * camera.focal / _middle(front))
        lines = np.zeros((len(seeds), 2 * max(steps // 2, FEWEST) + 1, 3), np.float32)
        counts = np.zeros(len(seeds), np.int64)
        _follow_photo(oriented.angle, weight, front, DEPTH_SHRINK, seeds, lines, counts)
        row = pack_cameras([camera])[0]
        long = counts >= FEWEST
        real = np.arange(lines.shape[1])[None] < counts[long, None]
        points = _unprojected(row, lines[long][real].astype(np.float64))
        found.append(_smoothed(points, counts[long]))
    points = np.concatenate([points for points, _ in found])
    counts = np.concatenate([counts for _, counts in found])
    return _even(points, counts)


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
        total = 0
        for k in range(before - 1, 0, -1):  # the seed itself is the first point of `ahead`
            lines[s, total] = back[k]
            total += 1
        for k in range(after):
            lines[s, total] = ahead[k]
            total += 1
        counts[s] = total


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


def _unprojected(row: Float64Array, pixels: Float64Array) -> Float64Array:
    """Return head frame points (N, 3) of pixels and axial depths (N, 3), of a packed camera."""
    depth = pixels[:, 2]
    scale = np.ones_like(depth) if row[15] > 0.5 else depth
    local = np.empty_like(pixels)
    local[:, 0] = (pixels[:, 0] - row[13]) / row[12] * scale
    local[:, 1] = (pixels[:, 1] - row[14]) / row[12] * scale
    local[:, 2] = depth
    result: Float64Array = (local - row[9:12]) @ row[:9].reshape(3, 3)
    return result


def _smoothed(points: Float64Array, counts: Int64Array) -> tuple[Float64Array, Int64Array]:
    """Return packed lines smoothed by a Gaussian along them, ends included."""
    owner = np.repeat(np.arange(len(counts)), counts)
    total, norm = np.zeros_like(points), np.zeros(len(points))
    reach = int(3 * SMOOTHING)
    for shift in range(-reach, reach + 1):
        other = np.clip(np.arange(len(points)) + shift, 0, max(len(points) - 1, 0))
        weight = np.exp(-0.5 * (shift / SMOOTHING) ** 2) * (owner[other] == owner)
        total += weight[:, None] * points[other]
        norm += weight
    return total / np.maximum(norm, 1e-12)[:, None], counts


def _even(points: Float64Array, counts: Int64Array) -> Strands:
    strands = Strands(points.astype(np.float32), np.concatenate([[0], np.cumsum(counts)]))
    if not len(strands):
        return strands
    strands = strands.select(strands.lengths() >= (FEWEST - 1) * STEP)
    return strands.resampled_by_length(STEP) if len(strands) else strands


def _agreeing(lines: Strands, hull: Hull, volume: Float32Array, angle_deg: float) -> Strands:
    """Return the lines whose points on average run along the fused tensor where it is sure."""
    if not len(lines):
        return lines
    tangent = lines.tangents().astype(np.float64)
    tensor = hull.grid.sample(volume, lines.points)
    trace = tensor[:, :3].sum(axis=1)
    along = (
        (tensor[:, :3] * tangent**2).sum(axis=1)
        + 2 * tensor[:, 3] * tangent[:, 0] * tangent[:, 1]
        + 2 * tensor[:, 4] * tangent[:, 0] * tangent[:, 2]
        + 2 * tensor[:, 5] * tangent[:, 1] * tangent[:, 2]
    )
    share = np.add.reduceat(along, lines.offsets[:-1]) / np.maximum(
        np.add.reduceat(trace, lines.offsets[:-1]), 1e-6
    )
    return lines.select(share >= np.cos(np.radians(angle_deg)) ** 2)


def lines_through_cells(
    hull: Hull, volume: Float32Array, certainty: Float32Array, longest: float
) -> Strands:
    """Return lines through the tensors (X, Y, Z, 6), one from every second confident outer cell."""
    outer = hull.dense & ~ndimage.binary_erosion(hull.dense, iterations=2)
    sure = np.zeros(hull.grid.shape, np.float32)
    sure[hull.loose] = certainty
    best = float(np.percentile(sure[outer], 95)) if outer.any() else 0.0
    cells = np.argwhere(outer & (sure > CONFIDENT * best))
    cells = cells[cells.sum(axis=1) % 2 == 0]
    seeds = hull.grid.origin + (cells + 0.5) * hull.grid.spacing
    half = max(int(longest / STEP / 2), FEWEST)
    lines = np.zeros((len(seeds), 2 * half + 1, 3))
    counts = np.zeros(len(seeds), np.int64)
    inside = (hull.dense & (sure > 0.5 * CONFIDENT * best))[..., None].astype(np.float32)
    _follow_cells(hull.grid.origin, hull.grid.spacing, volume, inside, seeds, lines, counts)
    long = counts >= FEWEST
    real = np.arange(lines.shape[1])[None] < counts[long, None]
    offsets = np.concatenate([[0], np.cumsum(counts[long])])
    return Strands(lines[long][real].astype(np.float32), offsets)


@njit(cache=True, parallel=True)
def _follow_cells(origin, spacing, volume, inside, seeds, lines, counts):  # type: ignore[no-untyped-def]
    half = lines.shape[1] // 2
    for s in prange(len(seeds)):
        tensor, way = np.empty(6), np.empty(3)
        sample_at(origin, spacing, volume, seeds[s], tensor)
        if not principal_direction(tensor, np.array([0.3, 0.9, 0.3]), way):
            continue
        back, ahead = np.empty((half, 3)), np.empty((half, 3))
        before = _follow_tensor(origin, spacing, volume, inside, seeds[s], -way, back)
        after = _follow_tensor(origin, spacing, volume, inside, seeds[s], way, ahead)
        total = 0
        for k in range(before - 1, 0, -1):
            lines[s, total] = back[k]
            total += 1
        for k in range(after):
            lines[s, total] = ahead[k]
            total += 1
        counts[s] = total


@njit(cache=True)
def _follow_tensor(origin, spacing, volume, inside, seed, way, line):  # type: ignore[no-untyped-def]
    p, d = seed.copy(), way.copy()
    tensor, one = np.empty(6), np.empty(1)
    for k in range(len(line)):
        sample_at(origin, spacing, inside, p, one)
        if one[0] < 0.5:
            return k
        line[k] = p
        sample_at(origin, spacing, volume, p, tensor)
        if not principal_direction(tensor, d, d) or not make_unit(d):
            return k + 1
        for axis in range(3):
            p[axis] += STEP * d[axis]
    return len(line)


def directed(segments: Strands, hull: Hull, growth: Float32Array) -> Strands:
    """Return the segments with the ends exchanged of those that run tip to root.

    Each starts with the sign of the growth along it, and then takes the sign that its nearest
    segments, weighted by how parallel they are, and the growth together want, for some rounds.
    """
    count = len(segments)
    level = hull.grid.sample(growth, np.concatenate([segments.roots, segments.tips]))
    chord = (segments.tips - segments.roots).astype(np.float64)
    length = np.maximum(np.linalg.norm(chord, axis=1), 1e-6)
    wish = np.clip((level[count:] - level[:count]) / length, -1, 1)
    middle = 0.5 * (segments.tips + segments.roots)
    near = cKDTree(middle).query(middle, k=min(NEIGHBOURS + 1, count))[1].reshape(count, -1)[:, 1:]
    unit = chord / length[:, None]
    parallel = np.einsum("nkc,nc->nk", unit[near], unit)
    sign = np.where(wish < 0, -1.0, 1.0)
    for _ in range(ROUNDS):
        vote = wish + 0.5 * (parallel * sign[near]).sum(axis=1)
        sign = np.where(vote < 0, -1.0, 1.0)
    return _reversed(segments, sign < 0)


def _reversed(
    segments: Strands, turned: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
) -> Strands:
    owner = segments.strand_of_point
    rank = np.arange(len(segments.points))
    mirrored = segments.offsets[:-1][owner] + segments.offsets[1:][owner] - 1 - rank
    rows = np.where(turned[owner], mirrored, rank)
    return Strands(segments.points[rows], segments.offsets)
