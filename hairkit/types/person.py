"""Where the person is in a photo, and where the hair, as probabilities."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from hairkit.arrays import UInt8Array, freeze
from hairkit.errors import InputError
from hairkit.storage import Stored


def _nothing() -> UInt8Array:
    return np.zeros((0, 0), np.uint8)


@dataclass(frozen=True, eq=False)
class Person(Stored):
    """Probability of the person, hair and clothes included, in every pixel of one photo."""

    alpha: UInt8Array
    """(H, W) 0 for the background to 255 for the person; (0, 0) where nobody looked."""
    hair: UInt8Array = field(default_factory=_nothing)
    """(H, W) 0 to 255 for the person's hair; (0, 0) where nobody tells it from the rest."""

    def __post_init__(self) -> None:
        for name in ("alpha", "hair"):
            freeze(self, name, np.uint8, (None, None), f"person {name}")
        if self.hair.size and self.hair.shape != self.alpha.shape:
            raise InputError(f"person hair: {self.hair.shape}, expected {self.alpha.shape}")

    @classmethod
    def absent(cls) -> Self:
        """Return what stands for a photo on which no model was run."""
        return cls(_nothing())

    def part(self, place: Any) -> Self:
        """Return what is known of a part of the photo, by an index of NumPy."""
        return type(self)(self.alpha[place], self.hair[place] if self.hair.size else self.hair)

    def turned(self, quarter_turns: int) -> Self:
        """Return what is known of the photo after clockwise quarter turns."""
        return type(self)(np.rot90(self.alpha, -quarter_turns), np.rot90(self.hair, -quarter_turns))
