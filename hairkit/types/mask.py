"""Label images: hair, the rest of the person, background."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import BoolArray, UInt8Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored

HAIR, PERSON, BACKGROUND = 255, 128, 0


@dataclass(frozen=True, eq=False)
class Mask(Stored):
    """Labels of one view: 255 hair, 128 the rest of the person, 0 background."""

    labels: UInt8Array
    """(H, W), only the three label values."""
    person_known: bool
    """False when nobody said where the person is: then 0 means only "not hair"."""
    alpha: UInt8Array | None = None
    """(H, W) opacity of the hair, 255 where it covers a pixel wholly; None where unknown."""

    def __post_init__(self) -> None:
        labels = freeze(self, "labels", np.uint8, (None, None), "mask labels")
        known = (labels == BACKGROUND) | (labels == PERSON) | (labels == HAIR)
        if not known.all():
            stray = labels[~known].min()
            raise DataError(f"mask holds the value {stray}, expected only 0, 128 and 255")
        if not (labels == HAIR).any():
            raise DataError("mask is empty: no pixel is marked as hair (255)")
        freeze(self, "alpha", np.uint8, labels.shape, "mask alpha")

    @property
    def hair(self) -> BoolArray:
        """(H, W) true where hair is."""
        return np.asarray(self.labels == HAIR)

    @property
    def person(self) -> BoolArray:
        """(H, W) true where the person is, hair included."""
        return np.asarray(self.labels != BACKGROUND)


@dataclass(frozen=True, eq=False)
class Masks(Stored):
    """The masks of all views, in their order."""

    views: tuple[Mask, ...]
