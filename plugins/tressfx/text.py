"""The text .tfx of TressFX 1 and 2: a few settings, then each strand with its points, one a line.

version 2.0
scale 1.0
numStrands 93
strand 0 numVerts 16 texcoord 0.000000 000000
-2.28788 107.007 23.5948
"""

from __future__ import annotations

import logging
import os

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.io.number_text import read_numbers

from .binary import TfxHair

_SETTINGS = 64
_log = logging.getLogger("hairkit")


def is_text(data: bytes) -> bool:
    """Return whether a file's bytes begin as a text .tfx does."""
    return data[:64].lstrip().startswith(b"version")


def read_text(data: bytes, source: str | os.PathLike[str]) -> tuple[TfxHair, Int64Array]:
    """Return what the file holds, and the points (S,) of each strand.

    The settings `scale` and `translation` are applied, as TressFX does; `rotation` is not, and
    said where it is not zero. Follow hairs are not made.

    Raises
    ------
    FormatError
        It is damaged: strands or points are fewer or more than it says, or no numbers.
    """
    lines = data.decode("latin-1").split("\n")
    heads = [number for number, line in enumerate(lines) if line.startswith("strand")]
    if not heads:
        raise FormatError(f"{source}: holds no line that begins with 'strand'")
    settings = _settings(lines[: min(heads[0], _SETTINGS)], source)
    claimed = settings.get("numStrands")
    if claimed is not None and (claimed.size != 1 or claimed[0] != len(heads)):
        raise FormatError(f"{source}: numStrands differs from the {len(heads)} strands there are")
    counts, uv = _strand_lines([lines[number] for number in heads], source)
    is_head = np.zeros(len(lines), bool)
    is_head[: heads[0]] = True
    is_head[heads] = True
    rows = [line for line, head in zip(lines, is_head.tolist(), strict=True) if not head]
    points = read_numbers("\n".join(rows), source, "points")
    if len(points) != 3 * counts.sum():
        raise FormatError(
            f"{source}: holds {len(points)} coordinates, expected {3 * counts.sum()}, three for"
            " each point that its strands claim"
        )
    with np.errstate(over="ignore"):  # what is not finite is refused with the points
        placed = _place(points.reshape(-1, 3), settings, source).astype(np.float32)
    return TfxHair(placed, uv.astype(np.float32), None, None), counts


def _settings(lines: list[str], source: str | os.PathLike[str]) -> dict[str, Float64Array]:
    """Return the numbers of each setting before the first strand."""
    settings = {}
    for line in lines:
        name, _, value = line.strip().partition(" ")
        if value and not name.startswith("is"):
            settings[name] = read_numbers(value, source, f"setting {name[:32]!r}")
    return settings


def _strand_lines(
    lines: list[str], source: str | os.PathLike[str]
) -> tuple[Int64Array, Float64Array]:
    """Return points (S,) and texture coordinates (S, 2) of `strand I numVerts N texcoord U V`."""
    words = " ".join(lines).split()
    if len(words) != 7 * len(lines) or any(
        set(words[place::7]) != {word}
        for place, word in ((0, "strand"), (2, "numVerts"), (4, "texcoord"))
    ):
        raise FormatError(f"{source}: a line is not 'strand I numVerts N texcoord U V'")
    numbers = read_numbers(" ".join(words[3::7]), source, "numVerts")
    if (numbers < 0).any() or (numbers != np.round(numbers)).any() or (numbers > 2**31).any():
        raise FormatError(f"{source}: numVerts holds {numbers.min():g} to {numbers.max():g}")
    u, v = (read_numbers(" ".join(words[place::7]), source, "texcoord") for place in (5, 6))
    return numbers.astype(np.int64), np.stack([u, v], axis=1)


def _place(
    points: Float64Array, settings: dict[str, Float64Array], source: str | os.PathLike[str]
) -> Float64Array:
    """Return the points scaled and moved as the settings say."""
    scale, move = settings.get("scale", np.ones(1)), settings.get("translation", np.zeros(3))
    if scale.size != 1 or move.size != 3 or not scale[0] > 0:
        raise FormatError(f"{source}: scale is not one number above 0, or translation not three")
    if settings.get("rotation", np.zeros(3)).any():
        _log.warning("%s: its rotation is not applied", source)
    return np.asarray(points * scale[0] + move)
