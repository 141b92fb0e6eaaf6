"""Strand tracking through the field with certain and uncertain states (thesis 6.1 and 6.2).

From each root a strand follows the field in small steps, its sign kept along the growth. A step is
uncertain when it lies outside the hair or the field turns too sharply; a strand then goes straight
on and ends after `max_score` uncertain steps in a row (the rules of the thesis, whose field
sampling is replaced by trilinear tensors and midpoint steps). Strands are pushed out of the head,
may slide along the skin of the hull when they meet it at a small angle, are smoothed after Iben et
al. 2013, cut where they turn up into a U, and resampled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from scipy import ndimage

from hairkit import Hull, Mask, OrientationField, OrientationMap, Roots, Scene, Strands, hookimpl
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.field.growth_prior import combing_direction, hair_length, scalp_way
from hairkit.field.sampling_kernels import gradient_at, make_unit, principal_direction, sample_at
from hairkit.grooming.postprocess import FinishOptions, finished
from hairkit.options import option

ROOT_STEPS, ROOT_INERTIA = 4, 0.7
"""Near the scalp the field is weak: the first steps keep more of their direction."""
ACROSS = 0.2
"""Cosine below which a strand and the field are nearly square to each other."""
SKIN_SMOOTHING, SKIN_LEVEL = 1.5, 0.6
"""Gaussian in cells of the hull's occupancy, and its level that strands slide along."""


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
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    options: Options,
) -> Strands:
    """Grow one strand from every root, trim and smooth it, wind it into waves, keep it out of
    the head."""
    directions = _start_directions(scene, hull, field, roots, options)
    points, counts = _grow(scene, hull, field, roots, directions, options)
    points, counts = _trimmed(points, counts, options.u_share)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    rows = np.arange(points.shape[1])[None, :] < counts[:, None]
    strands = Strands(points[rows], offsets).resampled(options.points)
    smooth = _smoothed(strands.points.reshape(len(roots), options.points, 3), options.smoothing)
    result = Strands(smooth.reshape(-1, 3), strands.offsets, root_uv=roots.uv)
    return finished(result, scene, masks, orientations, hull, options)


def _start_directions(
    scene: Scene, hull: Hull, field: OrientationField, roots: Roots, options: Options
) -> Float64Array:
    """Return unit first directions (N, 3)."""
    normals = roots.normals.astype(np.float64)
    if options.start == "combed":
        return combing_direction(scene.head, hull, field.growth, roots.positions, options.lift)
    # thesis 6.1: the normal turned by G about n x (0, -1, 0); where that axis vanishes it stays
    axis = np.cross(normals, [0.0, -1.0, 0.0])
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = axis / np.maximum(length, 1e-9)
    angle = np.radians(options.bend_deg)
    turned = normals * np.cos(angle) + np.cross(axis, normals) * np.sin(angle)
    result: Float64Array = np.where(length > 1e-3, turned, normals)
    return result


def _grow(
    scene: Scene,
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    directions: Float64Array,
    options: Options,
) -> tuple[Float32Array, Int64Array]:
    """Return padded points (N, M, 3) and how many of each strand are real (N,), at least two."""
    step = options.step * field.grid.spacing
    inside = ndimage.binary_dilation(hull.dense) & hull.loose
    skin = ndimage.gaussian_filter(inside.astype(np.float32), SKIN_SMOOTHING)
    volumes = _Volumes(
        field.grid.origin,
        field.grid.spacing,
        field.tensor,
        field.growth[..., None],
        inside,
        skin[..., None],
        hull.head_distance[..., None],
    )
    rules = _Rules(
        step,
        float(np.cos(np.radians(options.max_turn_deg))),
        options.max_score,
        options.blind_steps,
        options.inertia,
        options.slide_sine,
        options.slide_share * hair_length(hull, scalp_way(scene.head, hull)),
        options.clearance,
    )
    steps = max(int(options.max_length / step + 1e-6), 1)
    points = np.zeros((len(roots), steps + 1, 3), np.float32)
    counts = np.zeros(len(roots), np.int64)
    _track_all(volumes, rules, roots.positions.astype(np.float64), directions, points, counts)
    return points[:, : max(int(counts.max()), 2)], counts


class _Volumes(NamedTuple):
    """What the compiled walk reads; scalars have a last axis of one.

    Only to be read: in a parallel loop Numba loses what is written through a tuple's field.
    """

    origin: Float64Array
    spacing: float
    tensors: Float32Array
    growth: Float32Array
    inside: BoolArray
    skin: Float32Array
    head_distance: Float32Array


class _Rules(NamedTuple):
    """The options in the units of the walk: metres, cosines, steps."""

    step: float
    min_cosine: float
    max_score: int
    blind_steps: int
    inertia: float
    slide_sine: float
    slide_length: float
    clearance: float


@njit(cache=True, parallel=True)
def _track_all(volumes, rules, starts, directions, points, counts):  # type: ignore[no-untyped-def]
    for s in prange(len(starts)):
        counts[s] = _track_one(volumes, rules, starts[s], directions[s], points[s])


@njit(cache=True)
def _track_one(volumes, rules, start, direction, points):  # type: ignore[no-untyped-def]
    """Write one strand into points (M, 3); returns its number of points up to the last sure one."""
    p, d, found = start.copy(), direction.copy(), np.empty(3)
    points[0] = p
    points[1] = p + rules.step * d
    sure, score = 1, rules.max_score
    for i in range(1, len(points)):
        if not _in_grid(volumes, p):
            break
        blind = i <= rules.blind_steps
        cosine = _follow(volumes, rules, p, d, found)
        certain = blind or (cosine >= rules.min_cosine and _in_hair(volumes, p))
        if cosine >= rules.min_cosine or (blind and cosine > -1):
            keep = rules.inertia if i > ROOT_STEPS else max(rules.inertia, ROOT_INERTIA)
            for axis in range(3):
                d[axis] = keep * d[axis] + (1 - keep) * found[axis]
        if rules.slide_sine > 0 and i * rules.step < rules.slide_length:
            _slide(volumes, rules, p, d)
        if not make_unit(d):
            break
        for axis in range(3):
            p[axis] += rules.step * d[axis]
        if not _push_out(volumes, rules, p, d):
            break
        points[i] = p
        if certain:
            score = rules.max_score
            sure = i + 1
        else:
            score -= 1
            if score <= 0:
                break
    return max(sure, 2)


@njit(cache=True)
def _follow(volumes, rules, p, d, found):  # type: ignore[no-untyped-def]
    """Write the field's direction half a step on (midpoint rule) into found (3,), signed along d.

    Returns its cosine with d: negative where the growth potential turned the sign against d, -1
    where the field knows nothing.
    """
    tensor, middle = np.empty(6), np.empty(3)
    sample_at(volumes.origin, volumes.spacing, volumes.tensors, p, tensor)
    if not principal_direction(tensor, d, found):
        return -1.0
    for axis in range(3):
        middle[axis] = p[axis] + 0.5 * rules.step * found[axis]
    sample_at(volumes.origin, volumes.spacing, volumes.tensors, middle, tensor)
    if not principal_direction(tensor, found, found):
        return -1.0
    cosine = found[0] * d[0] + found[1] * d[1] + found[2] * d[2]
    if cosine < 0:
        found[:] = -found
        cosine = -cosine
    if cosine < ACROSS:  # the previous direction cannot tell the ends apart: the growth does
        gradient_at(volumes.origin, volumes.spacing, volumes.growth, p, middle)
        if found[0] * middle[0] + found[1] * middle[1] + found[2] * middle[2] < 0:
            found[:] = -found
            cosine = -cosine
    return cosine


@njit(cache=True)
def _slide(volumes, rules, p, d):  # type: ignore[no-untyped-def]
    """Bend d along the hull's skin where the next cell lies beyond it and the angle is small."""
    ahead, normal, inside = np.empty(3), np.empty(3), np.empty(1)
    for axis in range(3):
        ahead[axis] = p[axis] + volumes.spacing * d[axis]
    sample_at(volumes.origin, volumes.spacing, volumes.skin, ahead, inside)
    if inside[0] >= SKIN_LEVEL:
        return
    gradient_at(volumes.origin, volumes.spacing, volumes.skin, p, normal)
    sine = -(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2])
    if sine < rules.slide_sine:
        pull = max(sine, 0.0) + SKIN_LEVEL - inside[0]
        for axis in range(3):
            d[axis] += pull * normal[axis]


@njit(cache=True)
def _push_out(volumes, rules, p, d):  # type: ignore[no-untyped-def]
    """Lift p to the clearance over the head and take d's inward part; False where d vanishes."""
    distance, normal = np.empty(1), np.empty(3)
    sample_at(volumes.origin, volumes.spacing, volumes.head_distance, p, distance)
    if distance[0] >= rules.clearance:
        return True
    gradient_at(volumes.origin, volumes.spacing, volumes.head_distance, p, normal)
    inward = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]
    for axis in range(3):
        p[axis] += (rules.clearance - distance[0]) * normal[axis]
        if inward < 0:
            d[axis] -= inward * normal[axis]
    return make_unit(d)


@njit(cache=True)
def _in_grid(volumes, p):  # type: ignore[no-untyped-def]
    for axis in range(3):
        cell = int(np.floor((p[axis] - volumes.origin[axis]) / volumes.spacing))
        if cell < 0 or cell >= volumes.inside.shape[axis]:
            return False
    return True


@njit(cache=True)
def _in_hair(volumes, p):  # type: ignore[no-untyped-def]
    x = int((p[0] - volumes.origin[0]) / volumes.spacing)
    y = int((p[1] - volumes.origin[1]) / volumes.spacing)
    z = int((p[2] - volumes.origin[2]) / volumes.spacing)
    return volumes.inside[x, y, z]


def _trimmed(
    points: Float32Array, counts: Int64Array, share: float
) -> tuple[Float32Array, Int64Array]:
    """Cut strands that turn up into a U (thesis 6.2): at the first upward step after the first
    downward one."""
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


def _smoothed(points: Float32Array, iterations: int) -> Float32Array:
    """Smooth strands (N, M, 3) after Iben et al. 2013: edge vectors by a recursive low-pass, root
    fixed.

    Each pass filters the edges from the root on and back again, then puts the edges together; edge
    lengths are restored, so that a strand keeps its length.
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
