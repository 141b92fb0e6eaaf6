"""Strands that hang loose over bare skin beside tied hair: a fringe, and wisps.

Each is traced back from an end of the loose hair, through cells ever nearer to its root end, to the
nearest root that bears none yet; as many as the hair's share says, all ends alike.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.types.strands import Strands
from hairkit.types.tie import LooseHair, TiedHair

ROOT_REACH = 0.035
"""Metres from its root within which a strand enters the loose hair."""
HOP = 0.025
"""Metres of a step through the loose hair, at most: gaps in a wisp are up to 12 mm."""
END_REACH, END_DEPTH = 0.015, 0.006
"""Metres about an end of loose hair in which no cell's way is longer by more than the second."""
LEAST_END = 0.5
"""Share of the longest way below which a cell is no end."""
STEEP = 0.85
"""Share of the steepest slope of the way from which directions count."""
MIDDLE_REACH, SLICE = 0.008, 0.004
"""Metres about a cell, and difference of the ways, in which cells make one cross-section."""
STEP, SMOOTH_STEPS = 0.003, 3.0
"""Metres between the points of a strand, and standard deviation of its smoothing in points."""
SPREAD = 0.003
"""Metres about its traced way in which strands lie."""
GOLDEN = 2.399963229728653
"""Golden angle, radians."""


def hang_fringe(roots: Float64Array, tied: TiedHair, count: int) -> tuple[Int64Array, Float32Array]:
    """Return which of the roots (N, 3) bear loose hair (K,), and its strands (K, count, 3)."""
    chosen: list[int] = []
    strands: list[Float64Array] = []
    free = cKDTree(roots)
    for loose in tied.loose:
        wanted = int(np.ceil(loose.share * len(roots)))
        for number, way in enumerate(_trace_ways(loose, wanted)):
            away, near = free.query(way[0], k=len(chosen) + 1, distance_upper_bound=ROOT_REACH)
            unused = np.setdiff1d(np.atleast_1d(near)[np.isfinite(away)], chosen)
            if len(unused):
                root = unused[np.argmin(np.linalg.norm(roots[unused] - way[0], axis=1))]
                chosen.append(int(root))
                strands.append(_bend(np.vstack([roots[root], way]), number))
    if not chosen:
        return np.zeros(0, np.int64), np.zeros((0, count, 3), np.float32)
    even = Strands.from_list(strands).resampled(count).points.reshape(-1, count, 3)
    return np.array(chosen, np.int64), even


def _trace_ways(loose: LooseHair, wanted: int) -> list[Float64Array]:
    """Return `wanted` ways (M, 3) through the cells from the root end, spread over all ends."""
    cells, way = loose.cells[:, :3].astype(np.float64), loose.cells[:, 3].astype(np.float64)
    tree = cKDTree(cells)
    long = np.flatnonzero(way >= LEAST_END * way.max())
    around = tree.query_ball_point(cells[long], END_REACH)
    ends = [k for k, near in zip(long, around, strict=True) if way[k] > way[near].max() - END_DEPTH]
    chosen = np.array(ends)[np.arange(wanted) * len(ends) // wanted]
    return [_trace_back(int(end), cells, way, tree) for end in chosen]


def _trace_back(end: int, cells: Float64Array, way: Float64Array, tree: cKDTree) -> Float64Array:
    """Return the middles (M, 3) of the cross-sections from the root end to a cell."""
    path, at = [cells[end]], end
    while True:
        near = np.array(tree.query_ball_point(cells[at], HOP))
        off = cells[near] - cells[at]
        slope = (way[at] - way[near]) / np.maximum(np.linalg.norm(off, axis=1), HOP / 2)
        steepest = int(np.argmax(slope))
        if slope[steepest] <= 0:
            return np.array(path[::-1])
        # ways come in steps along the grid: the mean of the steep directions has no such bias
        steep = slope >= STEEP * slope[steepest]
        ahead = int(tree.query(cells[at] + off[steep].mean(axis=0))[1])
        at = ahead if way[ahead] < way[at] else int(near[steepest])
        near = np.array(tree.query_ball_point(cells[at], MIDDLE_REACH))
        path.append(cells[near[np.abs(way[near] - way[at]) < SLICE]].mean(axis=0))


def _bend(corners: Float64Array, number: int) -> Float64Array:
    """Return strand `number` (M, 3) of a lock: the way of corners (K, 3) made round."""
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    at = np.linspace(0, arc[-1], max(int(arc[-1] / STEP), 2) + 1)
    even = np.stack([np.interp(at, arc, column) for column in corners.T], axis=1)
    smooth: Float64Array = ndimage.gaussian_filter1d(even, SMOOTH_STEPS, axis=0, mode="nearest")
    turn = GOLDEN * number
    radius = SPREAD * np.sqrt(turn % 1)
    off = radius * np.array([np.cos(turn), 0.0, np.sin(turn)])
    smooth += np.minimum(np.arange(len(at)) / SMOOTH_STEPS, 1)[:, None] * off
    smooth[0] = corners[0]
    return smooth
