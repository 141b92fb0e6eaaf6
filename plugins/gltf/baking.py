"""A point cache as morph targets: shapes whose mixture is the motion, with weights from 0 to 1.

The shapes are those of the frames or, where few are enough, the principal components of the frames
(Alexa and Mueller, Representing Animations by Principal Components, 2000), in the frame of the
moving head.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.types.point_cache import PointCache

_STILL = 1e-7
"""Metres: frames whose points shift less from rest need no shape."""
_WORTH_SAYING = 1e-4
"""Metres: losses up to this are within what the files promise (docs/engines/web.md)."""

_log = logging.getLogger("hairkit")


@dataclass(frozen=True, eq=False)
class Baked:
    """Motion of the head and of the hair on it."""

    times: Float32Array
    """(T,) seconds from 0."""
    head_from_rest: Float64Array
    """(T, 4, 4)."""
    shapes: Float32Array
    """(M, P, 3) shifts of the strands' points from rest, head frame, metres."""
    weights: Float32Array
    """(T, M) of the shapes, 0 to 1."""


def bake(cache: PointCache, rest: Float32Array, step: int, morphs: int, deform: bool) -> Baked:
    """Return the motion in at most `morphs` shapes; a warning states the error.

    Parameters
    ----------
    cache
        Frames of the strands' points in the world.
    rest
        (P, 3) the points at rest, head frame.
    step
        Every how manieth frame is taken, from the first.
    morphs
        As many as moving frames, or more: the motion is kept within the tolerance.
    deform
        False leaves the hair rigid on the head: no shapes.
    """
    times = cache.times[::step]
    motion = cache.head_from_rest[::step]
    shapes, weights = np.zeros((0, *rest.shape), np.float32), np.zeros((len(times), 0), np.float32)
    if deform:
        shifts = _shifts(cache.points[::step], motion, rest)
        shapes, weights = _mixed(shifts, morphs)
    return Baked((times - times[0]).astype(np.float32), motion, shapes, weights)


def _shifts(points: Float32Array, motion: Float64Array, rest: Float32Array) -> Float32Array:
    """Return (T, P, 3) shifts from rest as the head sees them."""
    shifts = np.empty(points.shape, np.float32)
    for frame, world_from_head in enumerate(motion):
        turn, place = world_from_head[:3, :3], world_from_head[:3, 3]
        # a rigid motion's inverse is its transpose; row vectors take it from the right
        shifts[frame] = (points[frame] - place) @ np.linalg.inv(turn).T - rest
    return shifts


def _mixed(shifts: Float32Array, morphs: int) -> tuple[Float32Array, Float32Array]:
    """Return shapes (M, P, 3) and weights (T, M), 0 to 1, whose product is near the shifts.

    They are the moving frames themselves, or the fewest components within the tolerance where
    those are fewer.
    """
    flat = shifts.reshape(len(shifts), -1)
    moving = np.flatnonzero(np.abs(flat).max(axis=1) > _STILL)
    mean = flat.mean(axis=0)
    flat -= mean
    components = _components(flat)
    most = min(morphs, len(moving)) - 1
    count = _fewest(flat, components, most) if most > 0 else max(most, 0)
    if count == most and len(moving) <= morphs:
        flat += mean
        return shifts[moving], np.eye(len(shifts), dtype=np.float32)[:, moving]
    weights = components[:, :count]
    shapes = weights.T @ flat
    if count == most:
        _say_loss(flat, weights, shapes, len(moving))
    shapes, weights = _not_negative(shapes, weights, mean)
    return shapes.reshape(-1, *shifts.shape[1:]), weights


def _components(flat: Float32Array) -> Float32Array:
    """Return (T, T) orthonormal weights of the frames' components, the largest first."""
    # eigenvectors of the small matrix of products between frames, not of the large one of points
    products = (flat @ flat.T).astype(np.float64)
    return np.linalg.eigh(products)[1][:, ::-1].astype(np.float32)


def _fewest(flat: Float32Array, components: Float32Array, most: int) -> int:
    """Return how many components keep every point within the tolerance; `most` if none do."""
    low, high = 0, most
    while low < high:
        middle = (low + high) // 2
        weights = components[:, :middle]
        if _loss(flat, weights, weights.T @ flat)[0] <= _WORTH_SAYING:
            high = middle
        else:
            low = middle + 1
    return low


def _not_negative(
    shapes: Float32Array, weights: Float32Array, mean: Float32Array
) -> tuple[Float32Array, Float32Array]:
    """Return the same mixtures with weights from 0 to 1, the first of them 1 in every frame.

    Shape keys of Blender and blend shapes of engines take no other weights. The first shape is
    what all frames have in common: the mean, and each component at its lowest weight.
    """
    low, high = weights.min(axis=0), weights.max(axis=0)
    span = np.maximum(high - low, 1e-12)
    common = mean + low @ shapes
    mix = np.concatenate([np.ones((len(weights), 1)), (weights - low) / span], axis=1)
    return np.concatenate([common[None], span[:, None] * shapes]), mix.astype(np.float32)


def _loss(flat: Float32Array, weights: Float32Array, shapes: Float32Array) -> tuple[float, float]:
    """Return the largest and the root mean square distance of a point from the frames, metres."""
    worst = total = 0.0
    for row, weight in zip(flat, weights, strict=True):
        off = ((row - weight @ shapes).reshape(-1, 3) ** 2).sum(axis=1)
        worst, total = max(worst, float(off.max())), total + float(off.mean())
    return float(np.sqrt(worst)), float(np.sqrt(total / len(flat)))


def _say_loss(flat: Float32Array, weights: Float32Array, shapes: Float32Array, exact: int) -> None:
    worst, mean = _loss(flat, weights, shapes)
    if worst > _WORTH_SAYING:
        _log.warning(
            "%d frames in %d morph targets are off by %.2g mm, %.2g mm at most; more morphs=%d",
            len(flat),
            len(shapes) + 1,
            1000 * mean,
            1000 * worst,
            exact,
        )
