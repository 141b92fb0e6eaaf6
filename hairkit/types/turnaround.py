"""From where each photo of a capture was taken, as the photos themselves tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float64Array, Int64Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored

RING_DEG = 35.0
"""Photos from higher than this are no part of the ring around the head."""


@dataclass(frozen=True, eq=False)
class Turnaround(Stored):
    """Azimuth and elevation of every photo, in the order they were read."""

    order: Int64Array
    """(V,) indices of the photos in the order of the turn: the frontal one first, then towards the
    subject's left; photos from above last."""
    azimuth_deg: Float64Array
    """(V,) azimuth of each camera."""
    elevation_deg: Float64Array
    """(V,) elevation of each camera, positive from above."""
    names: tuple[str, ...]
    """Name of the view that each photo shows."""
    margin: float
    """By how much the next best arrangement fits worse; 1 is a tie, inf where none was tried."""
    summary: str
    """One line for the user."""
    doubts: tuple[str, ...] = ()
    """What is uncertain, each in a few words; also part of the summary."""

    def __post_init__(self) -> None:
        count = len(self.names)
        freeze(self, "order", np.int64, (count,), "turn order")
        for name in ("azimuth_deg", "elevation_deg"):
            freeze(self, name, np.float64, (count,), f"turn {name}")
        if not np.array_equal(np.sort(self.order), np.arange(count)):
            raise DataError(f"turn order is {self.order.tolist()}, expected each photo once")
        if (np.abs(self.elevation_deg) > 90).any():
            raise DataError("turn elevation_deg is beyond 90 degrees")
        if len(set(self.names)) != count:
            raise DataError("turn names two photos alike")

    @property
    def largest_step_deg(self) -> float:
        """Return the largest angle between neighbours of the ring around the head, degrees."""
        ring = np.sort(self.azimuth_deg[self.elevation_deg <= RING_DEG] % 360.0)
        return float(np.diff(ring, append=ring[:1] + 360.0).max(initial=0.0))
