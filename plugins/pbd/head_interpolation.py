"""Interpolation between two rigid motions of the head."""

from __future__ import annotations

import math

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

_IDENTITY = np.eye(4)


def interpolate_motion(start: Float64Array, end: Float64Array, share: float) -> Float64Array:
    """Return the rigid motion at fraction `share` between `start` and `end`."""
    if share <= 0.0 or (start == end).all():
        return start
    if share >= 1.0:
        return end
    cross, angle = _screw(end[:3, :3] @ start[:3, :3].T)
    angle *= share
    turn = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    result = np.eye(4)
    result[:3, :3] = turn @ start[:3, :3]
    result[:3, 3] = (1 - share) * start[:3, 3] + share * end[:3, 3]
    return result


def motion_steps(
    start: Float64Array, end: Float64Array, count: int
) -> list[tuple[Float64Array, Float64Array]]:
    """Return the motion (4, 4) after each of `count` equal steps, and the change of axes of each.

    The latter transforms points from the axes before the step to those after it.
    """
    if (start == end).all():
        return [(end, _IDENTITY)] * count
    share = np.arange(count + 1)[:, None, None] / count
    heads = np.tile(_IDENTITY, (count + 1, 1, 1))
    cross, angle = _screw(end[:3, :3] @ start[:3, :3].T)
    # Rodrigues: 1 + sin K + (1 - cos) K K with K the axis' cross product
    turn = np.sin(share * angle) * cross + (1 - np.cos(share * angle)) * (cross @ cross)
    heads[:, :3, :3] = start[:3, :3] + turn @ start[:3, :3]
    heads[:, :3, 3] = start[:3, 3] + share[:, 0] * (end[:3, 3] - start[:3, 3])
    heads[0], heads[-1] = start, end
    back = heads[1:, :3, :3].swapaxes(1, 2)
    head_steps = np.tile(_IDENTITY, (count, 1, 1))
    head_steps[:, :3, :3] = back @ heads[:-1, :3, :3]
    head_steps[:, :3, 3:] = back @ (heads[:-1] - heads[1:])[:, :3, 3:]
    return list(zip(heads[1:], head_steps, strict=True))


def _screw(turn: Float64Array) -> tuple[Float64Array, float]:
    """Return the cross-product matrix (3, 3) of a rotation's axis, and the angle."""
    w, x, y, z = quaternion.from_matrix(turn).tolist()
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12:
        return np.zeros((3, 3)), 0.0
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / sine
    return cross, 2 * math.atan2(sine, w)


def inverse_motion(motion: Float64Array) -> Float64Array:
    """Return the inverse of a rigid motion (4, 4)."""
    result = np.eye(4)
    result[:3, :3] = motion[:3, :3].T
    result[:3, 3] = -motion[:3, :3].T @ motion[:3, 3]
    return result
