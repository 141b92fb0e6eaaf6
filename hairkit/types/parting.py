"""The parting of the hair, as the photos show it or as the user says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self, get_args

import numpy as np

from hairkit.arrays import Float64Array, freeze
from hairkit.errors import DataError, InputError
from hairkit.options import unknown_name
from hairkit.storage import Stored

PartingWord = Literal["left", "right", "middle", "none", "back"]
"""Side of the subject, or no parting, or all hair combed back."""
LINE_FRONT, LINE_BACK = 0.09, -0.06
"""Ends along z, head frame, of a parting whose length is not given, metres."""
SIDE = 0.03
"""Distance of a side parting from the middle, metres; 2.5 to 3.3 cm on heads that have one."""


@dataclass(frozen=True, eq=False)
class Parting(Stored):
    """How hair on the crown is combed: to both sides of a line, back, as the views see it, or as
    the hull suggests; and in front over the forehead, or not.
    """

    line: Float64Array | None = None
    """(N, 2) points x (towards the subject's left) and z (to the front) of the parting, metres in
    the head frame, N at least 2; None without a parting."""
    swept_back: bool = False
    """True when all hair on the crown is combed back."""
    fringe: bool = False
    """True when the hair in front is combed forward over the forehead."""
    places: Float64Array | None = None
    """(M, 3) places of the hair on the crown, metres, at which the views see its directions; None
    where a line or the user tells more, or the views do not agree."""
    directions: Float64Array | None = None
    """(M, 3) unit tangents of the hair there, root to tip."""
    sureness: float = 1.0
    """How well the views' directions agree with this, 0 to 1; 1 where skin or the user says it."""
    skin_share: float = 0.0
    """Share of the crown that the views see as skin; 0 where no parting shows."""
    spread: float = 0.0
    """Width in metres of the middle half of that skin; 0 where the user says it all."""
    source: str = "photos"
    """Who says so: `photos`, `stroke`, `capture.toml` or `option`."""

    def __post_init__(self) -> None:
        line = freeze(self, "line", np.float64, (None, 2), "line of the parting")
        if line is not None and len(line) < 2:
            raise DataError(f"a parting of {len(line)} points, expected at least 2")
        if (self.places is None) != (self.directions is None):
            raise DataError("a comb has places and directions, or neither")
        places = freeze(self, "places", np.float64, (None, 3), "places of the comb")
        if places is not None:
            freeze(self, "directions", np.float64, places.shape, "directions of the comb")

    @classmethod
    def at(cls, x: float, skin_share: float = 0.0, spread: float = 0.0) -> Self:
        """Return a parting from front to back at `x` metres towards the subject's left."""
        line = np.array([[x, LINE_FRONT], [x, LINE_BACK]])
        return cls(line, skin_share=skin_share, spread=spread)

    @classmethod
    def named(cls, word: str, source: str = "option") -> Self:
        """Return the parting of a word; `InputError` names the words."""
        if word not in get_args(PartingWord):
            raise InputError(unknown_name("parting", word, get_args(PartingWord)))
        if word in ("none", "back"):
            return cls(swept_back=word == "back", source=source)
        x = {"left": SIDE, "middle": 0.0, "right": -SIDE}[word]
        return cls(np.array([[x, LINE_FRONT], [x, LINE_BACK]]), source=source)

    @property
    def seen(self) -> bool:
        """True when hair is combed to both sides of a line."""
        return self.line is not None

    @property
    def x(self) -> float:
        """Mean place of the line towards the subject's left, metres; 0 without one."""
        return 0.0 if self.line is None else float(self.line[:, 0].mean())

    @property
    def known(self) -> bool:
        """True when it is known how the crown is combed."""
        return self.seen or self.swept_back or self.fringe or self.places is not None

    @property
    def summary(self) -> str:
        """One line for the log.

        >>> Parting.at(0.03, spread=0.012).summary
        'parting 30 mm left of the middle, the skin there 12 mm wide (photos)'
        >>> Parting(fringe=True, sureness=0.7).summary
        'no parting, fringe, sureness 0.70 (photos)'
        """
        how = "combed back" if self.swept_back else "no parting"
        if self.line is not None:
            side = "left" if self.x > 0 else "right"
            how = f"parting {1000 * abs(self.x):.0f} mm {side} of the middle"
        elif self.places is not None:
            how = "no parting, crown combed as the views see it"
        width = f", the skin there {1000 * self.spread:.0f} mm wide" if self.spread else ""
        sure = f", sureness {self.sureness:.2f}" if self.sureness < 1 else ""
        return f"{how}{width}{', fringe' if self.fringe else ''}{sure} ({self.source})"
