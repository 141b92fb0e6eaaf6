"""Waves of the hair, as the photos show them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.storage import Stored


@dataclass(frozen=True)
class Waves(Stored):
    """Helix parameters of the whole head's hair; radius 0 means straight hair."""

    radius: float = 0.0
    """Radius of the helix about its axis, metres."""
    pitch: float = 0.0
    """Length of one turn along the axis, metres."""
    slant: float = 0.0
    """Mean slant of the visible strands in the pictures, radians; 0 when hair turns both ways."""

    @property
    def handedness(self) -> int:
        """1 or -1 when all hair turns one way, 0 when it turns both ways or not at all."""
        return int(np.sign(self.slant))
