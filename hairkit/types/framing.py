"""Which way is up in each photo of a capture, and the part of it that holds the head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float64Array, Int64Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored


@dataclass(frozen=True, eq=False)
class Framing(Stored):
    """How the photos of a capture are turned and cropped, in the order they were read."""

    quarter_turns: Int64Array
    """(V,) clockwise quarter turns that bring each photo upright, 0 to 3."""
    frames: Int64Array
    """(V, 4) left, top, right and bottom edge of what is kept of the upright photo on disk, its
    pixels."""
    heads: Float64Array
    """(V, 2) the middle of the head in that photo, its pixels; of the photo where it is whole."""

    def __post_init__(self) -> None:
        turns = freeze(self, "quarter_turns", np.int64, (None,), "framing quarter_turns")
        frames = freeze(self, "frames", np.int64, (len(turns), 4), "framing frames")
        freeze(self, "heads", np.float64, (len(turns), 2), "framing heads")
        if not np.isin(turns, range(4)).all():
            raise DataError("framing quarter_turns holds other values than 0 to 3")
        if (frames < 0).any() or not (frames[:, 2:] > frames[:, :2]).all():
            raise DataError("framing holds a frame without pixels")
