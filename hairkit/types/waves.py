"""Waves of the hair, as the photos show them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.storage import Stored

CURLY_SLOPE = 1.1
"""Slope of helices from which 2D orientations do not tell the axis: their mean doubled angle falls
from 1 for straight hair through 0 at a slope of 1.5."""
COIL_RADIUS = 0.0055
"""Radius of the widest tight coils, metres: those of type 4 hair are 2 to 5 mm."""


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
    def slope(self) -> float:
        """Slope of the helix against its axis: 2 pi radius over pitch."""
        return 2 * np.pi * self.radius / self.pitch if self.pitch > 0 else 0.0

    @property
    def curly(self) -> bool:
        """True for coils so steep that photos show no strand direction, only the coils."""
        return self.slope >= CURLY_SLOPE

    @property
    def coiled(self) -> bool:
        """True for curls so tight that hair stands off the scalp instead of hanging.

        >>> Waves(0.004, 0.011).coiled, Waves(0.0068, 0.027).coiled
        (True, False)
        """
        return self.curly and self.radius <= COIL_RADIUS

    @property
    def handedness(self) -> int:
        """1 or -1 when all hair turns one way, 0 when it turns both ways or not at all."""
        return int(np.sign(self.slant))
