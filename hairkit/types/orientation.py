"""2D strand orientation of a picture: the angle of the strand at every pixel and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored


@dataclass(frozen=True, eq=False)
class OrientationMap(Stored):
    """Undirected strand angles of one view; pixels without evidence have confidence 0."""

    angle: Float32Array
    """(H, W) radians in [0, pi), of the strand, from +x towards +y (image axes, y down)."""
    confidence: Float32Array
    """(H, W) in [0, 1], normalised per image."""

    def __post_init__(self) -> None:
        angle = freeze(self, "angle", np.float32, (None, None), "angle")
        confidence = freeze(self, "confidence", np.float32, angle.shape, "confidence")
        if angle.size and (angle.min() < 0 or angle.max() >= np.float32(np.pi)):
            raise DataError(f"angles lie in [{angle.min()}, {angle.max()}], expected [0, pi)")
        if confidence.size and (confidence.min() < 0 or confidence.max() > 1):
            raise DataError(
                f"confidences lie in [{confidence.min()}, {confidence.max()}], expected [0, 1]"
            )


def wrap_angle(angle: npt.ArrayLike) -> Float32Array:
    """Return undirected angles brought into [0, pi) as float32, never pi itself."""
    wrapped = np.mod(np.asarray(angle, np.float64), np.pi).astype(np.float32)
    wrapped[wrapped >= np.float32(np.pi)] = 0
    return wrapped


def angle_between(first: npt.ArrayLike, second: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return the angle in [0, pi/2] between undirected angles.

    >>> float(np.degrees(angle_between(np.radians(178.0), np.radians(3.0))).round(3))
    5.0
    """
    gap = np.mod(np.asarray(first, np.float64) - np.asarray(second, np.float64), np.pi)
    return np.minimum(gap, np.pi - gap)
