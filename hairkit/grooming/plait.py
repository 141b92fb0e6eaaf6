"""The course of strands in the section of a tail: straight on, or plaited as a braid of three.

The three bundles of a braid follow one another on a figure of eight across the section, a third of
a period apart. Its pitch is that at which they cross the spine at the measured angle.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.types.tie import Tail

BUNDLES = 3
SIDE, DEPTH = 0.55, 0.35
"""Half width and half depth of the figure of eight, in half diameters of the section."""
THIN = 0.45
"""Radius of a bundle, in half diameters of the section."""


def plait(u: float, v: float, tail: Tail) -> Float64Array:
    """Return where (M, 2) a strand runs in the sections of a tail, in their half diameters.

    It passes the ring at u, v in the unit disc; there the angle tells its bundle.
    """
    ring = np.array([u, v])
    if not tail.crossing:
        return np.broadcast_to(ring, (len(tail.spine), 2))
    bundle = int((np.arctan2(v, u) / (2 * np.pi) + 0.5) * BUNDLES) % BUNDLES
    steps = np.linalg.norm(np.diff(tail.spine, axis=0), axis=1)
    wide = np.linalg.norm(tail.spokes[:, 0], axis=1).astype(np.float64)
    # a bundle at x = a sin(phase) goes sideways by a d(phase) / sqrt 2 in the mean square
    turn = np.sqrt(2) * np.tan(tail.crossing) / (SIDE * np.maximum(wide, 1e-6))
    phase = np.append(0, np.cumsum(steps * turn[1:])) + 2 * np.pi * bundle / BUNDLES
    middle = np.stack([SIDE * np.sin(phase), DEPTH * np.sin(2 * phase)], axis=1)
    result: Float64Array = middle + THIN * ring
    return result
