"""Oriented 3D segments from photos: lines lifted onto the hull and lines through outer cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from hairkit import Camera, Head, Hull, Mask, Parting, Strands
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.field.cell_shells import erode_cells
from hairkit.field.growth_prior import combing_direction, gradient, long_share, parts
from hairkit.field.parting import crown_share
from hairkit.field.relaxed_signs import relaxed_signs
from hairkit.field.sampling_kernels import copy_point, make_unit, principal_direction, sample_at
from hairkit.field.view_fusion import FusedViews
from hairkit.parallel import compiled_with, parallel_for

from .options import Options
from .photo_lines import (
    CONFIDENT,
    FEWEST,
    MIN_LINES,
    STEP,
    agreeing,
    join,
    join_lines,
    lift_photo_lines,
)

NEIGHBOURS = 8
"""Nearest segments that a segment compares its sign with."""
NEIGHBOUR_WEIGHT = 4.0
"""Weight of a parallel neighbour's sign against a growth of one metre per metre."""
HANGING_WEIGHT, HANGS_OFF = 2.0, 0.02
"""Weight of hanging down against a growth of one metre per metre, and the metres off the head from
which hair hangs: where a tuft stands out or a fringe ends on the forehead, the potential leads
hair below it upwards."""
OUTER_CELLS = 2
"""Depth in cells of the hull's outer shell, which photos see."""
BEST = 95
"""Percentile of the shell's certainty that is taken for the best: the maximum may be an outlier."""
AGREEMENT_DEG = 35.0
"""A lifted line is dropped if it differs by more from the fused field of all views."""
RUN_ON = 0.5
"""Share of a seed's least certainty at which a line still runs on."""
FIRST_WAY = np.array([0.3, 0.9, 0.3])
"""Way that a line's two ends are sorted along; oblique, so that no frequent direction is square to
it. The growth decides later which end is the root."""


class TensorVolume(NamedTuple):
    """Tensors on a grid."""

    origin: Float64Array
    """(3,) lowest corner of the grid, metres, head frame."""
    spacing: float
    """Edge of a cell, metres."""
    values: Float32Array
    """(X, Y, Z, 6) in the order xx yy zz xy xz yz, each times its certainty."""


class Way(NamedTuple):
    """What tells a segment's root from its tip."""

    growth: Float32Array
    """(X, Y, Z) potential that rises from root to tip."""
    head: Head
    parting: Parting
    """How the crown is combed."""
    hair_length: float
    """Longest way through the hair from the nearest scalp, metres."""


def find_segments(
    cameras: Sequence[Camera],
    masks: Sequence[Mask],
    fused: FusedViews,
    hull: Hull,
    way: Way,
    options: Options,
) -> Strands:
    """Return segments root to tip, points `STEP` apart, in the head frame.

    Parameters
    ----------
    fused
        The maps of all views, and their fusion in the loose cells.
    way
        From root to tip: the first guess of a segment's sign.
    """
    certainty = fused.certainty
    volume = np.zeros((*hull.grid.shape, 6), np.float32)
    volume[hull.loose] = fused.tensor * np.minimum(certainty, 1)[:, None]
    lines = lift_photo_lines(cameras, masks, fused, options)
    lines = agreeing(lines, hull, volume, AGREEMENT_DEG)
    inner = lines_through_cells(hull, volume, certainty, options.longest)
    every = join_lines([lines, inner])
    del lines, inner
    return orient_segments(every, hull, way) if len(every) else every


def lines_through_cells(
    hull: Hull, volume: Float32Array, certainty: Float32Array, longest: float
) -> Strands:
    """Return lines through the tensors (X, Y, Z, 6) from every second confident outer cell."""
    outer = hull.dense & ~erode_cells(hull.dense, OUTER_CELLS)
    sure = np.zeros(hull.grid.shape, np.float32)
    sure[hull.loose] = certainty
    best = float(np.percentile(sure[outer], BEST)) if outer.any() else 0.0
    cells = np.argwhere(outer & (sure > CONFIDENT * best))
    cells = cells[cells.sum(axis=1) % 2 == 0]
    seeds = hull.grid.origin + (cells + 0.5) * hull.grid.spacing
    half = max(int(longest / STEP / 2), FEWEST)
    lines = np.zeros((len(seeds), 2 * half + 1, 3), np.float32)
    counts = np.zeros(len(seeds), np.int64)
    inside = (hull.dense & (sure > RUN_ON * CONFIDENT * best))[..., None].astype(np.float32)
    tensors = TensorVolume(hull.grid.origin, hull.grid.spacing, volume)
    follow = (tensors, inside, seeds, lines, counts)
    parallel_for(_follow_cells, len(seeds), *follow, min_chunk=MIN_LINES)
    long = counts >= FEWEST
    real = np.arange(lines.shape[1])[None] < counts[long, None]
    offsets = np.concatenate([[0], np.cumsum(counts[long])])
    return Strands(lines[long][real], offsets)


@compiled_with(allocates=True)
def _follow_cells(
    first: int,
    last: int,
    tensors: TensorVolume,
    inside: Float32Array,
    seeds: Float64Array,
    lines: Float32Array,
    counts: Int64Array,
) -> None:
    """Write lines `first` to `last` from seeds (N, 3) both ways into lines (N, M, 3), counts (N,).

    `inside` (X, Y, Z, 1) is 1 in the cells that lines may run through.
    """
    half = lines.shape[1] // 2
    tensor, way = np.empty(6), np.empty(3)
    for s in range(first, last):
        sample_at(tensors.origin, tensors.spacing, tensors.values, seeds[s], tensor)
        for axis in range(3):
            way[axis] = FIRST_WAY[axis]
        if not principal_direction(tensor, way, way):
            continue
        back, ahead = np.empty((half, 3), np.float32), np.empty((half, 3), np.float32)
        before = _follow_tensors(tensors, inside, seeds[s], way, -1.0, back)
        after = _follow_tensors(tensors, inside, seeds[s], way, 1.0, ahead)
        counts[s] = join(back, before, ahead, after, lines[s])


@compiled_with(allocates=True, inside=True)
def _follow_tensors(
    tensors: TensorVolume,
    inside: Float32Array,
    seed: Float64Array,
    way: Float64Array,
    sign: float,
    line: Float32Array,
) -> int:
    """Write points (M, 3) from seed (3,) along sign times way (3,), and return their number."""
    p, d = np.empty(3), np.empty(3)
    for axis in range(3):
        p[axis], d[axis] = seed[axis], sign * way[axis]
    tensor, share = np.empty(6), np.empty(1)
    origin, spacing, values = tensors.origin, tensors.spacing, tensors.values
    for k in range(len(line)):
        sample_at(origin, spacing, inside, p, share)
        if share[0] < 0.5:
            return k
        copy_point(p, line[k])
        sample_at(origin, spacing, values, p, tensor)
        if not principal_direction(tensor, d, d) or not make_unit(d):
            return k + 1
        for axis in range(3):
            p[axis] += STEP * d[axis]
    return len(line)


def orient_segments(segments: Strands, hull: Hull, way: Way) -> Strands:
    """Return the segments root to tip, those that ran tip to root reversed.

    What a segment wishes is the way to the tips along it: that of the growth potential, and of
    gravity beside the head; that of the comb in short hair, whose ends lie everywhere, and on a
    crown that is known. Its neighbours wish the sign that makes them parallel to it.
    """
    count = len(segments)
    level = hull.grid.sample(way.growth, np.concatenate([segments.roots, segments.tips]))
    chord = (segments.tips - segments.roots).astype(np.float64)
    length = np.maximum(np.linalg.norm(chord, axis=1), 1e-6)
    middle = 0.5 * (segments.tips + segments.roots)
    unit = chord / length[:, None]
    combed = np.full(count, 1 - long_share(way.hair_length))
    if parts(way.parting, way.hair_length):
        combed = np.maximum(combed, crown_share(way.parting, way.head, middle))
    rise = np.clip((level[count:] - level[:count]) / length, -1, 1)
    off = np.clip(hull.grid.sample(hull.head_distance, middle) / HANGS_OFF, 0, 1)
    beside = 1 - np.maximum(gradient(hull.grid, hull.head_distance, middle)[:, 1], 0)
    hangs = -HANGING_WEIGHT * off * beside * unit[:, 1]
    wish = (1 - combed) * (rise + hangs)
    on = np.flatnonzero(combed)
    comb = combing_direction(
        way.head, hull, way.growth, middle[on], 0.0, way.parting, way.hair_length
    )
    wish[on] += combed[on] * (unit[on] * comb).sum(axis=1)
    near = cKDTree(middle).query(middle, k=min(NEIGHBOURS + 1, count))[1].reshape(count, -1)[:, 1:]
    parallel = NEIGHBOUR_WEIGHT * np.einsum("nkc,nc->nk", unit[near], unit)
    owner = np.repeat(np.arange(count), near.shape[1])
    cosines = sparse.csr_matrix((parallel.ravel(), (owner, near.ravel())), (count, count))
    return _reverse(segments, relaxed_signs(wish, cosines) < 0)


def _reverse(segments: Strands, turned: BoolArray) -> Strands:
    """Return the segments, those of `turned` (S,) with their points in reverse order."""
    counts, ends = segments.counts, segments.offsets[:-1] + segments.offsets[1:] - 1
    rows = np.flatnonzero(np.repeat(turned, counts))
    points = segments.points.copy()
    points[rows] = segments.points[np.repeat(ends[turned], counts[turned]) - rows]
    return Strands(points, segments.offsets)
