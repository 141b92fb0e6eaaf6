"""Wavefront OBJ lines: the strands' points, for any modelling program.

Each strand is one `l` element over its vertices. Files whose lines are single edges, as Blender
writes them, are read too: edges that share vertices are put together.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.grooming.adopt_strands import ImportOptions, adopt, pack_strands
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.coordinate_space import FileSpace, SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.io.number_text import format_rows, read_numbers
from hairkit.io.polylines import chains
from hairkit.storage import read_bytes, write_pieces
from hairkit.types.groom import Groom
from hairkit.types.strand_blocks import blocks
from hairkit.types.strands import Strands

FORMAT = FileFormat("OBJ lines", (".obj",), exact={Feature.POINTS, Feature.COUNTS})


@dataclass(frozen=True)
class Options(ExportOptions, ImportOptions, SpaceOptions):
    """Settings of .obj files."""


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the strands as lines."""
    write_pieces(path, _pieces(prepare_export(groom, options).groom.strands, options.space))
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read all lines as strands; faces are passed over, and a head is put under the strands."""
    vertices, lines, before = _elements(
        read_bytes(path).removeprefix(codecs.BOM_UTF8).decode("latin-1")
    )
    if not lines:
        raise FormatError(f"{path}: holds no lines ('l' elements), so no strands")
    points = _points(vertices, path)
    index, counts = _line_indices(lines, before, len(points), path)
    if (counts == 2).all():
        try:
            index, counts = chains(index.reshape(-1, 2), len(points))
        except FormatError as error:
            raise FormatError(f"{path}: {error}") from error
    strands, _ = pack_strands(options.space.points_to_head(points[index]), counts, path)
    return adopt(strands, options, path)


def _pieces(strands: Strands, space: FileSpace) -> Iterator[bytes]:
    """Yield the vertices, then an `l` element for each strand, vertices counted from 1."""
    yield b"# hair strands, written by hairkit\n"
    for block in blocks(strands):
        points = space.points_to_file(strands.points[block.points])
        yield format_rows(b"v %.9g %.9g %.9g\n", points)
    for block in blocks(strands):
        ends = strands.offsets[block.strands.start : block.strands.stop + 1] + 1
        lines = (" ".join(map(str, range(*pair))) for pair in pairwise(ends.tolist()))
        yield "".join(f"l {line}\n" for line in lines).encode("ascii")


def _elements(text: str) -> tuple[list[str], list[str], list[int]]:
    """Return what follows `v` and `l`, and how many vertices stand before each `l`."""
    vertices: list[str] = []
    lines: list[str] = []
    before: list[int] = []
    for line in text.replace("\\\n", " ").split("\n"):
        if line.startswith("v "):
            vertices.append(line[2:])
        elif line.startswith("l "):
            lines.append(line[2:])
            before.append(len(vertices))
    return vertices, lines, before


def _points(vertices: list[str], path: Path) -> Float64Array:
    """Return (P, 3) the vertices' places; a weight or colour behind them is passed over."""
    numbers = read_numbers("\n".join(vertices), path, "vertices")
    if not vertices or len(numbers) % len(vertices) or len(numbers) < 3 * len(vertices):
        raise FormatError(f"{path}: {len(vertices)} vertices have {len(numbers)} coordinates")
    return numbers.reshape(len(vertices), -1)[:, :3]


def _line_indices(
    lines: list[str], before: list[int], vertices: int, path: Path
) -> tuple[Int64Array, Int64Array]:
    """Return vertex numbers from 0 of all lines, and how many each line has.

    Negative numbers count back from the line; what follows a slash is a texture coordinate.
    """
    if any("/" in line for line in lines):
        lines = [" ".join(word.partition("/")[0] for word in line.split()) for line in lines]
    counts = np.array([len(line.split()) for line in lines], np.int64)
    numbers = read_numbers("\n".join(lines), path, "lines")
    if len(numbers) != counts.sum() or (numbers != np.round(numbers)).any():
        raise FormatError(f"{path}: lines hold something that is no vertex number")
    last = np.repeat(np.array(before), counts)
    index = np.where(numbers < 0, last + numbers, numbers - 1)
    if (index < 0).any() or (index >= vertices).any() or (numbers == 0).any():
        raise FormatError(f"{path}: lines name vertices outside 1 to {vertices}")
    return index.astype(np.int64), counts
