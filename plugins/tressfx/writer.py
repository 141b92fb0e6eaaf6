"""The binary .tfx of TressFX 4, piece by piece: arrays stand in the header's order."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.head_model.skinning import HEAD_JOINT, JOINT_NAMES
from hairkit.io.byte_writer import as_bytes, join_bytes
from hairkit.io.coordinate_space import FileSpace
from hairkit.types.groom import Groom
from hairkit.types.strand_blocks import blocks, colours

from .binary import HEADER, VERSION

FIXED = 2
"""Points at the root that do not move."""
INFLUENCES = 4
STRAND = np.dtype([("strand", "<i4"), ("pairs", [("bone", "<i4"), ("weight", "<f4")], INFLUENCES)])


def tfx_pieces(
    groom: Groom, count: int, space: FileSpace, uv: Float32Array, *, coloured: bool
) -> Iterator[memoryview]:
    """Yield the file's bytes.

    Parameters
    ----------
    groom
        Its strands have `count` points each, and widths.
    space
        The file's axes and unit.
    uv
        (S, 2) texture coordinates of the roots, as they stand in the file.
    coloured
        Also write a colour at every point.
    """
    strands = groom.strands
    yield as_bytes(HEADER, _header(len(strands), count, coloured=coloured))
    for block in blocks(strands):
        points = space.points_to_file(strands.points[block.points])
        place = np.ones((len(points) // count, count, 4), np.float32)
        for column in range(3):  # long columns are copied faster than rows of three
            place.reshape(-1, 4)[:, column] = points[:, column]
        place[:, :FIXED, 3] = 0.0
        yield as_bytes("<f4", place)
    yield as_bytes("<f4", uv)
    widths = np.asarray(strands.widths).reshape(-1, count).mean(axis=1, dtype=np.float64)
    yield as_bytes("<f4", (widths / space.metres).astype(np.float32))
    yield as_bytes("<f4", np.zeros(_padding(len(strands))))
    if coloured:
        alpha = ((0, 0), (0, 1))
        shades = colours(groom.material, strands).mapped(
            lambda linear: np.pad(linear, alpha, constant_values=1)
        )
        for block in blocks(strands):
            yield as_bytes("<f4", shades.at(block.strands))


def _header(
    strands: int, count: int, *, coloured: bool
) -> np.ndarray[tuple[()], np.dtype[np.void]]:
    """Return the header; arrays begin at multiples of eight bytes."""
    header = np.zeros((), HEADER)
    header["version"], header["strands"], header["points"] = VERSION, strands, count
    header["position"] = HEADER.itemsize
    header["strand_uv"] = header["position"] + 16 * strands * count
    header["thickness"] = header["strand_uv"] + 8 * strands
    if coloured:
        header["colour"] = header["thickness"] + 4 * (strands + _padding(strands))
    return header


def _padding(numbers: int) -> int:
    """Return the numbers of four bytes that fill up eight."""
    return numbers % 2


def bone_bytes(strands: int) -> memoryview:
    """Return the whole .tfxbone: the joints' names, and every strand carried by the head alone."""
    names = struct.pack("<i", len(JOINT_NAMES))
    for index, name in enumerate(JOINT_NAMES):
        text = name.encode("ascii") + b"\0"
        names += struct.pack("<ii", index, len(text)) + text
    rows = np.zeros(strands, STRAND)
    rows["strand"] = np.arange(strands)
    rows["pairs"]["bone"][:, 0] = HEAD_JOINT
    rows["pairs"]["weight"][:, 0] = 1.0
    head = names + struct.pack("<i", strands)
    return join_bytes([("u1", np.frombuffer(head, np.uint8)), (STRAND, rows)])
