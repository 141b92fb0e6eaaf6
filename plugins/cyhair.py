"""cyHair .hair: points, thickness and colour per point, for any number of strands.

Cem Yuksel's hair model format (cyHairFile.h): a header of 128 bytes, then segments a strand (u16),
points (3 f32), thickness (f32), transparency (f32) and colours (3 f32) a point, each where a bit of
the header says so, little-endian. Files of the wild also spell the signature in lower case.
Thickness is taken as the strand's diameter in the file's unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Int64Array
from hairkit.errors import InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt, mean_look, plain_widths
from hairkit.grooming.curve_sets import CurveSet, strands_of
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.byte_reader import ByteReader, finite
from hairkit.io.byte_writer import as_bytes
from hairkit.io.coordinate_space import FileSpace, SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.options import option
from hairkit.storage import read_bytes, write_pieces
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.strand_blocks import blocks, colours
from hairkit.types.strands import Strands

FORMAT = FileFormat(
    "cyHair",
    (".hair",),
    exact={Feature.POINTS, Feature.COUNTS, Feature.WIDTHS, Feature.COLOUR, Feature.COLOURS},
)

SIGNATURES = (b"HAIR", b"hair")
SEGMENTS, POINTS, THICKNESS, TRANSPARENCY, COLOURS = 1, 2, 4, 8, 16
HEADER = np.dtype(
    [
        ("signature", "S4"),
        ("strands", "<u4"),
        ("points", "<u4"),
        ("arrays", "<u4"),
        ("segments", "<u4"),
        ("thickness", "<f4"),
        ("transparency", "<f4"),
        ("colour", "<f4", 3),
        ("info", "S88"),
    ]
)
"""The 128 bytes at the start; the numbers after `arrays` hold where an array is left out."""

_MOST_SEGMENTS = 2**16 - 1
_WIDEST = 2e-3
_INFO = b"written by hairkit"


@dataclass(frozen=True)
class Options(ExportOptions, ImportOptions, SpaceOptions):
    """Settings of .hair files."""

    colours: bool = option(True, doc="Write a colour at every point, not one for all.")


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the strands with their thickness, and their colours if asked for."""
    ready = prepare_export(groom, options).groom
    longest = ready.strands.counts.max()
    if longest > _MOST_SEGMENTS + 1:
        raise InputError(f"a strand has {longest} points, .hair holds {_MOST_SEGMENTS + 1} at most")
    write_pieces(path, _pieces(ready, options))
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read the strands; a head is put under them."""
    reader = ByteReader(read_bytes(path), path)
    header = _header(reader)
    counts = _counts(reader, header)
    total, arrays = int(header["points"]), int(header["arrays"])
    space = options.space
    points = finite(reader.array("<f4", (total, 3), "points"), path, "points")
    widths = reader.array("<f4", total, "thickness") if arrays & THICKNESS else None
    if arrays & TRANSPARENCY:
        reader.array("<f4", total, "transparency")
    colours = reader.array("<f4", (total, 3), "colours") if arrays & COLOURS else None
    if widths is not None:
        widths = plain_widths(widths, space.metres, path)
    if colours is not None:
        colours = finite(colours, path, "colours")
    curves = CurveSet(space.points_to_head(points), counts, widths, colour=colours)
    strands, _ = strands_of(curves, path)
    return adopt(strands, options, path, _material(header, strands, space))


def _pieces(groom: Groom, options: Options) -> Iterator[memoryview]:
    """Yield the file's bytes: the header, then one array after the other."""
    strands, space, look = groom.strands, options.space, groom.material
    header = np.zeros((), HEADER)
    header["signature"], header["info"] = SIGNATURES[0], _INFO
    header["strands"], header["points"] = len(strands), len(strands.points)
    header["arrays"] = SEGMENTS | POINTS | THICKNESS | (COLOURS if options.colours else 0)
    header["thickness"] = look.width / space.metres
    header["colour"] = (look.root_colour.astype(np.float64) + look.tip_colour) / 2
    yield as_bytes(HEADER, header)
    yield as_bytes("<u2", strands.counts - 1)
    for block in blocks(strands):
        yield as_bytes("<f4", space.points_to_file(strands.points[block.points]))
    for block in blocks(strands):
        widths = np.asarray(strands.widths)[block.points]
        yield as_bytes("<f4", widths / np.float32(space.metres))
    if options.colours:
        shades = colours(look, strands)
        for block in blocks(strands):
            yield as_bytes("<f4", shades.at(block.strands))


def _header(reader: ByteReader) -> Any:
    header = reader.array(HEADER, 1, "the header")[0]
    if header["signature"] not in SIGNATURES:
        raise reader.error("the signature is not HAIR")
    if not header["arrays"] & POINTS:
        raise reader.error("the points are left out")
    return header


def _counts(reader: ByteReader, header: Any) -> Int64Array:
    """Return the points (S,) of each strand, which are as many as the file says in all."""
    strands, total = int(header["strands"]), int(header["points"])
    counts: Int64Array = np.zeros(0, np.int64)
    if header["arrays"] & SEGMENTS:
        counts = reader.array("<u2", strands, "segments").astype(np.int64) + 1
    elif strands * (int(header["segments"]) + 1) == total:
        counts = np.full(strands, int(header["segments"]) + 1, np.int64)
    if int(counts.sum()) != total:
        raise reader.error(f"{strands} strands have {counts.sum()} points, the header says {total}")
    return counts


def _material(header: Any, strands: Strands, space: FileSpace) -> HairMaterial:
    """Return the look; the header's thickness of 1 and white colour mean that they were not set."""
    width = float(header["thickness"]) * space.metres
    if not 0 < width <= _WIDEST:
        known = strands.widths[strands.widths > 0] if strands.widths is not None else ()
        width = float(np.mean(known, dtype=np.float64)) if len(known) else HairMaterial.width
    if strands.colours is not None:
        return replace(mean_look(strands), width=width)
    colour = np.asarray(header["colour"], np.float32)
    if np.isfinite(colour).all() and (colour >= 0).all() and (colour < 1).any():
        return HairMaterial(colour, colour, width)
    return HairMaterial(width=width)
