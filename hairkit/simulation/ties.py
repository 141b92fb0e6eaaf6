"""Ties as a constraint of simulators: hair between its root and its tie moves with the head."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.types.groom import Groom

REACH = 2.0
"""Radii of a ring within which a strand passes through it."""


def held_lengths(groom: Groom) -> Float64Array:
    """Return the way (S,) of every strand from its root to its tie, metres; 0 of loose strands.

    A strand is tied where one of its points lies within `REACH` radii of a ring's centre; what
    comes before the nearest such point is stretched over the head and moves with it.
    """
    strands = groom.strands
    held = np.zeros(len(strands))
    if not groom.ties or not len(strands):
        return held
    arc, starts = strands.arc_lengths(), strands.offsets[:-1]
    for tie in groom.ties:
        away = np.linalg.norm(strands.points - tie.centre, axis=1)
        nearest = np.minimum.reduceat(away, starts)
        at_ring = away == np.repeat(nearest, strands.counts)
        way = np.maximum.reduceat(np.where(at_ring, arc, 0), starts)
        held = np.where(nearest < REACH * tie.radius, np.maximum(held, way), held)
    return held
