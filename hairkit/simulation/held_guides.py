"""What holds guides in their captured shape, for simulators: skin, hair around them, and ties."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.types.groom import Groom

RING = 2.0
"""Radii of a ring within which a strand passes through it."""
MIDDLE_PULL = 40.0
"""1/s: angular frequency of the pull to the captured shape at a stiffness of 0.5, 6 Hz."""
UNREACHED = 1.001
"""Stiffness at which that pull would be infinite: just above the largest, 1."""
HELD = 4e4
"""1/s^2: squared frequency, of 32 Hz, at which hair before its tie is pulled to the head."""
REACH = 0.04
"""Length from the root over which hair is pulled to its captured shape, metres: there skin and the
hair around hold it."""
STANDING = 2.5
"""Squared frequency, in g / L, of the pull that bears hair which stands or lies out, since other
hair is beneath it: a column that carries its own weight buckles by pi^2 / 4 of it at most. Hair
that hangs needs none."""


def pull_to_captured(
    points: Float64Array, length: Float64Array, stiffness: float, gravity: float, held: Float64Array
) -> Float64Array:
    """Return the squared frequency (S, n) of the pull to the captured shape, 1/s^2.

    Parameters
    ----------
    points, length
        (S, n, 3) nodes at rest and (S, n - 1) lengths between them, metres.
    stiffness
        0 to 1.
    gravity
        m/s^2, of which hair that stands or lies out is borne.
    held
        (S,) share of the length before a tie, see `held_lengths`.
    """
    arc = np.pad(np.cumsum(length, axis=1), ((0, 0), (1, 0)))
    total = arc[:, -1:]
    root = (MIDDLE_PULL * stiffness / (UNREACHED - stiffness)) ** 2
    pull = root * np.maximum(1 - arc / REACH, 0.0) ** 2
    falls = (points[:, :1, 1] - points[:, -1:, 1]) / total
    pull += STANDING * np.clip(1 - falls, 0.0, 1.0) * gravity / total
    return np.where(arc / total < held[:, None], HELD, pull)


def borne_masses(
    points: Float64Array, length: Float64Array, mass: Float64Array, held: Float64Array
) -> Float64Array:
    """Return the mass (S, n) whose weight hair beneath or the head bears at each node at rest, kg.

    Where a strand lies, what is beneath bears it and what hangs from it; a tied one is not borne.
    """
    falls = np.pad(-np.diff(points[..., 1], axis=1) / length, ((0, 0), (1, 1)), "edge")
    lies = np.clip(1 - 0.5 * (falls[:, 1:] + falls[:, :-1]), 0.0, 1.0) * (held == 0)[:, None]
    borne, hanging = np.zeros_like(mass), np.zeros(len(mass))
    for node in range(mass.shape[1] - 1, 0, -1):
        hanging = hanging + mass[:, node]
        borne[:, node] = lies[:, node] * hanging
        hanging = hanging - borne[:, node]
    return borne


def held_lengths(groom: Groom) -> Float64Array:
    """Return the way (S,) of every strand from its root to its tie, metres; 0 of loose strands.

    A strand is tied where one of its points lies within `RING` radii of a ring's centre; what
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
        held = np.where(nearest < RING * tie.radius, np.maximum(held, way), held)
    return held
