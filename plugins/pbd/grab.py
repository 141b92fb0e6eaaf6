"""Held points: their nodes are pulled to the hand as hair is to its captured shape."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.simulation.rigid_motion import transform_points

from .embedding import Embedding
from .rods import Rods

FIRM = 4e5
"""1/s^2: squared frequency, of 100 Hz, of the pull to a hand: a strand's weight moves it 0.3 mm."""
TAUT = 0.999
"""Largest distance of a hand from the root, as a share of the strand's length."""


def hold_nodes(
    rods: Rods, embedding: Embedding, hands: dict[int, Float64Array], back: Float64Array
) -> Float64Array | None:
    """Return the force (S, n, 3) that makes hands, not rest, the ends of pulls, newtons.

    `hands` are the places (3,) of those that hold points, world, and `back` (4, 4) transforms the
    world to the head axes. A hand that the strand does not reach pulls to the nearest point that it
    does.
    """
    if not hands:
        return None
    force = np.zeros_like(rods.points)
    rod, node = held_nodes(embedding, tuple(hands))
    root = rods.points[rod, 0]
    away = transform_points(back, np.array([*hands.values()])) - root
    reach = TAUT * np.cumsum(rods.length, axis=1)[rod, node - 1]
    away *= np.minimum(1.0, reach / np.maximum(np.linalg.norm(away, axis=1), 1e-12))[:, None]
    pull = FIRM * rods.mass[rod, node, None] * (root + away - rods.points[rod, node])
    np.add.at(force, (rod, node), pull)
    return force


def held_nodes(embedding: Embedding, held: tuple[int, ...]) -> tuple[Int64Array, Int64Array]:
    """Return rod and node (G,) nearest to the held points; roots are not held."""
    index = np.array(held, np.int64)
    node = embedding.segment[index] + (embedding.share[index] >= 0.5)
    return embedding.rod[index], np.maximum(node, 1)
