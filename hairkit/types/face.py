"""The face that a detector found in a photo."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hairkit.arrays import Float64Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored
from hairkit.types.head import LANDMARKS

SURE_PRESENCE, SURE_YAW_DEG = 0.95, 55.0
"""Least presence and largest yaw of a face to be relied on: four of 18 rendered profiles were found
as faces with presence 0.87 to 1.00 and yaw 39 to 62 degrees instead of 82 to 96."""
OBLIQUE_YAW_DEG, STEEP_YAW_DEG = 40.0, 47.0
"""Yaws from which a face may be seen from farther aside, and from which its landmarks are surely
off by 5 mm and more. Faces seen from 50 degrees were found with yaws of 41, from 62 to 69 with 44
to 52, as were some from 41 to 49; profiles with 39 to 62."""


@dataclass(frozen=True, eq=False)
class Face(Stored):
    """Landmarks and direction of the face in one photo."""

    presence: float
    """0 where there is no face, up to 1 where there surely is one."""
    landmarks: Float64Array
    """(68, 2) iBUG points in pixels of the photo as the view holds it."""
    noise_px: Float64Array
    """(68,) standard deviation of each, pixels; 0 where unknown."""
    yaw_deg: float
    """Azimuth from which the head is seen: 0 in front, positive from the subject's left."""
    pitch_deg: float
    """Elevation from which the head is seen: positive from above."""
    roll_deg: float
    """Clockwise turn of the head in the upright photo."""
    quarter_turns: int = 0
    """Clockwise quarter turns of the photo that bring the face upright, 0 to 3."""

    def __post_init__(self) -> None:
        freeze(self, "landmarks", np.float64, (LANDMARKS, 2), "face landmarks")
        freeze(self, "noise_px", np.float64, (LANDMARKS,), "face noise_px")
        if not 0 <= self.presence <= 1:
            raise DataError(f"face presence is {self.presence}, expected 0 to 1")
        if self.quarter_turns not in range(4):
            raise DataError(f"face quarter_turns is {self.quarter_turns}, expected 0 to 3")
        if (self.noise_px < 0).any():
            raise DataError("face noise_px is negative, expected standard deviations")

    @property
    def sure(self) -> bool:
        """True for faces whose landmarks and direction can be relied on.

        Detectors mistake some profiles for oblique faces, with high presence.
        """
        return self.presence >= SURE_PRESENCE and abs(self.yaw_deg) <= SURE_YAW_DEG

    @classmethod
    def absent(cls) -> Self:
        """Return what stands for a photo without a face."""
        return cls(0.0, np.zeros((LANDMARKS, 2)), np.zeros(LANDMARKS), 0.0, 0.0, 0.0)

    def turned(self, quarter_turns: int, width: int, height: int) -> Self:
        """Return the face in the photo of `width` x `height` after clockwise quarter turns."""
        points = turn_points(self.landmarks, quarter_turns, width, height)
        left = (self.quarter_turns - quarter_turns) % 4
        return replace(self, landmarks=points, quarter_turns=left)


def turn_points(points: Float64Array, quarter_turns: int, width: int, height: int) -> Float64Array:
    """Return pixels (N, 2) of a picture of `width` x `height` after clockwise quarter turns."""
    x, y = np.asarray(points, np.float64).T
    for _ in range(quarter_turns % 4):
        x, y = height - y, x
        width, height = height, width
    return np.stack([x, y], axis=1)
