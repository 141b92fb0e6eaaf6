"""What stiffness rods can follow."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation.embedding import largest_turn

FIRMEST = 6e3
"""Largest bending stiffness, as EI / (rho A) h^2 / l^4 of segments of length l in substeps of h:
more has tones above 50 Hz, and float32 loses the lengths. Hair cut short is stiffer than that."""
FOLLOWED = 10.0
"""Bending of curled rods is stable in steps of h up to EI / (rho A) h^2 c^3 / l^4 of 10 to 20; here
l is a segment's length and c the turn from one to the next: measured on coils of 0.1 to 0.7. Their
natural turns follow the frames of the step before."""


def max_stiffness(points: Float64Array, step: float) -> Float64Array:
    """Return the largest stable EI over mass per length (S,), m^4/s^2, for a time step.

    It limits short, stiff and sharply curled rods only; their lowest mode is far above visible
    motion of hair.
    """
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1).min(axis=1)
    curl = np.maximum(largest_turn(points), 1e-3)
    return np.asarray(np.minimum(FIRMEST, FOLLOWED / curl**3) * length**4 / step**2)


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
    return np.asarray((np.linalg.norm(moment, axis=-1) * beyond).max(axis=1))
