"""USC-HairSalon .data: bare strands of any number of points, and CT2Hair's .bin.

Hair datasets (USC-HairSalon, Hair Photobooth): the number of strands (i32), then for each strand
its number of points (i32) and the points (3 f32), little-endian. A .bin of CT2Hair has seven f32 a
point, of which the first three are the place; the rest is written as zeros.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Int64Array
from hairkit.grooming.adopt_strands import ImportOptions, adopt, pack_strands
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.byte_reader import ByteReader, finite
from hairkit.io.byte_writer import as_bytes
from hairkit.io.coordinate_space import FileSpace, SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.storage import read_bytes, write_pieces
from hairkit.types.groom import Groom
from hairkit.types.strand_blocks import blocks
from hairkit.types.strands import Strands

FORMAT = FileFormat(
    "USC-HairSalon, CT2Hair", (".data", ".bin"), exact={Feature.POINTS, Feature.COUNTS}
)


@dataclass(frozen=True)
class Options(ExportOptions, ImportOptions, SpaceOptions):
    """Settings of .data and .bin files."""


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the strands' points."""
    strands = prepare_export(groom, options).groom.strands
    write_pieces(path, _pieces(strands, options.space, _numbers_a_point(path)))
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read the strands; a head is put under them."""
    reader = ByteReader(read_bytes(path), path)
    width = _numbers_a_point(path)
    words = reader.array("<i4", reader.left // 4, "the file")
    if len(words) * 4 != len(reader.data) or not len(words):
        raise reader.error("the file does not consist of numbers of four bytes")
    counts = _counts(words, width, reader)
    numbers = words[~_is_count(counts, width)].view("<f4").reshape(-1, width)
    points = finite(numbers[:, :3], path, "points")
    strands, _ = pack_strands(options.space.points_to_head(points), counts, path)
    return adopt(strands, options, path)


def _numbers_a_point(path: Path) -> int:
    return 7 if path.suffix.lower() == ".bin" else 3


def _pieces(strands: Strands, space: FileSpace, width: int) -> Iterator[memoryview]:
    """Yield the file's bytes; counts stand between the points, so both fill one block of words."""
    yield as_bytes("<i4", len(strands))
    for block in blocks(strands):
        points = space.points_to_file(strands.points[block.points])
        row = np.zeros((len(points), width), "<f4")
        row[:, :3] = points
        counts = strands.counts[block.strands]
        is_count = _is_count(counts, width)[1:]
        words = np.empty(len(is_count), "<i4")
        words[is_count] = counts
        words[~is_count] = row.reshape(-1).view("<i4")
        yield as_bytes("<i4", words)


def _is_count(counts: Int64Array, width: int) -> BoolArray:
    """Return which words of the file are counts: the first, and the one before each strand."""
    sizes = 1 + width * counts
    mask = np.zeros(1 + int(sizes.sum()), bool)
    mask[0] = True
    mask[1 + np.cumsum(sizes) - sizes] = True
    return mask


def _counts(words: npt.NDArray[np.int32], width: int, reader: ByteReader) -> Int64Array:
    """Return the points (S,) of each strand.

    Each count gives the position of the next one, so unequal strands are read one after the other.
    """
    strands = int(words[0])
    if not 0 < strands < len(words):
        raise reader.error(f"{strands} strands in a file of {len(reader.data)} bytes")
    each = 1 + width * int(words[1])
    if len(words) == 1 + strands * each and (words[1::each] == words[1]).all():
        return np.full(strands, int(words[1]), np.int64)
    counts, at = np.empty(strands, np.int64), 1
    plain = np.ascontiguousarray(words).data
    for strand in range(strands):
        count = plain[at] if at < len(words) else -1
        if not 0 <= count <= (len(words) - at - 1) // width:
            raise reader.error(
                f"strand {strand} has {count} points, which the file has no room for"
            )
        counts[strand] = count
        at += 1 + width * count
    if at != len(words):
        raise reader.error(f"{len(words) - at} numbers follow the last strand")
    return counts
