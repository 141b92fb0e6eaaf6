"""Where on a head hair grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float32Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored


@dataclass(frozen=True, eq=False)
class Hairline(Stored):
    """Density of the hair on a head."""

    density: Float32Array
    """(V,) at each vertex, of that of full hair: 0 where nothing grows, up to 1."""

    def __post_init__(self) -> None:
        density = freeze(self, "density", np.float32, (None,), "hair density")
        if density.size and (density.min() < 0 or density.max() > 1):
            raise DataError("hair density lies outside [0, 1]")
