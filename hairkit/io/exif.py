"""TIFF directories: those of EXIF, read for what reconstruction needs, and those of TIFF files.

EXIF is a TIFF directory (CIPA DC-008) with orientation, focal length and sensor size; its invalid
entries are ignored. The first directory of a TIFF file is checked before a decoder sees the file
(TIFF 6.0, 1992).
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from hairkit.errors import FormatError

_ORIENTATION, _EXIF_POINTER = 0x0112, 0x8769
_FOCAL, _FOCAL_35MM = 0x920A, 0xA405
_PIXELS_X, _PIXELS_Y = 0xA002, 0xA003
_PLANE_X, _PLANE_UNIT = 0xA20E, 0xA210
_FORMATS = {3: "H", 4: "I", 5: "II"}
"""TIFF types that are read: short, long, rational."""
_UNIT_MM = {2: 25.4, 3: 10.0, 4: 1.0}
_MAX_ENTRIES = 512
_WIDTH, _HEIGHT, _BITS, _PHOTOMETRIC = 256, 257, 258, 262
_SAMPLES, _FORMAT, _DNG_VERSION = 277, 339, 50706
_ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
"""Byte orders by a file's first four bytes."""
_PIECES = ((273, 279), (324, 325))
"""Tags of places and sizes of strips, and of tiles."""
_TILE_EDGES = (322, 323)
_SIZES = {1: "B", 3: "H", 4: "I"}
"""Types of whole numbers: byte, short, long."""
_GREY_AND_RGB = (0, 1, 2)
"""Photometric interpretations: white is zero, black is zero, RGB."""
_MAX_TIFF_ENTRIES, _MAX_TILE = 4096, 2**13
"""Most entries of a TIFF file's directory, and the longest edge of a tile in pixels."""

Directory = dict[int, tuple[int, ...]]


@dataclass(frozen=True)
class Exif:
    """Values of a photo's EXIF block; None where a value is missing or unusable."""

    orientation: int = 1
    """1 to 8; 1 is upright."""
    focal_35mm: float | None = None
    """35 mm equivalent focal length in mm."""
    focal_mm: float | None = None
    """True focal length in mm."""
    pixels_per_mm: float | None = None
    """Pixels on one millimetre of the sensor."""
    pixels: tuple[int, int] | None = None
    """Width and height when the photo was taken."""


def read_exif(block: bytes) -> Exif:
    """Return the facts in a TIFF-shaped EXIF block; an empty or damaged one gives the defaults."""
    order = _ORDERS.get(block[:4])
    if order is None:
        return Exif()
    main = _directory(block, order, _number(block, order, 4))
    detail = _directory(block, order, int(main.get(_EXIF_POINTER, 0)))
    orientation = int(main.get(_ORIENTATION, 1))
    per_unit = _within(detail.get(_PLANE_X), 1e-3, 1e9)
    unit = _UNIT_MM.get(int(detail.get(_PLANE_UNIT, 2)))
    pixels = int(detail.get(_PIXELS_X, 0)), int(detail.get(_PIXELS_Y, 0))
    return Exif(
        orientation if 1 <= orientation <= 8 else 1,
        _within(detail.get(_FOCAL_35MM), 8, 2000),
        _within(detail.get(_FOCAL), 0.5, 2000),
        per_unit / unit if per_unit is not None and unit is not None else None,
        pixels if min(pixels) > 0 else None,
    )


def _directory(block: bytes, order: str, start: int) -> dict[int, float]:
    """Return the first number of every entry of the TIFF directory at `start`, by tag."""
    if not 8 <= start <= len(block) - 2:
        return {}
    (count,) = struct.unpack_from(order + "H", block, start)
    values: dict[int, float] = {}
    for index in range(min(count, _MAX_ENTRIES)):
        entry = start + 2 + 12 * index
        if entry + 12 > len(block):
            break
        tag, kind, _ = struct.unpack_from(order + "HHI", block, entry)
        if kind not in _FORMATS:
            continue
        place = _number(block, order, entry + 8) if kind == 5 else entry + 8
        size = struct.calcsize(order + _FORMATS[kind])
        if place + size > len(block):
            continue
        numbers = struct.unpack_from(order + _FORMATS[kind], block, place)
        value = numbers[0] / (numbers[1] or math.inf) if kind == 5 else numbers[0]
        values.setdefault(tag, value)
    return values


def _number(block: bytes, order: str, place: int) -> int:
    return int(struct.unpack_from(order + "I", block, place)[0]) if place + 4 <= len(block) else 0


def _within(value: float | None, low: float, high: float) -> float | None:
    return value if value is not None and low <= value <= high else None


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
    if count > _MAX_TIFF_ENTRIES:
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
