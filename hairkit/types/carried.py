"""What a file's format holds beyond a groom, carried along for files of the same format."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import UInt8Array, freeze
from hairkit.storage import Stored


@dataclass(frozen=True, eq=False)
class Carried(Stored):
    """A file as its reader found it, from which a writer of its format takes what it lacks."""

    format: str
    """Name of the format: `HairWorks`."""
    content: UInt8Array
    """(N,) bytes in the form that the format's plugin chose."""

    def __post_init__(self) -> None:
        freeze(self, "content", np.uint8, (None,), "carried content")
