"""NumPy .npy and HairNet .convdata: bare strands in one array, read only.

A .npy holds strands of equal numbers of points, (strands, points, 3). A .convdata is a .npy too, as
the tools of HairNet (Zhou et al. 2018) write it: (4 points, rows, columns), for each point of a map
of roots x, y, z and the curvature; places without hair are 0. It is in metres, and the head is at
its height above the ground.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.errors import FormatError
from hairkit.grooming.adopt_strands import ImportOptions, adopt, pack_strands
from hairkit.hookspecs import hookimpl
from hairkit.io.byte_reader import ByteReader, finite
from hairkit.io.coordinate_space import SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.storage import read_bytes
from hairkit.types.groom import Groom

FORMAT = FileFormat("NumPy, HairNet", (".npy", ".convdata"), exact={Feature.POINTS})

_MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 10_000
"""Bytes; NumPy reads no longer ones either."""
_UNREADABLE = (ValueError, SyntaxError, TypeError, LookupError, OverflowError, RecursionError)
"""What comes of a damaged header."""
_AXES = 3
_CHANNELS = 4
"""Numbers of a point of a .convdata: its place and the curvature."""


@dataclass(frozen=True)
class Options(ImportOptions, SpaceOptions):
    """Settings of .npy and .convdata files."""


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read the strands; a head is put under them."""
    array = _read(ByteReader(read_bytes(path), path))
    strands = finite(_strands(array, path), path, "points")
    counts = np.full(len(strands), strands.shape[1], np.int64)
    points = options.space.points_to_head(strands.reshape(-1, _AXES))
    return adopt(pack_strands(points, counts, path)[0], options, path)


def _read(reader: ByteReader) -> npt.NDArray[np.floating]:
    """Return the array, whose header says no more than the file holds.

    Source: NumPy, `numpy.lib.format`.
    """
    if reader.array(np.uint8, len(_MAGIC), "the signature").tobytes() != _MAGIC:
        raise reader.error("the file is no NumPy array")
    version = reader.array(np.uint8, 2, "the version")[0]
    length = reader.number("<u2" if version == 1 else "<u4", "the header's length")
    if length > _LONGEST_HEADER:
        raise reader.error(f"the header has {length} bytes")
    text = reader.array(np.uint8, length, "the header").tobytes().decode("latin-1")
    try:
        header = ast.literal_eval(text.strip())
        kind = np.dtype(str(header["descr"]))
        columns_first, shape = header["fortran_order"], [int(size) for size in header["shape"]]
    except _UNREADABLE as error:
        raise reader.error("the header is not that of a NumPy array") from error
    if kind.kind != "f" or kind.itemsize > np.dtype(np.float64).itemsize:
        raise FormatError(f"{reader.source}: an array of {kind}, expected floating point numbers")
    if len(shape) > _AXES:
        raise FormatError(f"{reader.source}: an array of {len(shape)} dimensions, expected {_AXES}")
    read = reader.array(kind, tuple(reversed(shape) if columns_first else shape), "the array")
    array: npt.NDArray[np.floating] = read.T if columns_first else read
    return array


def _strands(array: npt.NDArray[np.floating], path: Path) -> Float64Array:
    """Return (S, P, 3) points."""
    sizes = " x ".join(map(str, array.shape)) or "no"
    if path.suffix.lower() != ".convdata":
        if array.ndim != 3 or array.shape[2] != _AXES or not array.size:
            raise FormatError(
                f"{path}: an array of {sizes} numbers, expected strands x points x {_AXES}"
            )
        return array.astype(np.float64)
    if array.ndim != 3 or array.shape[0] % _CHANNELS or not array.size:
        raise FormatError(
            f"{path}: an array of {sizes} numbers, expected {_CHANNELS} for each point x rows x"
            " columns"
        )
    maps = array.reshape(-1, _CHANNELS, array.shape[1] * array.shape[2])[:, :_AXES]
    strands = maps.transpose(2, 0, 1).astype(np.float64)
    there = strands.any(axis=(1, 2))
    if not there.any():
        raise FormatError(f"{path}: the map holds no hair")
    return strands[there]
