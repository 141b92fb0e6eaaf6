"""Interpolation between two rigid motions of the head."""

from __future__ import annotations

import math

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

FARTHEST, WIDEST = 0.12, 1.2
"""Way of a root in a frame, metres, and turn, radians, from which the head is cut to its new place:
more than 7 m/s, 4,100 degrees a second."""
SUBSTEPS, FINEST = 4, 8
"""Substeps of a frame that a root's way is compared with, and how many times as many there are at
most, for a fast head."""
SHORTEST_WAY = 1e-3
"""Metres that a root may go in a substep however short the hair is."""
_IDENTITY = np.eye(4)


def finer_steps(start: Float64Array, end: Float64Array, roots: Float64Array, segment: float) -> int:
    """Return how many times as many substeps a frame needs; 0 where the head is cut to its place.

    In a substep a root goes no farther than half of `segment`, a usual length between nodes in
    metres: beyond, the directions that lengths are linearised about are those of other segments.
    `roots` (S, 3) are in head axes.
    """
    if (start == end).all() or not len(roots):
        return 1
    change = end - start
    way = float(np.linalg.norm(roots @ change[:3, :3].T + change[:3, 3], axis=1).max())
    cosine = 0.5 * (float(np.trace(end[:3, :3] @ start[:3, :3].T)) - 1)
    if way > FARTHEST or cosine < math.cos(WIDEST):
        return 0
    most = SUBSTEPS * max(0.5 * segment, SHORTEST_WAY)
    return min(1 << math.ceil(math.log2(max(way / most, 1.0))), FINEST)


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
