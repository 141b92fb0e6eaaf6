"""The binary .tfx of TressFX 4 and 3: a header with the place of each array."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Int64Array
from hairkit.io.byte_reader import ByteReader, finite

HEADER = np.dtype(
    [
        ("version", "<f4"),
        ("strands", "<u4"),
        ("points", "<u4"),
        ("position", "<u4"),
        ("strand_uv", "<u4"),
        ("point_uv", "<u4"),
        ("thickness", "<u4"),
        ("colour", "<u4"),
        ("reserved", "<u4", 32),
    ]
)
"""160 bytes; `points` is of each strand, what follows it is where arrays begin, 0 for none."""

OLD_HEADER = np.dtype(
    [
        ("version", "<f4"),
        ("strands", "<u4"),
        ("points", "<u4"),
        ("followers", "<u4"),
        ("both_ends_fixed", "<u4"),
        ("reserved", "<u4", 31),
        ("position", "<u4"),
        ("thickness", "<u4"),
        ("strand_uv", "<u4"),
        ("colour", "<u4"),
        ("guides", "<u4"),
        ("point_uv", "<u4"),
        ("reserved_too", "<u4", 32),
    ]
)
"""296 bytes of TressFX 3 (`TressFXFileObject`); positions are three numbers, not four."""

VERSION, OLD_VERSION = 4.0, 3.0


@dataclass(frozen=True, eq=False)
class TfxHair:
    """Content of a .tfx file, in its own unit and axes."""

    points: Float32Array
    """(S, N, 3), or (P, 3) where strands differ."""
    uv: Float32Array | None
    """(S, 2) texture coordinates of the roots."""
    thickness: Float32Array | None
    """(S,) one width a strand."""
    colours: Float32Array | None
    """(S, N, 3) linear RGB."""


def read_binary(reader: ByteReader) -> tuple[TfxHair, Int64Array]:
    """Return what the file holds, and the points (S,) of each strand.

    Raises
    ------
    FormatError
        It is no .tfx of version 3 or 4, an array goes beyond its end, or a number is not finite.
    """
    version = float(reader.array("<f4", 1, "the version")[0])
    reader.seek(0, "the header")
    if version not in (OLD_VERSION, VERSION):
        raise reader.error(f"the version is {version:g}, expected {OLD_VERSION:g} or {VERSION:g}")
    header = reader.array(HEADER if version == VERSION else OLD_HEADER, 1, "the header")[0]
    size = int(header["strands"]), int(header["points"])
    if min(size) < 1:
        raise reader.error(f"{size[0]} strands of {size[1]} points")
    points = _array(reader, header, "position", (*size, 4 if version == VERSION else 3))
    if points is None:
        raise reader.error("the positions are left out")
    colours = _array(reader, header, "colour", (*size, 4))
    hair = TfxHair(
        points[..., :3],
        _array(reader, header, "strand_uv", (size[0], 2)),
        _array(reader, header, "thickness", (size[0],)),
        None if colours is None else colours[..., :3],
    )
    return hair, np.full(size[0], size[1], np.int64)


def _array(reader: ByteReader, header: Any, name: str, shape: tuple[int, ...]) -> Any:
    """Return the array that starts where the header says, None where it says 0."""
    if header[name] == 0:
        return None
    reader.seek(int(header[name]), name)
    return finite(reader.array("<f4", shape, name), reader.source, name)
