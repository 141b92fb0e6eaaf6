"""PLY: vertices with thickness and colour, edges between them, and where each strand ends.

Binary little-endian. `element vertex` has x, y, z, thickness (the diameter) and an 8-bit sRGB
colour; `element edge` lets mesh programs show the strands; `element strand` with `nsegs`, as
hairutil writes it, parts them, with root uv, group and guide flag. Read: ascii and both binary
orders, with strands or with edges alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array
from hairkit.colour import linear_from_srgb, srgb_from_linear
from hairkit.errors import InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt, plain_widths
from hairkit.grooming.curve_sets import CurveSet, strands_of
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.byte_reader import finite
from hairkit.io.byte_writer import as_bytes
from hairkit.io.coordinate_space import FileSpace, SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.io.ply_elements import columns, read_elements, strand_order, vertex_points
from hairkit.storage import read_bytes, write_pieces
from hairkit.types.groom import Groom
from hairkit.types.strand_blocks import blocks, colours

FORMAT = FileFormat(
    "PLY",
    (".ply",),
    exact={
        Feature.POINTS,
        Feature.COUNTS,
        Feature.WIDTHS,
        Feature.ROOT_UV,
        Feature.GROUP,
        Feature.GUIDE,
    },
    partial={Feature.COLOUR: "8-bit sRGB", Feature.COLOURS: "8-bit sRGB"},
)

_MOST_SEGMENTS = 2**16 - 1
_VERTEX = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("thickness", "<f4")]
_COLOUR = [("red", "u1"), ("green", "u1"), ("blue", "u1")]
_EDGE = [("vertex1", "<i4"), ("vertex2", "<i4")]
_STRAND = [("nsegs", "<u2"), ("u", "<f4"), ("v", "<f4"), ("group", "<i4"), ("guide", "u1")]
_LINEAR = linear_from_srgb(np.arange(256) / 255.0)
"""Linear intensities of the 256 levels of sRGB."""
_NAMES = {"<f4": "float", "u1": "uchar", "<i4": "int", "<u2": "ushort"}


@dataclass(frozen=True)
class Options(ExportOptions, ImportOptions, SpaceOptions):
    """Settings of .ply files."""


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write vertices, edges and strands."""
    ready = prepare_export(groom, options).groom
    longest = ready.strands.counts.max()
    if longest > _MOST_SEGMENTS + 1:
        raise InputError(f"a strand has {longest} points, .ply holds {_MOST_SEGMENTS + 1} at most")
    write_pieces(path, _pieces(ready, options.space))
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read the strands, or put edges together to strands; a head is put under them."""
    elements = read_elements(read_bytes(path), path)
    points = finite(vertex_points(elements, path), path, "vertices")
    vertex = elements["vertex"]
    order, counts = strand_order(elements, len(points), path)
    widths, shades = None, None
    if "thickness" in vertex:
        widths = plain_widths(vertex["thickness"], options.space.metres, path)[order]
    if {name for name, _ in _COLOUR} <= set(vertex):
        stored = np.stack([vertex[name] for name, _ in _COLOUR], axis=1)[order]
        shades = _LINEAR[stored] if stored.dtype == np.uint8 else None
    curves = CurveSet(
        options.space.points_to_head(points[order]),
        counts,
        widths,
        colour=shades,
        **_strand_values(elements.get("strand", {}), path),
    )
    strands, _ = strands_of(curves, path)
    return adopt(strands, options, path)


def _pieces(groom: Groom, space: FileSpace) -> Iterator[bytes | memoryview]:
    """Yield the file's bytes: the header, then vertices, strands and edges."""
    strands = groom.strands
    yield _header(len(strands.points), len(strands)).encode("ascii")
    shades = colours(groom.material, strands).mapped(_to_bytes)
    for block in blocks(strands):
        points = space.points_to_file(strands.points[block.points])
        shade = shades.at(block.strands)
        vertex = np.empty(len(points), _VERTEX + _COLOUR)
        for column, name in enumerate("xyz"):
            vertex[name] = points[:, column]
        vertex["thickness"] = np.asarray(strands.widths)[block.points] / np.float32(space.metres)
        for column, (name, _) in enumerate(_COLOUR):
            vertex[name] = shade[:, column]
        yield as_bytes(vertex.dtype, vertex)
    strand = np.empty(len(strands), _STRAND)
    strand["nsegs"], strand["group"], strand["guide"] = (
        strands.counts - 1,
        strands.group,
        strands.guide,
    )
    strand["u"], strand["v"] = np.asarray(strands.root_uv).T
    yield as_bytes(strand.dtype, strand)
    for block in blocks(strands):
        number = np.arange(block.points.start, block.points.stop, dtype=np.int32)
        first = np.delete(number, strands.offsets[1:][block.strands] - 1 - block.points.start)
        yield as_bytes("<i4", np.stack([first, first + 1], axis=1))


def _header(points: int, strands: int) -> str:
    lines = ["ply", "format binary_little_endian 1.0", "comment hair strands, written by hairkit"]
    elements = [
        ("vertex", points, _VERTEX + _COLOUR),
        ("strand", strands, _STRAND),
        ("edge", points - strands, _EDGE),
    ]
    for name, rows, fields in elements:
        lines.append(f"element {name} {rows}")
        lines += [f"property {_NAMES[kind]} {field}" for field, kind in fields]
    return "\n".join([*lines, "end_header", ""])


def _strand_values(values: dict[str, npt.NDArray[np.generic]], path: Path) -> dict[str, Any]:
    """Return the root uv, groups and guide flags that the file has."""
    found: dict[str, Any] = {name: values.get(name) for name in ("group", "guide")}
    found["root_uv"] = columns(values, ("u", "v"))
    return {name: finite(held, path, name) for name, held in found.items() if held is not None}


def _to_bytes(colours: Float32Array) -> npt.NDArray[np.uint8]:
    """Return linear RGB as sRGB from 0 to 255."""
    return np.round(255 * srgb_from_linear(np.clip(colours, 0, 1))).astype(np.uint8)
