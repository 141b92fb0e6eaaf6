"""Where the person is in a photo, as a probability."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from hairkit.arrays import UInt8Array, freeze
from hairkit.storage import Stored


@dataclass(frozen=True, eq=False)
class Person(Stored):
    """Probability of the person, hair and clothes included, in every pixel of one photo."""

    alpha: UInt8Array
    """(H, W) 0 for the background to 255 for the person; (0, 0) where nobody looked."""

    def __post_init__(self) -> None:
        freeze(self, "alpha", np.uint8, (None, None), "person alpha")

    @classmethod
    def absent(cls) -> Self:
        """Return what stands for a photo on which no model was run."""
        return cls(np.zeros((0, 0), np.uint8))
