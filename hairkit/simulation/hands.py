"""Hands that grab points: they go to the targets of grabs at a limited speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.simulation.simulator import Grab


class Hands:
    """Hands on their way to the targets of grabs."""

    def __init__(self) -> None:
        self.places: dict[int, Float64Array] = {}
        """Where the hand of each held point is, (3,) metres, world."""

    def move(self, grabs: Sequence[Grab], points: Callable[[], Float32Array], most: float) -> None:
        """Move hands by up to `most` metres; a new one starts at its point (P, 3), world."""
        places = {}
        for grab in grabs:
            start = self.places.get(grab.point)
            start = points()[grab.point].astype(np.float64) if start is None else start
            way = np.asarray(grab.target, np.float64) - start
            size = max(float(np.linalg.norm(way)), 1e-12)
            places[grab.point] = start + min(1.0, most / size) * way
        self.places = places
