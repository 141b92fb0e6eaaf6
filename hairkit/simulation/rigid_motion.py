"""Rigid motions (4, 4) of the head within a step, and how the torso follows them.

Between two poses the head goes along a screw: it turns evenly about a fixed axis and slides along
it. A head that is turned about the neck thus keeps its pivot.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

NECK_REACH = math.radians(80)
"""Largest turn of the head against the torso, radians: an adult's to either side (American Academy
of Orthopaedic Surgeons, "Joint Motion", 1965). A head that turns farther takes the torso along."""
FARTHEST, WIDEST = 0.12, 1.2
"""Way of a root in a frame, metres, and turn, radians, from which the head is cut to its new place:
more than 7 m/s, 4,100 degrees a second."""
FINEST = 8
"""Times as many substeps as set that a fast head takes at most."""
SHORTEST_WAY = 1e-3
"""Metres that a root may go in a substep however short the hair is."""
_IDENTITY = np.eye(4)


def interpolate_motion(start: Float64Array, end: Float64Array, share: float) -> Float64Array:
    """Return the rigid motion at fraction `share` between `start` and `end`."""
    if share <= 0.0 or (start == end).all():
        return start
    return end if share >= 1.0 else _along_screw(start, end, np.array([share]))[0]


def motion_steps(
    start: Float64Array, end: Float64Array, count: int
) -> tuple[Float64Array, Float64Array]:
    """Return the motions (K, 4, 4) after each of `count` equal steps, and each's change of axes.

    The latter (K, 4, 4) transform points from the axes before a step to those after it.
    """
    changes = np.tile(_IDENTITY, (count, 1, 1))
    if (start == end).all():
        return np.tile(end, (count, 1, 1)), changes
    poses = _along_screw(start, end, np.arange(count + 1) / count)
    poses[0], poses[-1] = start, end
    back = poses[1:, :3, :3].swapaxes(1, 2)
    changes[:, :3, :3] = back @ poses[:-1, :3, :3]
    changes[:, :3, 3:] = back @ (poses[:-1] - poses[1:])[:, :3, 3:]
    return poses[1:], changes


def way_of_roots(start: Float64Array, end: Float64Array, roots: Float64Array) -> float:
    """Return metres that roots (S, 3), head axes, go at most in a frame from `start` to `end`.

    Infinite where that is so far that the head is cut to its new place, and hair goes with it.
    """
    if (start == end).all() or not len(roots):
        return 0.0
    change = end - start
    way = float(np.linalg.norm(roots @ change[:3, :3].T + change[:3, 3], axis=1).max())
    cosine = 0.5 * (float(np.trace(end[:3, :3] @ start[:3, :3].T)) - 1)
    return math.inf if way > FARTHEST or cosine < math.cos(WIDEST) else way


def finer_steps(
    start: Float64Array, end: Float64Array, roots: Float64Array, segment: float, substeps: int
) -> int:
    """Return how many times as many substeps a frame needs; 0 where the head is cut to its place.

    In a substep a root goes no farther than half of `segment`, a usual length between nodes in
    metres: beyond, the directions that lengths are linearised about are those of other segments.
    `roots` (S, 3) are in head axes, `substeps` those of a frame of a slow head.
    """
    way = way_of_roots(start, end, roots)
    if way == math.inf:
        return 0
    most = substeps * max(0.5 * segment, SHORTEST_WAY)
    return min(1 << math.ceil(math.log2(max(way / most, 1.0))), FINEST)


def inverse_motion(motion: Float64Array) -> Float64Array:
    """Return the inverses of rigid motions (..., 4, 4)."""
    result = np.zeros_like(motion)
    back = motion[..., :3, :3].swapaxes(-2, -1)
    result[..., :3, :3] = back
    result[..., :3, 3:] = -back @ motion[..., :3, 3:]
    result[..., 3, 3] = 1.0
    return result


def transform_points(motion: Any, points: Any) -> Any:
    """Return points (..., 3) under a rigid motion (4, 4), in their precision."""
    return points @ motion[:3, :3].T + motion[:3, 3]


def follow_head(torso: Float64Array, head: Float64Array, joint: Float64Array) -> Float64Array:
    """Return where the torso is once the head is at `head`: both (4, 4) motions since rest.

    The torso stays on the head's neck `joint` (3,), rest coordinates, and keeps its orientation
    until the head has turned against it by more than `NECK_REACH`.
    """
    result = torso.copy()
    cosine = 0.5 * (float((head[:3, :3] * torso[:3, :3]).sum()) - 1)
    if cosine < math.cos(NECK_REACH):
        old, new = (quaternion.from_matrix(motion[:3, :3]) for motion in (torso, head))
        share = 1 - NECK_REACH / math.acos(max(cosine, -1.0))
        result[:3, :3] = quaternion.to_matrix(quaternion.slerp(old, new, share))
    result[:3, 3] = head[:3, :3] @ joint + head[:3, 3] - result[:3, :3] @ joint
    return torso if np.abs(result - torso).max() <= 1e-12 else result


def _along_screw(start: Float64Array, end: Float64Array, share: Float64Array) -> Float64Array:
    """Return the motions (N, 4, 4) at fractions `share` (N,) of the way."""
    cross, angle = _axis_and_angle(end[:3, :3] @ start[:3, :3].T)
    share = share[:, None, None]
    turn = _rotation(cross, share * angle)
    result = np.tile(_IDENTITY, (len(share), 1, 1))
    result[:, :3, :3] = start[:3, :3] + turn @ start[:3, :3]
    # the origin's velocity less that of the turn is constant in the axes that turn
    way = end[:3, 3] - start[:3, 3]
    if angle == 0:
        result[:, :3, 3] = start[:3, 3] + share[:, 0] * way
        return result
    whole = np.ones((1, 1, 1))
    way = way - _rotation(cross, angle * whole)[0] @ start[:3, 3]
    velocity = np.linalg.solve(_integral(cross, angle, whole)[0], way)
    result[:, :3, 3] += (
        start[:3, 3] + turn @ start[:3, 3] + _integral(cross, angle, share) @ velocity
    )
    return result


def _rotation(cross: Float64Array, angle: Float64Array) -> Float64Array:
    """Return rotations (N, 3, 3) less the identity (Rodrigues), for angles (N, 1, 1)."""
    return np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


def _integral(cross: Float64Array, angle: float, share: Float64Array) -> Float64Array:
    """Return (N, 3, 3) the integral of the rotation over the fractions `share` (N, 1, 1)."""
    part = share * angle
    return (
        share * np.eye(3)
        + (1 - np.cos(part)) / angle * cross
        + (part - np.sin(part)) / angle * (cross @ cross)
    )


def _axis_and_angle(turn: Float64Array) -> tuple[Float64Array, float]:
    """Return the cross-product matrix (3, 3) of a rotation's axis, and the angle."""
    w, x, y, z = quaternion.from_matrix(turn).tolist()
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12:
        return np.zeros((3, 3)), 0.0
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / sine
    return cross, 2 * math.atan2(sine, w)
