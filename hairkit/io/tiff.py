"""The first directory of a TIFF file, checked before a decoder sees the file (TIFF 6.0, 1992)."""

from __future__ import annotations

import math
import struct

from hairkit.errors import FormatError

_WIDTH, _HEIGHT, _BITS, _PHOTOMETRIC = 256, 257, 258, 262
_ORIENTATION, _SAMPLES, _FORMAT, _DNG_VERSION = 274, 277, 339, 50706
_ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
"""Byte orders by a file's first four bytes."""
_PIECES = ((273, 279), (324, 325))
"""Tags of places and sizes of strips, and of tiles."""
_TILE_EDGES = (322, 323)
_SIZES = {1: "B", 3: "H", 4: "I"}
"""Types of whole numbers: byte, short, long."""
_GREY_AND_RGB = (0, 1, 2)
"""Photometric interpretations: white is zero, black is zero, RGB."""
_MAX_ENTRIES, _MAX_TILE = 4096, 2**13
"""Most entries of a directory, and the longest edge of a tile in pixels."""

Directory = dict[int, tuple[int, ...]]


def scan_tiff(data: bytes, where: str) -> tuple[int, int]:
    """Return width and height of a TIFF file's first picture as it is stored.

    Raises
    ------
    FormatError
        A raw photo, or samples that are not 8 or 16 bit grey or RGB; the message begins with
        `where`.
    ValueError, IndexError, struct.error
        The file is damaged or cut short.
    """
    tags = _read_directory(data)
    if _DNG_VERSION in tags:
        raise FormatError(f"{where}: a raw photo, expected a developed one; save it as JPEG or PNG")
    bits, form = tags.get(_BITS, (1,)), tags.get(_FORMAT, (1,))
    known = (
        set(bits) in ({8}, {16}) and set(form) == {1} and tags.get(_SAMPLES, (1,))[0] in (1, 3, 4)
    )
    if not known or tags.get(_PHOTOMETRIC, (0,))[0] not in _GREY_AND_RGB:
        raise FormatError(
            f"{where}: TIFF of {max(bits)} bits a sample, photometric interpretation"
            f" {tags.get(_PHOTOMETRIC, (0,))[0]}; expected 8 or 16 bits of grey or RGB; save it as"
            " JPEG or PNG"
        )
    _check_pieces(tags, len(data))
    return tags[_WIDTH][0], tags[_HEIGHT][0]


def clear_orientation(data: bytes) -> bytes:
    """Return a scanned TIFF file without its rotation, which decoders apply whatever is asked."""
    order = _ORDERS[data[:4]]
    (start,) = struct.unpack_from(order + "I", data, 4)
    (count,) = struct.unpack_from(order + "H", data, start)
    changed = bytearray(data)
    for entry in range(start + 2, start + 2 + 12 * count, 12):
        if struct.unpack_from(order + "H", data, entry) == (_ORIENTATION,):
            struct.pack_into(order + "HIHH", changed, entry + 2, 3, 1, 1, 0)
    return bytes(changed)


def _read_directory(data: bytes) -> Directory:
    """Return the whole numbers of every entry of the first directory, by tag."""
    order = _ORDERS[data[:4]]
    (start,) = struct.unpack_from(order + "I", data, 4)
    (count,) = struct.unpack_from(order + "H", data, start)
    if count > _MAX_ENTRIES:
        raise ValueError("too many entries")
    tags: Directory = {}
    for index in range(count):
        entry = start + 2 + 12 * index
        tag, kind, length = struct.unpack_from(order + "HHI", data, entry)
        if kind not in _SIZES:
            continue
        size = length * struct.calcsize(_SIZES[kind])
        place = entry + 8
        if size > 4:
            (place,) = struct.unpack_from(order + "I", data, place)
        if not length or place + size > len(data):
            raise ValueError("an entry points outside of the file")
        tags.setdefault(tag, struct.unpack_from(f"{order}{length}{_SIZES[kind]}", data, place))
    if _WIDTH not in tags or _HEIGHT not in tags:
        raise ValueError("no size")
    return tags


def _check_pieces(tags: Directory, length: int) -> None:
    """Raise `ValueError` when strips or tiles lie outside of the file's `length` bytes."""
    strips, tiles = ((tags.get(place, ()), tags.get(size, ())) for place, size in _PIECES)
    places, sizes = tiles if tiles[0] else strips
    if not places or len(places) != len(sizes):
        raise ValueError("no picture data")
    if any(place + size > length or not size for place, size in zip(places, sizes, strict=True)):
        raise ValueError("picture data is missing")
    edges = [tags.get(tag, (1,))[0] for tag in _TILE_EDGES]
    if tiles[0] and not 0 < math.prod(edges) <= _MAX_TILE**2:
        raise ValueError("tiles of an unusual size")
