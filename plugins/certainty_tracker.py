"""Strand tracking of the thesis: certain and uncertain steps through an unsigned field (6.1, 6.2).

From each root a strand takes steps along the field, whose sign is that of the step before. A step
is uncertain where the strand is outside the hull or the field turns too sharply; the strand then
goes straight on, and ends when its score is used up. Strands are smoothed by a recursive filter on
their edges (Iben et al. 2013), cut where they turn up into a U, and resampled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hairkit import Hull, OrientationField, Roots, Strands, hookimpl
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.field.sampling_kernels import copy_point, principal_direction, sample_at
from hairkit.grooming.head_collision import push_out_of_head
from hairkit.options import option
from hairkit.parallel import compiled, compiled_with, parallel_for

MIN_STRANDS = 32
"""Least number of strands worth a call on another thread."""
_PARALLEL = 1e-3
"""Sine of a normal's angle to the vertical below which it is not bent."""
_WHOLE = 1e-6
"""Share of a step by which rounding may make a strand's length shorter than its whole steps."""


@dataclass(frozen=True)
class Options:
    """Settings of the tracker; the numbers are those of the thesis."""

    step: float = option(0.75, low=0.05, high=2, doc="Step in cells of the grid (delta).")
    max_turn_deg: float = option(
        48.65, low=5, high=90, unit="deg", doc="A sharper turn in one step is uncertain (theta)."
    )
    max_score: int = option(
        4, low=2, high=100, doc="One more than the uncertain steps in a row that end a strand."
    )
    bend_deg: float = option(
        50.0, low=0, high=90, unit="deg", doc="How far normals are bent down to begin with (G)."
    )
    max_length: float = option(1.2, low=0.01, high=5, unit="m", doc="Longest strand.")
    smoothing: int = option(5, low=0, high=50, doc="Passes of the smoothing filter.")
    smoothing_length: float = option(
        0.002, low=1e-5, high=0.1, unit="m", doc="Length that a pass smooths over (alpha)."
    )
    u_share: float = option(
        0.3, low=0, high=1, doc="Share of upward steps that marks a U (mu); 1 never trims."
    )
    points: int = option(64, low=2, high=255, doc="Points of every strand; equal segments.")
    clearance: float = option(0.001, low=0, high=0.02, unit="m", doc="Distance kept from the head.")


@hookimpl
def track(hull: Hull, field: OrientationField, roots: Roots, options: Options) -> Strands:
    """Grow one strand from every root, smooth, trim, resample, and push it out of the head."""
    points, counts = _grow(hull, field, roots, options)
    step = options.step * field.grid.spacing
    points = smooth_strands(points, step, options.smoothing_length, options.smoothing)
    counts = trim_u_turns(points, counts, options.u_share)
    rows = np.arange(points.shape[1])[None, :] < counts[:, None]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    strands = Strands(points[rows], offsets, root_uv=roots.uv).resampled(options.points)
    return push_out_of_head(strands, hull.grid, hull.head_distance, options.clearance)


def bent_normals(normals: Float32Array, bend_deg: float) -> Float64Array:
    """Return the unit normals n (N, 3) turned by an angle about n x (0, -1, 0): towards the ground.

    Straight up and down no side is lower, and the normal stays.
    """
    outward = normals.astype(np.float64)
    axis = np.cross(outward, [0.0, -1.0, 0.0])
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = axis / np.maximum(length, _PARALLEL)
    angle = np.radians(bend_deg)
    turned = outward * np.cos(angle) + np.cross(axis, outward) * np.sin(angle)
    return np.where(length > _PARALLEL, turned, outward)


class Volumes(NamedTuple):
    """Volumes on one grid."""

    origin: Float64Array
    """(3,) lowest corner of the grid, metres, head frame."""
    spacing: float
    """Edge of a cell, metres."""
    tensors: Float32Array
    """(X, Y, Z, 6) of the orientation field, in the order xx yy zz xy xz yz."""
    inside: BoolArray
    """(X, Y, Z) cells of the hull."""


class Rules(NamedTuple):
    """The options in the units of the walk."""

    step: float
    """Metres."""
    min_cosine: float
    """Of a turn in one step, below which the step is uncertain."""
    max_score: int
    """Score after a certain step."""


def _grow(
    hull: Hull, field: OrientationField, roots: Roots, options: Options
) -> tuple[Float32Array, Int64Array]:
    """Return padded points (N, M, 3) and how many of each strand are real (N,), at least two."""
    step = options.step * field.grid.spacing
    volumes = Volumes(field.grid.origin, field.grid.spacing, field.tensors(), hull.dense)
    least = float(np.cos(np.radians(options.max_turn_deg)))
    rules = Rules(step, least, options.max_score)
    steps = max(int(options.max_length / step + _WHOLE), 1)
    points = np.zeros((len(roots), steps + 1, 3), np.float32)
    counts = np.zeros(len(roots), np.int64)
    starts = roots.positions.astype(np.float64)
    directions = bent_normals(roots.normals, options.bend_deg)
    walk = (volumes, rules, starts, directions, points, counts)
    parallel_for(track_strands, len(starts), *walk, min_chunk=MIN_STRANDS)
    return points[:, : int(counts.max(initial=2))], counts


@compiled
def track_strands(
    first: int,
    last: int,
    volumes: Volumes,
    rules: Rules,
    starts: Float64Array,
    directions: Float64Array,
    points: Float32Array,
    counts: Int64Array,
) -> None:
    """Write strands `first` to `last` into points (N, M, 3), and their numbers of points (N,).

    `starts` and `directions` are (N, 3) roots and unit first directions.
    """
    for s in range(first, last):
        counts[s] = track_strand(volumes, rules, starts[s], directions[s], points[s])


@compiled_with(allocates=True)
def track_strand(
    volumes: Volumes,
    rules: Rules,
    start: Float64Array,
    direction: Float64Array,
    points: Float32Array,
) -> int:
    """Write one strand into points (M, 3) by the seven rules of 6.1; return how many it has.

    In rule 6 the previous direction is that of the last step, not of the field at the last point:
    the field would be followed one step late where it was found to be wrong.
    """
    p, d = start.copy(), direction.copy()
    tensor, found = np.empty(6), np.empty(3)
    points[0] = p
    score = rules.max_score
    for i in range(1, len(points)):
        if in_hull(volumes, p):
            sample_at(volumes.origin, volumes.spacing, volumes.tensors, p, tensor)
            if principal_direction(tensor, d, found):
                cosine = found[0] * d[0] + found[1] * d[1] + found[2] * d[2]
                if cosine >= rules.min_cosine:
                    score = rules.max_score
                    copy_point(found, d)
        for axis in range(3):
            p[axis] += rules.step * d[axis]
        points[i] = p
        score -= 1
        if score <= 0:
            return i + 1
    return len(points)


@compiled_with(allocates=True, inside=True)
def in_hull(volumes: Volumes, p: Float64Array) -> bool:
    """Return whether p (3,) lies in a cell of the hull."""
    cell = np.empty(3, np.int64)
    for axis in range(3):
        cell[axis] = int(np.floor((p[axis] - volumes.origin[axis]) / volumes.spacing))
        if cell[axis] < 0 or cell[axis] >= volumes.inside.shape[axis]:
            return False
    return bool(volumes.inside[cell[0], cell[1], cell[2]])


def smooth_strands(points: Float32Array, edge: float, length: float, passes: int) -> Float32Array:
    """Return strands (N, M, 3) with smooth edges; roots stay.

    With `b = 1 - exp(-edge / length)` a pass makes the edges e into
    `d_i = 2 (1 - b) d_(i-1) - (1 - b)^2 d_(i-2) + b^2 e_i`, from `d_-1 = d_-2 = e_0` at the root
    (Iben et al., "Artistic simulation of curly hair", 2013, section 4.1). `edge` and `length` are
    metres. Strands get shorter by what is smoothed off.
    """
    from scipy import signal  # it loads much of SciPy, which listing the plugins does not need

    edges = np.diff(points.astype(np.float64), axis=1)
    kept = np.exp(-edge / length)
    numerator, denominator = [(1 - kept) ** 2], [1.0, -2 * kept, kept**2]
    state = signal.lfilter_zi(numerator, denominator)[None, :, None]
    for _ in range(passes):
        edges, _ = signal.lfilter(numerator, denominator, edges, axis=1, zi=state * edges[:, :1])
    result = points.astype(np.float64)
    result[:, 1:] = points[:, :1] + np.cumsum(edges, axis=1)
    return result.astype(np.float32)


def trim_u_turns(points: Float32Array, counts: Int64Array, share: float) -> Int64Array:
    """Return how many points (N,) of the strands (N, M, 3) stay: those that turn up are cut.

    Counted from 1, i is the first point below the one before it. If more than `share * (n - i - 1)`
    of the points after i are higher than the one before, the strand ends at the first point j
    after i whose next one is higher (thesis 6.2).
    """
    if share >= 1:
        return counts
    rise = np.diff(points[:, :, 1], axis=1)
    edge = np.arange(rise.shape[1])[None, :]
    real = edge < (counts - 1)[:, None]
    down, up = (rise < 0) & real, (rise > 0) & real
    first_down = np.where(down.any(axis=1), down.argmax(axis=1), rise.shape[1])[:, None]
    too_many = (up & (edge > first_down)).sum(axis=1) > share * (counts - first_down[:, 0] - 3)
    later = up & (edge > first_down + 1)
    cut = np.where(too_many & later.any(axis=1), later.argmax(axis=1) + 1, counts)
    return np.maximum(cut, 2)
