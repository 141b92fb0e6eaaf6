"""What stiffness and head motion rods can follow."""

from __future__ import annotations

import math

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation.embedding import largest_turn
from hairkit.simulation.rigid_motion import way_of_roots

FIRMEST = 6e3
"""Largest bending stiffness, as EI / (rho A) h^2 / l^4 of segments of length l in substeps of h:
more has tones above 50 Hz, and float32 loses the lengths. Hair cut short is stiffer than that."""
FOLLOWED = 10.0
"""Bending of curled rods is stable in steps of h up to EI / (rho A) h^2 c^3 / l^4 of 10 to 20; here
l is a segment's length and c the turn from one to the next: measured on coils of 0.1 to 0.7. Their
natural turns follow the frames of the step before."""
SUBSTEPS, FINEST = 4, 8
"""Substeps of a frame that a root's way is compared with, and how many times as many there are at
most, for a fast head."""
SHORTEST_WAY = 1e-3
"""Metres that a root may go in a substep however short the hair is."""


def max_stiffness(points: Float64Array, step: float) -> Float64Array:
    """Return the largest stable EI over mass per length (S,), m^4/s^2, for a time step.

    It limits short, stiff and sharply curled rods only; their lowest mode is far above visible
    motion of hair.
    """
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1).min(axis=1)
    curl = np.maximum(largest_turn(points), 1e-3)
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
    way = way_of_roots(start, end, roots)
    if way == math.inf:
        return 0
    most = SUBSTEPS * max(0.5 * segment, SHORTEST_WAY)
    return min(1 << math.ceil(math.log2(max(way / most, 1.0))), FINEST)
