"""Strand tracking through the field with certain and uncertain states (thesis 6.1 and 6.2).

From each root a strand follows the field in small steps, its sign kept along the growth (`walk`). A
step is uncertain when it lies outside the hair or the field turns too sharply; a strand then goes
straight on and ends after `max_score` uncertain steps in a row (the rules of the thesis, whose
field sampling is replaced by trilinear tensors and midpoint steps). Strands are pushed out of the
head, may slide along the surface of the hull where they meet it at a small angle, are cut where
they turn up into a U, resampled, and smoothed by averaging their edge vectors.

* `walk`: compiled steps of a strand through the field
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from hairkit import (
    Hull,
    OrientationField,
    Parting,
    Roots,
    ScalpDistance,
    Scene,
    Strands,
    TiedHair,
    Waves,
    hookimpl,
)
from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.field.growth_prior import combing_direction
from hairkit.grooming.postprocess import FinishOptions, finish
from hairkit.options import option
from hairkit.parallel import parallel_for

from .walk import Rules, Volumes, track_strands

SKIN_SMOOTHING = 1.5
"""Gaussian in cells under which the hull's occupancy gets a smooth surface to slide along."""
MIN_STRANDS = 32
"""Least number of strands worth a call on another thread."""
_PARALLEL = 1e-3
"""Sine of a normal's angle to the vertical below which it is not bent."""
_WHOLE = 1e-6
"""Share of a step by which rounding may make a strand's length shorter than its whole steps."""


@dataclass(frozen=True)
class Options(FinishOptions):
    """Settings of the tracker."""

    step: float = option(0.5, low=0.05, high=2, doc="Step in cells of the grid.")
    max_turn_deg: float = option(
        60.0, low=5, high=90, unit="deg", doc="A sharper turn in one step is uncertain."
    )
    max_score: int = option(8, low=1, high=100, doc="Uncertain steps in a row that end a strand.")
    blind_steps: int = option(
        8, low=0, high=50, doc="Steps after the root that are never uncertain."
    )
    inertia: float = option(
        0.3, low=0, high=0.95, doc="Share of the previous direction in the next one."
    )
    start: str = option(
        "combed",
        choices=("combed", "bent_normal"),
        doc="First direction: combing prior or bent normal.",
    )
    bend_deg: float = option(
        50.0, low=0, high=90, unit="deg", doc="Bend of the scalp normal for start = bent_normal."
    )
    lift: float = option(0.6, low=0, high=5, doc="Outward part of the combed first direction.")
    slide_sine: float = option(
        0.9,
        low=0,
        high=1,
        doc="Slide along the hull when the sine of the exit angle is below this; 0 never.",
    )
    slide_share: float = option(
        1.0,
        low=0,
        high=5,
        doc="Strands slide while shorter than this share of the longest way through the hair.",
    )
    max_length: float = option(1.2, low=0.01, high=5, unit="m", doc="Longest strand.")
    smoothing: int = option(5, low=0, high=50, doc="Smoothing iterations.")
    u_share: float = option(
        0.3,
        low=0,
        high=1,
        doc="Share of upward steps that marks a U-shaped strand (mu); 1 never trims.",
    )


@hookimpl
def track(
    scene: Scene,
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    waves: Waves,
    scalp_distance: ScalpDistance,
    parting: Parting,
    tied: TiedHair,
    options: Options,
) -> Strands:
    """Grow one strand from every root, trim, smooth and wave it, and keep it out of the head."""
    directions = _start_directions(scene, hull, field, roots, parting, options)
    points, counts = _grow(hull, field, roots, directions, scalp_distance.hair_length, options)
    points, counts = trim_u_turns(points, counts, options.u_share)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    rows = np.arange(points.shape[1])[None, :] < counts[:, None]
    strands = Strands(points[rows], offsets).resampled(options.points)
    even = strands.points.reshape(len(roots), options.points, 3)
    smooth = smooth_strands(even, options.smoothing)
    result = Strands(smooth.reshape(-1, 3), strands.offsets, root_uv=roots.uv)
    return finish(result, waves, tied, hull, field, options)


def _start_directions(
    scene: Scene,
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    parting: Parting,
    options: Options,
) -> Float64Array:
    """Return unit first directions (N, 3)."""
    normals = roots.normals.astype(np.float64)
    if options.start == "combed":
        return combing_direction(
            scene.head, hull, field.growth, roots.positions, options.lift, parting
        )
    # thesis 6.1: the normal n rotated by an angle G about n x (0, -1, 0)
    axis = np.cross(normals, [0.0, -1.0, 0.0])
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = axis / np.maximum(length, 1e-9)
    angle = np.radians(options.bend_deg)
    turned = normals * np.cos(angle) + np.cross(axis, normals) * np.sin(angle)
    result: Float64Array = np.where(length > _PARALLEL, turned, normals)
    return result


def _grow(
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    directions: Float64Array,
    hair_length: float,
    options: Options,
) -> tuple[Float32Array, Int64Array]:
    """Return padded points (N, M, 3) and how many of each strand are real (N,), at least two."""
    step = options.step * field.grid.spacing
    inside = ndimage.binary_dilation(hull.dense) & hull.loose
    skin = ndimage.gaussian_filter(inside.astype(np.float32), SKIN_SMOOTHING)
    volumes = Volumes(
        field.grid.origin,
        field.grid.spacing,
        field.tensor,
        field.growth[..., None],
        inside,
        skin[..., None],
        hull.head_distance[..., None],
    )
    rules = Rules(
        step,
        float(np.cos(np.radians(options.max_turn_deg))),
        options.max_score,
        options.blind_steps,
        options.inertia,
        options.slide_sine,
        options.slide_share * hair_length,
        options.clearance,
    )
    steps = max(int(options.max_length / step + _WHOLE), 1)
    points = np.zeros((len(roots), steps + 1, 3), np.float32)
    counts = np.zeros(len(roots), np.int64)
    starts = roots.positions.astype(np.float64)
    walk = (volumes, rules, starts, directions, points, counts)
    parallel_for(track_strands, len(starts), *walk, min_chunk=MIN_STRANDS)
    return points[:, : max(int(counts.max()), 2)], counts


def trim_u_turns(
    points: Float32Array, counts: Int64Array, share: float
) -> tuple[Float32Array, Int64Array]:
    """Cut strands (N, M, 3) that turn up into a U, and return their new numbers of points (N,).

    A strand is cut at its first upward step after the first downward one if upward steps are more
    than `share` of those that follow (mu of thesis 6.2).
    """
    if share >= 1:
        return points, counts
    rise = np.diff(points[:, :, 1], axis=1)
    real = np.arange(rise.shape[1])[None, :] < (counts - 1)[:, None]
    down, up = (rise < 0) & real, (rise > 0) & real
    first_down = np.where(down.any(axis=1), down.argmax(axis=1), rise.shape[1])
    after = up & (np.arange(rise.shape[1])[None, :] > first_down[:, None])
    too_many = after.sum(axis=1) > share * np.maximum(counts - first_down - 2, 1)
    cut = np.where(too_many & after.any(axis=1), after.argmax(axis=1) + 1, counts)
    return points, np.maximum(cut, 2)


def smooth_strands(points: Float32Array, iterations: int) -> Float32Array:
    """Return strands (N, M, 3) whose edge vectors are averaged with [1 2 1] / 4, roots fixed.

    The end edges are repeated at the border. After the last pass every edge gets its length back,
    so a strand keeps its own. Iben et al., "Artistic simulation of curly hair", 2013, also filter
    edges in place of points, there with a recursive filter from the root.
    """
    if iterations == 0 or points.shape[1] < 3:
        return points
    edges = np.diff(points.astype(np.float64), axis=1)
    length = np.linalg.norm(edges, axis=2, keepdims=True)
    for _ in range(iterations):
        padded = np.concatenate([edges[:, :1], edges, edges[:, -1:]], axis=1)
        edges = 0.25 * padded[:, :-2] + 0.5 * padded[:, 1:-1] + 0.25 * padded[:, 2:]
    edges *= length / np.maximum(np.linalg.norm(edges, axis=2, keepdims=True), 1e-12)
    result = points.astype(np.float64).copy()
    result[:, 1:] = points[:, :1] + np.cumsum(edges, axis=1)
    return result.astype(np.float32)
