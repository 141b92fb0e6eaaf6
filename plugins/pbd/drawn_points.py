"""The guides' own points: carried by the rods, at their own distances, out of the obstacles."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation.obstacle_kernels import NO_FIELDS, Drawn, Fields, draw_points

from .reference import Contact
from .resampling import Embedding


def draw_curve(
    embedding: Embedding,
    curve: Float64Array,
    contact: Contact | None,
    torso_from_head: Float64Array,
) -> Float64Array:
    """Return the guides' points (P, 3), head axes, from the places that their rods carry them to.

    See `hairkit.simulation.obstacle_kernels.draw_points`.
    """
    place = curve.copy()
    parallel_for(
        draw_points,
        len(embedding.starts) - 1,
        *drawing(embedding, contact),
        torso_from_head,
        place,
    )
    return place


def drawing(embedding: Embedding, contact: Contact | None) -> tuple[Drawn, Fields]:
    """Return points and obstacles as `draw_points` takes them."""
    deepest = np.zeros(0) if contact is None or contact.deepest is None else contact.deepest
    fields = NO_FIELDS if contact is None else contact.bodies.fields
    return Drawn(embedding.starts, embedding.length, deepest), fields
