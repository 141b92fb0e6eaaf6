"""Held points: their nodes are pulled to the hand as hair is to its captured shape."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.simulation import Grab
from hairkit.simulation.rigid_motion import transform_points

from .embedding import Embedding
from .rods import Rods

FIRM = 4e5
"""1/s^2: squared frequency, of 100 Hz, of the pull to a hand: a strand's weight moves it 0.3 mm."""
TAUT = 0.999
"""Largest distance of a hand from the root, as a share of the strand's length."""


class Hands:
    """Hands on their way to the targets of grabs."""

    def __init__(self) -> None:
        self._places: dict[int, Float64Array] = {}

    @property
    def held(self) -> tuple[int, ...]:
        """The held points."""
        return tuple(self._places)

    def move(
        self, grabs: tuple[Grab, ...], points: Callable[[], Float32Array], most: float
    ) -> None:
        """Move hands by up to `most` metres; a new one starts at its point (P, 3), world."""
        places = {}
        for grab in grabs:
            start = self._places.get(grab.point)
            start = points()[grab.point].astype(np.float64) if start is None else start
            way = np.asarray(grab.target, np.float64) - start
            size = max(float(np.linalg.norm(way)), 1e-12)
            places[grab.point] = start + min(1.0, most / size) * way
        self._places = places

    def force(self, rods: Rods, embedding: Embedding, back: Float64Array) -> Float64Array | None:
        """Return the force (S, n, 3) that makes hands, not rest, the ends of the pulls, newtons.

        `back` (4, 4) transforms the world to the head axes. A hand that the strand does not reach
        pulls to the nearest point that it does.
        """
        if not self._places:
            return None
        force = np.zeros_like(rods.points)
        rod, node = held_nodes(embedding, self.held)
        root = rods.points[rod, 0]
        away = transform_points(back, np.array([*self._places.values()])) - root
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
