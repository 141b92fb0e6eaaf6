"""From where each photo of a capture was taken, as the photos themselves tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int64Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored

RING_DEG = 35.0
"""Photos from higher than this are no part of the ring around the head."""
ELSEWHERE_DEG, ELSEWHERE_STEPS = 30.0, (0.5, 0.75)
"""A photo has another place where its azimuth differs by more degrees than this, and than the first
share of an even step, or by more than the second."""


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
    """One line for the user, without margin and doubts."""
    doubts: tuple[str, ...] = ()
    """What is uncertain, each in a few words."""
    others: tuple[Turnaround, ...] = ()
    """Other arrangements that the photos fit nearly as well, the likeliest first, until cameras
    tell which is right. Their margins say by how much each fits worse than this one."""

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
    def above(self) -> BoolArray:
        """Return which photos (V,) are from above."""
        return np.asarray(self.elevation_deg > RING_DEG)

    def line(self) -> str:
        """Return the summary with margin and doubts."""
        margin = (f"margin {self.margin:.2f}",) if np.isfinite(self.margin) else ()
        return "; ".join((self.summary, *margin, *self.doubts))

    @property
    def largest_step_deg(self) -> float:
        """Return the largest angle between neighbours of the ring around the head, degrees."""
        ring = np.sort(self.azimuth_deg[~self.above] % 360.0)
        return float(np.diff(ring, append=ring[:1] + 360.0).max(initial=0.0))


def moved_photos(
    azimuth_deg: Float64Array, above: BoolArray, other_deg: Float64Array, other_above: BoolArray
) -> BoolArray:
    """Return which photos (V,) have another place in another arrangement.

    >>> here, level = np.array([0.0, 90.0, 180.0, 270.0]), np.zeros(4, bool)
    >>> moved_photos(here, level, np.array([10.0, 180.0, 90.0, -90.0]), level).tolist()
    [False, True, True, False]
    """
    low, high = np.multiply(ELSEWHERE_STEPS, 360.0 / np.count_nonzero(~above))
    least = np.clip(ELSEWHERE_DEG, low, high)
    away = np.abs((azimuth_deg - other_deg + 180.0) % 360.0 - 180.0) > least
    return np.asarray((away & ~above & ~other_above) | (above != other_above))
