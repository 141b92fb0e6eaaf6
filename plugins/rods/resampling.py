"""Guides as rods, which all have as many nodes; what stiffness and head motion these can follow."""

from __future__ import annotations

import math

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.types.strands import Strands

SHORTEST = 0.015
"""Length, metres, of the straight rods that shorter guides are part of: between nodes that are much
less than a millimetre apart, what a head moves in a substep is more than a segment."""
LARGEST_TURN = 0.7
"""Largest angle between segments at rest, radians; beyond, the coupling to twist is stiff."""
_ROUNDS = 60
FIRMEST = 6e3
"""Largest bending stiffness, as EI / (rho A) h^2 / l^4 of segments of length l in substeps of h:
more has tones above 50 Hz, and float32 loses the lengths. Hair cut short is stiffer than that."""
FOLLOWED = 10.0
"""Bending of curled rods is stable in steps of h up to EI / (rho A) h^2 c^3 / l^4 of 10 to 20; here
l is a segment's length and c the turn from one to the next: measured on coils of 0.1 to 0.7. Their
natural turns follow the frames of the step before."""
FARTHEST, WIDEST = 0.12, 1.2
"""Way of a root in a frame, metres, and turn, radians, from which the head is cut to its new place:
more than 7 m/s, 4,100 degrees a second."""
SUBSTEPS, FINEST = 4, 8
"""Substeps of a frame that a root's way is compared with, and how many times as many there are at
most, for a fast head."""
SHORTEST_WAY = 1e-3
"""Metres that a root may go in a substep however short the hair is."""


def node_points(strands: Strands, nodes: int) -> Float64Array:
    """Return (S, n, 3) nodes at equal distances along the guides.

    If the turn at a node exceeds `LARGEST_TURN` (a fold, or curls finer than the nodes), the guide
    is smoothed; roots stay.
    """
    points = strands.resampled(nodes).points.reshape(len(strands), nodes, 3).astype(np.float64)
    for _ in range(_ROUNDS):
        sharp = _largest_turn(points) > LARGEST_TURN
        if not sharp.any():
            break
        some = points[sharp]
        some[:, 1:-1] = 0.25 * some[:, :-2] + 0.5 * some[:, 1:-1] + 0.25 * some[:, 2:]
        offsets = np.arange(len(some) + 1) * nodes
        even = Strands(some.reshape(-1, 3).astype(np.float32), offsets).resampled(nodes)
        points[sharp] = even.points.reshape(some.shape)
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    bad = (length.min(axis=1) < SHORTEST / nodes) | (_largest_turn(points) > LARGEST_TURN)
    if bad.any():
        step = np.maximum(length.mean(axis=1), SHORTEST / nodes)[bad, None, None]
        way = points[bad, -1] - points[bad, 0]
        way[np.linalg.norm(way, axis=1) < 1e-9] = [0.0, 1.0, 0.0]
        along = np.arange(nodes)[None, :, None] * step
        points[bad] = points[bad, :1] + along * quaternion.normalize(way)[:, None]
    return points


def max_stiffness(points: Float64Array, step: float) -> Float64Array:
    """Return the largest stable EI over mass per length (S,), m^4/s^2, for a time step.

    It limits short, stiff and sharply curled rods only; their lowest mode is far above visible
    motion of hair.
    """
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1).min(axis=1)
    curl = np.maximum(_largest_turn(points), 1e-3)
    result: Float64Array = np.minimum(FIRMEST, FOLLOWED / curl**3) * length**4 / step**2
    return result


def overhang(points: Float64Array) -> Float64Array:
    """Return the largest product along rods (S, n, 3) of lever and length squared (S,), m^3.

    At each node, what lies beyond it has a length, and its middle is off to the side, by the lever.
    """
    edge = np.diff(points, axis=1)
    length = np.linalg.norm(edge, axis=-1)
    level = 0.5 * (points[:, 1:] + points[:, :-1])[..., [0, 2]]
    beyond = np.cumsum(length[:, ::-1], axis=1)[:, ::-1]
    moment = np.cumsum((length[..., None] * level)[:, ::-1], axis=1)[:, ::-1]
    moment = moment - beyond[..., None] * points[:, :-1, [0, 2]]
    result: Float64Array = (np.linalg.norm(moment, axis=-1) * beyond).max(axis=1)
    return result


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


def _largest_turn(points: Float64Array) -> Float64Array:
    """Return the largest turn (S,) at a node, radians."""
    direction = quaternion.normalize(np.diff(points, axis=1))
    cosine = (direction[:, 1:] * direction[:, :-1]).sum(axis=-1)
    result: Float64Array = np.arccos(np.clip(cosine, -1.0, 1.0)).max(axis=1)
    return result
