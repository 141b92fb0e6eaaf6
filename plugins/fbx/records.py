"""Records of an FBX 7.4 binary file: names, typed values and children, and the frame around them.

A record is its end's place in the file, the number and bytes of its values, its name, the values
and the child records; 13 zero bytes close a list of children.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hairkit.errors import InputError

VERSION = 7400
MAGIC = b"Kaydara FBX Binary  \0\x1a\0"
CLOSE = b"\0" * 13
FILE_ID = bytes.fromhex("28b32aebb624ccc2bfc8b02aa92bfcf1")
CREATION_TIME = "1970-01-01 10:00:00:000"
"""The file's id, creation time and footer id belong together; these make equal files equal."""
_FOOTER_ID = bytes.fromhex("fabcab09d0c8d466b176fb831cf7267e")
_FOOTER_END = bytes.fromhex("f85a8c6adef5d97eece90ce3758f290b")
_HEADER = struct.Struct("<IIIB")
_SCALARS = {"C": "<?", "I": "<i", "D": "<d", "L": "<q"}
_ARRAYS = {"d": "<f8", "i": "<i4"}


@dataclass(frozen=True)
class Record:
    """One record; values are bytes already."""

    name: bytes
    values: tuple[bytes, ...]
    children: tuple[Record, ...]


def record(name: str, *values: bytes, children: Sequence[Record] = ()) -> Record:
    """Return a record of values made by `number`, `text`, `raw` and `array`."""
    return Record(name.encode("ascii"), values, tuple(children))


def number(kind: str, value: float) -> bytes:
    """Return a value: C bool, I 32-bit, L 64-bit, D double."""
    return kind.encode() + struct.pack(_SCALARS[kind], value)


def text(value: str) -> bytes:
    """Return a string value."""
    return _prefix_length(b"S", value.encode())


def raw(value: bytes) -> bytes:
    """Return a value of plain bytes."""
    return _prefix_length(b"R", value)


def object_name(name: str, kind: str) -> bytes:
    """Return the name of an object with its class, as binary files join them."""
    return _prefix_length(b"S", name.encode() + b"\0\1" + kind.encode())


def array(kind: str, values: npt.ArrayLike) -> bytes:
    """Return an uncompressed array value: d doubles, i 32-bit."""
    held = np.ascontiguousarray(values, _ARRAYS[kind]).ravel()
    return kind.encode() + struct.pack("<III", held.size, 0, held.nbytes) + held.tobytes()


def file_pieces(records: Sequence[Record]) -> list[bytes]:
    """Return the whole file in pieces: magic, records, footer.

    Raises
    ------
    InputError
        The file would be larger than 4 GiB, the most that version 7.4 can name.
    """
    pieces = [MAGIC + struct.pack("<I", VERSION)]
    at = len(pieces[0])
    for top in records:
        found, at = _pieces(top, at)
        pieces += found
    footer = CLOSE + _FOOTER_ID + b"\0" * 4
    padding = -(at + len(footer)) % 16 or 16
    return [*pieces, footer, b"\0" * padding, struct.pack("<I", VERSION), b"\0" * 120, _FOOTER_END]


def _prefix_length(kind: bytes, value: bytes) -> bytes:
    return kind + struct.pack("<I", len(value)) + value


def _pieces(node: Record, start: int) -> tuple[list[bytes], int]:
    """Return a record's own bytes, those of each child, and where in the file they end."""
    body = b"".join(node.values)
    pieces = []
    end = start + _HEADER.size + len(node.name) + len(body)
    for child in node.children:
        found, end = _pieces(child, end)
        pieces.append(b"".join(found) if len(found) > 1 else found[0])
    if node.children or not node.values:
        pieces.append(CLOSE)
        end += len(CLOSE)
    if end >= 2**32:
        raise InputError("the FBX file would be larger than 4 GiB; write fewer strands")
    header = _HEADER.pack(end, len(node.values), len(body), len(node.name))
    return [header + node.name + body, *pieces], end
