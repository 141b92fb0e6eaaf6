"""Ties: where hair is gathered into a ponytail, pigtails, a bun or a braid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from hairkit.arrays import Float32Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored
from hairkit.types.head import Head

TieKind = Literal["tail", "braid", "bun"]
ON_TOP = 0.02
"""Ties less than this far below the top of the head, metres, are on top."""
LONGEST_UNIT_ERROR = 1e-3
"""Deviation of an axis' length from 1 that rounding in files may cause."""


@dataclass(frozen=True, eq=False)
class Tie(Stored):
    """A ring that holds strands together: a constraint for simulators and exporters."""

    centre: Float32Array
    """(3,) metres, head frame; it moves with the head."""
    axis: Float32Array
    """(3,) unit vector along the hair, away from the head."""
    radius: float
    """Of the bundle in the ring, metres."""
    kind: str
    """What hangs from it: `tail`, `braid` or `bun`."""

    def __post_init__(self) -> None:
        freeze(self, "centre", np.float32, (3,), "centre")
        freeze(self, "axis", np.float32, (3,), "axis")
        if abs(float(np.linalg.norm(self.axis)) - 1) > LONGEST_UNIT_ERROR:
            raise DataError(f"the axis of a tie is {self.axis}, expected a unit vector")
        if not 0 < self.radius < np.inf:
            raise DataError(f"radius of a tie is {self.radius}, expected metres above 0")
        if self.kind not in get_args(TieKind):
            raise DataError(f"kind of a tie is {self.kind!r}, expected {get_args(TieKind)}")

    def place(self, head: Head) -> str:
        """Return what it is and where: `tail at the back, 9 cm above the nape`."""
        x, y, z = self.centre.tolist()
        behind = head.vertices[(head.scalp > 0.5) & (head.vertices[:, 2] < 0)]
        above = 100 * (y - float(behind[:, 1].min()))
        top = float(head.vertices[:, 1].max())
        if abs(x) > max(-z, 0.0):
            side = "left" if x > 0 else "right"
        else:
            side = "top" if y > top - ON_TOP else "back"
        where = "on" if side == "top" else "at"
        return f"{self.kind} {where} the {side}, {above:.0f} cm above the nape"


@dataclass(frozen=True, eq=False)
class Tail(Stored):
    """The bundle that hangs from a tie, as a tube of elliptic sections."""

    tie: Tie
    sureness: float
    """0 to 1, of the weakest sign that hair is tied here."""
    spine: Float32Array
    """(M, 3) centres of the sections from the tie to the end, evenly spaced, metres."""
    spokes: Float32Array
    """(M, 2, 3) conjugate half diameters of each section, metres."""
    share: Float32Array
    """(M,) share of the strands that reach each section, 1 at the tie, never rising."""
    crossing: float = 0.0
    """Angle between hair and spine of a braid, radians; 0 where the hair runs along the spine."""

    def __post_init__(self) -> None:
        spine = freeze(self, "spine", np.float32, (None, 3), "spine of a tail")
        count = len(spine)
        freeze(self, "spokes", np.float32, (count, 2, 3), "spokes of a tail")
        freeze(self, "share", np.float32, (count,), "share of a tail")
        if count < 2:
            raise DataError(f"a tail has {count} sections, expected two or more")


@dataclass(frozen=True, eq=False)
class LooseHair(Stored):
    """Connected hair beside a tie that does not run to it: a fringe, or a wisp."""

    cells: Float32Array
    """(K, 4) centres of its cells and their ways through it from its root end, metres."""
    share: float
    """Share of the strands that hang in it."""

    def __post_init__(self) -> None:
        cells = freeze(self, "cells", np.float32, (None, 4), "cells of loose hair")
        if not len(cells):
            raise DataError("loose hair has no cells")


@dataclass(frozen=True, eq=False)
class TiedHair(Stored):
    """The ties that the photos and the hull show; none of hair that is not tied."""

    tails: tuple[Tail, ...] = ()
    """The largest first."""
    loose: tuple[LooseHair, ...] = ()
    """Hair that hangs over bare skin, in any order."""
