"""What an artist changed by hand: strokes of brushes over strands, in the head's frame."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, freeze
from hairkit.colour import linear_from_hex
from hairkit.errors import DataError, FormatError, InputError
from hairkit.options import make_options, option
from hairkit.storage import Stored, read_bytes, write_text
from hairkit.types.strands import PLANTED

MOST_BYTES = 2**24
"""Of a file of edits: some thousand strokes."""
MOST_STROKES, MOST_POINTS = 1000, 10_000
"""Of a head, and of the path of one stroke."""
GROUPS = ("hair", *PLANTED)
"""Hair of the head, and what brushes plant on the face."""


@dataclass(frozen=True)
class Brush:
    """A brush and its settings; each has its own `amount`, see `hairkit.grooming.brushes`."""

    brush: str = option("comb", doc="Name of the brush.")
    radius: float = option(0.03, low=0.001, high=0.1, unit="m", doc="Radius of its ball.")
    amount: float | None = option(
        None, low=0, high=1, doc="How much it does; by default the brush's own."
    )
    pitch: float = option(
        0.03, low=0.002, high=0.5, unit="m", doc="Length of one turn of what it curls."
    )
    group: str = option(
        GROUPS[0], choices=GROUPS, doc="The hair that it acts on: of the head, or planted."
    )
    colour: str = option("#7a4a2a", doc="What it dyes hair with, sRGB as #rrggbb.")
    mirror: bool = option(False, doc="Do the same on the other side of the head.")

    def __post_init__(self) -> None:
        linear_from_hex(self.colour, "colour")


@dataclass(frozen=True, eq=False)
class Edit(Stored):
    """One stroke of a brush."""

    path: Float32Array
    """(N, 3) where the brush went, metres, head frame; an empty one reaches all hair."""
    setting: Brush

    def __post_init__(self) -> None:
        if not len(self.path):
            object.__setattr__(self, "path", np.zeros((0, 3)))
        path = freeze(self, "path", np.float32, (None, 3), "path of a stroke")
        if len(path) > MOST_POINTS or not np.isfinite(path).all():
            raise DataError(f"path of a stroke: expected at most {MOST_POINTS} finite points")


@dataclass(frozen=True, eq=False)
class Edits(Stored):
    """All strokes, in the order in which they were drawn."""

    strokes: tuple[Edit, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.strokes)

    @classmethod
    def of(cls, values: Any, where: str) -> Edits:
        """Return the strokes of a list of objects, as `values` returns them.

        Raises `InputError`, which says `where` and which stroke is wrong.
        """
        if not (isinstance(values, list) and len(values) <= MOST_STROKES):
            raise InputError(f"{where}: expected a list of at most {MOST_STROKES} strokes")
        return cls(tuple(_edit(each, f"{where}: stroke {k + 1}") for k, each in enumerate(values)))

    def values(self) -> list[dict[str, Any]]:
        """Return the strokes for JSON, paths to a hundredth of a millimetre."""
        return [
            {**asdict(edit.setting), "path": np.round(edit.path.astype(float), 5).tolist()}
            for edit in self.strokes
        ]

    def write(self, path: Path) -> None:
        """Write the file that `read_edits` reads."""
        write_text(path, json.dumps({"strokes": self.values()}) + "\n")


def read_edits(path: Path) -> Edits:
    """Return the strokes of a JSON file, `{"strokes": [...]}`; none where there is no file."""
    if not path.is_file():
        return Edits()
    try:
        strokes = json.loads(read_bytes(path, MOST_BYTES))["strokes"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FormatError(f'{path}: expected JSON {{"strokes": [...]}} ({error})') from error
    return Edits.of(strokes, str(path))


def _edit(values: Any, where: str) -> Edit:
    if not isinstance(values, dict):
        raise InputError(f"{where}: expected an object with brush and path")
    rest = {name: value for name, value in values.items() if name != "path"}
    try:
        path = np.array(values.get("path", []), np.float32).reshape(-1, 3)
        return Edit(path, make_options(Brush, rest, where))
    except (ValueError, TypeError, OverflowError, DataError) as error:
        raise InputError(f"{where}: the path is no list of points [x, y, z] ({error})") from error
