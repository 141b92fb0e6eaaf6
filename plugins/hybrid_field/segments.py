"""Oriented 3D segments from photos: lines lifted onto the hull and lines through outer cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numba import njit, prange
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit import Camera, Hull, Mask, Strands
from hairkit.arrays import Float32Array
from hairkit.field.sampling_kernels import make_unit, principal_direction, sample_at
from hairkit.field.view_fusion import FusedViews

from .photo_lines import CONFIDENT, FEWEST, STEP, LineOptions, agreeing, join, lifted_lines

NEIGHBOURS, ROUNDS = 8, 10
"""Segments that a segment compares its sign with, and how often."""


class SegmentOptions(LineOptions, Protocol):
    """What finding segments asks of the plugin's options."""

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
    lines = agreeing(lines, hull, volume, options.agreement_deg)
    inner = lines_through_cells(hull, volume, certainty, options.longest)
    points = np.concatenate([lines.points, inner.points])
    offsets = np.concatenate([lines.offsets, inner.offsets[1:] + lines.offsets[-1]])
    if len(offsets) == 1:
        return Strands(points, offsets)
    return directed(Strands(points, offsets), hull, growth)


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
        counts[s] = join(back, before, ahead, after, lines[s])


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
