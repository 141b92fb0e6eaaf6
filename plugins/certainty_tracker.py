"""Strand tracking through the orientation field with certain and uncertain states (thesis 6.1 and 6.2).

From each root a strand follows the field in small steps, its sign kept along the growth. A step is uncertain when
it lies outside the hair or the field turns too sharply; a strand then goes straight on and ends after `max_score`
uncertain steps in a row (the rules of the thesis, whose field sampling is replaced by trilinear tensors and
midpoint steps). Strands are pushed out of the head, may slide along the skin of the hull when they meet it at a
small angle, are smoothed after Iben et al. 2013, cut where they turn up into a U, and resampled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit, prange
from scipy import ndimage

from hairkit import Hull, Mask, OrientationField, OrientationMap, Roots, Scene, Strands, hookimpl
from hairkit.combing import combing_direction, gradient, hair_length, scalp_way
from hairkit.options import option
from hairkit.stored import Float32Array, Float64Array, Int64Array
from hairkit.waves import add_waves, measure_waves


@dataclass(frozen=True)
class Options:
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
    clearance: float = option(0.001, low=0, high=0.02, unit="m", doc="Distance kept from the head.")
    max_length: float = option(1.2, low=0.01, high=5, unit="m", doc="Longest strand.")
    smoothing: int = option(5, low=0, high=50, doc="Smoothing iterations.")
    u_share: float = option(
        0.3,
        low=0,
        high=1,
        doc="Share of upward steps that marks a U-shaped strand (mu); 1 never trims.",
    )
    waves: bool = option(True, doc="Wind the strands as the photos' waves do.")
    points: int = option(64, low=2, high=255, doc="Points of every strand; equal segments.")


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
    """Grow one strand from every root, trim and smooth it, wind it into waves, keep it out of the head."""
    directions = _start_directions(scene, hull, field, roots, options)
    points, counts = _grow(scene, hull, field, roots, directions, options)
    points, counts = _trimmed(points, counts, options.u_share)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    rows = np.arange(points.shape[1])[None, :] < counts[:, None]
    strands = Strands(points[rows], offsets).resampled(options.points)
    smooth = _smoothed(strands.points.reshape(len(roots), options.points, 3), options.smoothing)
    result = Strands(smooth.reshape(-1, 3), strands.offsets, root_uv=roots.uv)
    if options.waves:
        result = add_waves(result, measure_waves(orientations, masks, scene.cameras))
    return _outside_head(result, hull, options.clearance)


def _outside_head(strands: Strands, hull: Hull, clearance: float) -> Strands:
    """Return strands whose points, but for the roots, keep `clearance` metres from the head."""
    points = strands.points.astype(np.float64)
    free = np.ones(len(points), bool)
    free[strands.offsets[:-1]] = False
    for _ in range(3):
        lack = clearance - hull.grid.sample(hull.head_distance, points)
        near = np.flatnonzero((lack > 0) & free)
        points[near] += lack[near, None] * gradient(hull.grid, hull.head_distance, points[near])
    return replace(strands, points=points.astype(np.float32))


def _start_directions(
    scene: Scene, hull: Hull, field: OrientationField, roots: Roots, options: Options
) -> Float64Array:
    """Return unit first directions (N, 3)."""
    normals = roots.normals.astype(np.float64)
    if options.start == "combed":
        return combing_direction(scene.head, hull, field.growth, roots.positions, options.lift)
    # thesis 6.1: the normal turned by G about n x (0, -1, 0); where that axis vanishes the normal stays
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
    steps = int(np.ceil(options.max_length / step)) + 1
    inside = ndimage.binary_dilation(hull.dense) & hull.loose
    outward = ndimage.gaussian_filter(inside.astype(np.float32), 1.5)
    slide_length = options.slide_share * hair_length(hull, scalp_way(scene.head, hull))
    points = np.zeros((len(roots), steps + 1, 3), np.float32)
    counts = np.zeros(len(roots), np.int64)
    _track_all(
        field.grid.origin,
        field.grid.spacing,
        field.tensor,
        field.growth,
        inside,
        outward,
        hull.head_distance,
        roots.positions.astype(np.float64),
        directions,
        step,
        np.cos(np.radians(options.max_turn_deg)),
        options.max_score,
        options.blind_steps,
        options.inertia,
        options.slide_sine,
        slide_length,
        options.clearance,
        points,
        counts,
    )
    return points[:, : max(int(counts.max()), 2)], counts


@njit(cache=True, inline="always")  # type: ignore[untyped-decorator]
def _sample(origin, spacing, values, p, result):  # type: ignore[no-untyped-def]
    """Trilinear sample of values (X, Y, Z, C) at p into result (C,)."""
    nx, ny, nz, channels = values.shape
    fx = min(max((p[0] - origin[0]) / spacing - 0.5, 0.0), nx - 1.001)
    fy = min(max((p[1] - origin[1]) / spacing - 0.5, 0.0), ny - 1.001)
    fz = min(max((p[2] - origin[2]) / spacing - 0.5, 0.0), nz - 1.001)
    ix, iy, iz = int(fx), int(fy), int(fz)
    tx, ty, tz = fx - ix, fy - iy, fz - iz
    for c in range(channels):
        low = (values[ix, iy, iz, c] * (1 - tz) + values[ix, iy, iz + 1, c] * tz) * (1 - ty) + (
            values[ix, iy + 1, iz, c] * (1 - tz) + values[ix, iy + 1, iz + 1, c] * tz
        ) * ty
        high = (values[ix + 1, iy, iz, c] * (1 - tz) + values[ix + 1, iy, iz + 1, c] * tz) * (
            1 - ty
        ) + (values[ix + 1, iy + 1, iz, c] * (1 - tz) + values[ix + 1, iy + 1, iz + 1, c] * tz) * ty
        result[c] = low * (1 - tx) + high * tx


@njit(cache=True)  # type: ignore[untyped-decorator]
def _gradient(origin, spacing, values, p, result):  # type: ignore[no-untyped-def]
    """Central difference of values (X, Y, Z, 1) at p, made unit, into result (3,); zero where flat."""
    at = np.empty(3)
    one = np.empty(1)
    for axis in range(3):
        at[:] = p
        at[axis] = p[axis] + spacing
        _sample(origin, spacing, values, at, one)
        high = one[0]
        at[axis] = p[axis] - spacing
        _sample(origin, spacing, values, at, one)
        result[axis] = high - one[0]
    norm = np.sqrt(result[0] ** 2 + result[1] ** 2 + result[2] ** 2)
    if norm > 1e-9:
        for axis in range(3):
            result[axis] /= norm


@njit(cache=True)  # type: ignore[untyped-decorator]
def _principal(tensor, direction, result):  # type: ignore[no-untyped-def]
    """Power iteration from `direction`; returns False where the tensor vanishes or says nothing."""
    x, y, z = direction[0], direction[1], direction[2]
    for _ in range(6):
        a = tensor[0] * x + tensor[3] * y + tensor[4] * z
        b = tensor[3] * x + tensor[1] * y + tensor[5] * z
        c = tensor[4] * x + tensor[5] * y + tensor[2] * z
        norm = np.sqrt(a * a + b * b + c * c)
        if norm < 1e-6:
            return False
        x, y, z = a / norm, b / norm, c / norm
    if x * direction[0] + y * direction[1] + z * direction[2] < 0:
        x, y, z = -x, -y, -z
    result[0], result[1], result[2] = x, y, z
    return True


@njit(cache=True, parallel=True)  # type: ignore[untyped-decorator]
def _track_all(  # type: ignore[no-untyped-def]
    origin,
    spacing,
    tensors,
    growth,
    inside,
    density,
    head_distance,
    starts,
    directions,
    step,
    min_cosine,
    max_score,
    blind_steps,
    inertia,
    slide_sine,
    slide_length,
    clearance,
    points,
    counts,
):
    shape = np.array(inside.shape)
    density4 = density.reshape((*density.shape, 1))
    head4 = head_distance.reshape((*head_distance.shape, 1))
    growth4 = growth.reshape((*growth.shape, 1))
    for s in prange(len(starts)):
        p = starts[s].copy()
        d = directions[s].copy()
        tensor, six = np.empty(6), np.empty(6)
        found, middle, normal, one = np.empty(3), np.empty(3), np.empty(3), np.empty(1)
        points[s, 0] = p
        count, sure, score = 1, 1, max_score
        for i in range(points.shape[1] - 1):
            # the field here and half a step on (midpoint rule)
            _sample(origin, spacing, tensors, p, tensor)
            known = _principal(tensor, d, found)
            if known:
                for axis in range(3):
                    middle[axis] = p[axis] + 0.5 * step * found[axis]
                _sample(origin, spacing, tensors, middle, six)
                known = _principal(six, found, found)
            cosine = 0.0
            if known:
                cosine = found[0] * d[0] + found[1] * d[1] + found[2] * d[2]
                if cosine < 0:
                    found[:] = -found
                    cosine = -cosine
                if cosine < 0.2:  # nearly across: the way from the scalp decides which end leads on
                    _gradient(origin, spacing, growth4, p, normal)
                    if found[0] * normal[0] + found[1] * normal[1] + found[2] * normal[2] < 0:
                        found[:] = -found
                        cosine = -cosine
            blind = i < blind_steps
            ok = True
            for axis in range(3):
                cell = int(np.floor((p[axis] - origin[axis]) / spacing))
                ok = ok and 0 <= cell < shape[axis]
            if not ok:
                break
            here = inside[
                int((p[0] - origin[0]) / spacing),
                int((p[1] - origin[1]) / spacing),
                int((p[2] - origin[2]) / spacing),
            ]
            certain = known and cosine >= min_cosine and (here or blind)
            if known and (cosine >= min_cosine or blind):
                keep = inertia if i >= 4 else max(inertia, 0.7)
                for axis in range(3):
                    d[axis] = keep * d[axis] + (1 - keep) * found[axis]
            # slide along the hull's skin instead of leaving it at a small angle
            if slide_sine > 0 and count * step < slide_length:
                for axis in range(3):
                    middle[axis] = p[axis] + spacing * d[axis]
                _sample(origin, spacing, density4, middle, one)
                if one[0] < 0.6:
                    _gradient(origin, spacing, density4, p, normal)
                    sine = -(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2])
                    if sine < slide_sine:
                        pull = max(sine, 0.0) + 0.6 - one[0]
                        for axis in range(3):
                            d[axis] += pull * normal[axis]
            norm = np.sqrt(d[0] ** 2 + d[1] ** 2 + d[2] ** 2)
            if norm < 1e-6:
                break
            for axis in range(3):
                d[axis] /= norm
                p[axis] += step * d[axis]
            _sample(origin, spacing, head4, p, one)
            if one[0] < clearance:
                _gradient(origin, spacing, head4, p, normal)
                inward = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]
                for axis in range(3):
                    p[axis] += (clearance - one[0]) * normal[axis]
                    if inward < 0:
                        d[axis] -= inward * normal[axis]
                norm = np.sqrt(d[0] ** 2 + d[1] ** 2 + d[2] ** 2)
                if norm < 1e-6:
                    break
                for axis in range(3):
                    d[axis] /= norm
            points[s, count] = p
            count += 1
            if certain or blind:
                score = max_score
                sure = count
            else:
                score -= 1
                if score <= 0:
                    break
        counts[s] = max(sure, 2)
        if sure < 2:
            points[s, 1] = starts[s] + step * directions[s]


def _trimmed(
    points: Float32Array, counts: Int64Array, share: float
) -> tuple[Float32Array, Int64Array]:
    """Cut strands that turn up into a U (thesis 6.2): at the first upward step after the first downward one."""
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
    """Smooth strands (N, M, 3) after Iben et al. 2013: edge vectors by a recursive low-pass, root fixed.

    Each pass filters the edges from the root on and back again, then puts the edges together; edge lengths are
    restored, so that a strand keeps its length.
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
