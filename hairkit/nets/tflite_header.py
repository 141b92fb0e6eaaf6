"""The size of picture that a TensorFlow Lite file wants, read from its header.

A `.tflite` file is a FlatBuffer: tables find their fields through a table of offsets, so a few
numbers can be read without a library (`schema.fbs` of TensorFlow Lite, schema version 3; field
numbers below are its). Every offset is checked before it is followed.
"""

from __future__ import annotations

import os
import struct

from hairkit.errors import FormatError
from hairkit.storage import read_bytes

IDENTIFIER = b"TFL3"
_SUBGRAPHS, _TENSORS, _INPUTS, _SHAPE = 2, 0, 1, 0
"""Numbers of the fields: of a model, of a subgraph (two), of a tensor."""
_MAX_RANK = 8
"""Dimensions of a tensor that are believed."""


def read_input_shape(path: str | os.PathLike[str]) -> tuple[int, ...]:
    """Return the shape of a network's first input, usually (1, height, width, channels).

    Raises
    ------
    FormatError
        The file is no TensorFlow Lite file, or its header is damaged.
    """
    data = read_bytes(path)
    if data[4:8] != IDENTIFIER:
        raise FormatError(f"{path}: no TensorFlow Lite file (.tflite)")
    try:
        model = _follow(data, 0)
        subgraph = _item(data, _field(data, model, _SUBGRAPHS), 0)
        first = struct.unpack_from("<i", data, _start(data, _field(data, subgraph, _INPUTS)))[0]
        tensor = _item(data, _field(data, subgraph, _TENSORS), first)
        return _integers(data, _field(data, tensor, _SHAPE))
    except (struct.error, ValueError) as error:
        raise FormatError(f"{path}: the header of this TensorFlow Lite file is damaged") from error


def _follow(data: bytes, place: int) -> int:
    """Return the place that the unsigned offset at `place` leads to."""
    return place + int(struct.unpack_from("<I", data, place)[0])


def _field(data: bytes, table: int, number: int) -> int:
    """Return where the vector or table in a field of a table begins."""
    offsets = table - int(struct.unpack_from("<i", data, table)[0])
    if offsets < 0:
        raise ValueError("an offset points before the file")
    offset = struct.unpack_from("<H", data, offsets + 4 + 2 * number)[0]
    if not offset:
        raise ValueError("a field is missing")
    return _follow(data, table + int(offset))


def _start(data: bytes, vector: int) -> int:
    """Return where the items of a vector begin; `ValueError` when it is empty."""
    if not struct.unpack_from("<I", data, vector)[0]:
        raise ValueError("a vector is empty")
    return vector + 4


def _item(data: bytes, vector: int, index: int) -> int:
    """Return the table that a vector of tables holds at `index`."""
    if not 0 <= index < struct.unpack_from("<I", data, vector)[0]:
        raise ValueError("an index is out of range")
    return _follow(data, vector + 4 + 4 * index)


def _integers(data: bytes, vector: int) -> tuple[int, ...]:
    """Return a short vector of integers."""
    count = int(struct.unpack_from("<I", data, vector)[0])
    if not 0 < count <= _MAX_RANK:
        raise ValueError("a shape has a strange number of dimensions")
    return tuple(struct.unpack_from(f"<{count}i", data, vector + 4))
