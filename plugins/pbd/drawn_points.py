"""The guides' own points: carried by the rods, at their own distances, out of the obstacles."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array, Int64Array

from .reference import TINY, Contact
from .resampling import Embedding

CHASE = 0.3
"""Share of the way back to the curve that a drawn point takes."""


def draw_points(embedding: Embedding, curve: Float64Array, contact: Contact | None) -> Float64Array:
    """Return the guides' points (P, 3), head axes, from the places that their rods carry them to.

    Each follows the curve at its own distance from the point before: it goes along the curve and a
    share `CHASE` of the way back to it. A point that lies deeper in an obstacle than it may is
    pushed out, twice, since its distance then moves it again.
    """
    place, starts = curve.copy(), embedding.starts[:-1]
    count, limited = np.diff(embedding.starts), contact is not None and not embedding.identity
    for k in range(1, int(count.max(initial=0))):
        i = starts[count > k] + k
        start, length = place[i - 1], embedding.length[i, None]
        place[i] = _along(start, curve[i] - curve[i - 1] + CHASE * (curve[i - 1] - start), length)
        for _ in range(2 if limited else 0):
            out = _way_out(place[i], contact, i)
            place[i] = np.where(
                out.any(axis=1, keepdims=True),
                _along(start, place[i] + out - start, length),
                place[i],
            )
    return place


def _along(start: Float64Array, way: Float64Array, length: Float64Array) -> Float64Array:
    """Return places at a distance from `start` along `way`."""
    size = np.sqrt((way * way).sum(axis=1, keepdims=True) + TINY)
    result: Float64Array = start + length / size * way
    return result


def _way_out(points: Float64Array, contact: Contact | None, which: Int64Array) -> Float64Array:
    """Return the way (N, 3) out of the obstacles of some points, 0 where they are outside."""
    if contact is None or contact.deepest is None:
        return np.zeros_like(points)
    distance, normal = contact.obstacles.at(points)
    depth = np.maximum(contact.deepest[which] - distance, 0.0)
    result: Float64Array = depth[:, None] * normal
    return result
