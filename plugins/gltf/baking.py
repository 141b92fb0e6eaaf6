"""A point cache as morph targets: few shapes whose mixture is the motion.

The shapes are the principal components of the frames (Alexa and Mueller, Representing Animations
by Principal Components, 2000), about the shape at rest and in the frame of the moving head.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.types.point_cache import PointCache

_STILL = 1e-7
_WORTH_SAYING = 1e-4

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
    """(T, M) of the shapes; the largest of each shape is 1."""


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
        As many as frames, or more: the frames themselves are the shapes.
    deform
        False leaves the hair rigid on the head: no shapes.
    """
    times = cache.times[::step]
    motion = cache.head_from_rest[::step]
    shapes, weights = np.zeros((0, *rest.shape), np.float32), np.zeros((len(times), 0), np.float32)
    if deform:
        shifts = _shifts(cache.points[::step], motion, rest)
        shapes, weights = _principal(shifts, morphs)
    return Baked((times - times[0]).astype(np.float32), motion, shapes, weights)


def _shifts(points: Float32Array, motion: Float64Array, rest: Float32Array) -> Float32Array:
    """Return (T, P, 3) shifts from rest as the head sees them."""
    shifts = np.empty(points.shape, np.float32)
    for frame, world_from_head in enumerate(motion):
        turn, place = world_from_head[:3, :3], world_from_head[:3, 3]
        # a rigid motion's inverse is its transpose; row vectors take it from the right
        shifts[frame] = (points[frame] - place) @ np.linalg.inv(turn).T - rest
    return shifts


def _principal(shifts: Float32Array, morphs: int) -> tuple[Float32Array, Float32Array]:
    """Return shapes (M, P, 3) and weights (T, M) whose product is nearest to the shifts."""
    flat = shifts.reshape(len(shifts), -1)
    moving = np.flatnonzero(np.abs(flat).max(axis=1) > _STILL)
    if len(moving) <= morphs:
        return shifts[moving], np.eye(len(shifts), dtype=np.float32)[:, moving]
    # eigenvectors of the small matrix of products between frames, not of the large one of points
    products = (flat @ flat.T).astype(np.float64)
    weights = np.linalg.eigh(products)[1][:, ::-1][:, :morphs]
    largest = np.abs(weights).argmax(axis=0)
    scale = weights[largest, np.arange(weights.shape[1])]
    shapes = ((weights * scale).T.astype(np.float32) @ flat).reshape(-1, *shifts.shape[1:])
    mix = (weights / scale).astype(np.float32)
    _say_loss(flat, mix, shapes.reshape(len(shapes), -1))
    return shapes, mix


def _say_loss(flat: Float32Array, mix: Float32Array, shapes: Float32Array) -> None:
    worst = total = 0.0
    for row, weight in zip(flat, mix, strict=True):
        off = ((row - weight @ shapes).reshape(-1, 3) ** 2).sum(axis=1)
        worst, total = max(worst, float(off.max())), total + float(off.mean())
    if np.sqrt(worst) > _WORTH_SAYING:
        _log.warning(
            "%d frames in %d morph targets are off by %.2g mm, %.2g mm at most; more morphs=%d",
            len(flat),
            len(shapes),
            1000 * np.sqrt(total / len(flat)),
            1000 * np.sqrt(worst),
            len(flat),
        )
