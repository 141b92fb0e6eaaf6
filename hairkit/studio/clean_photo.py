"""A photo without what its file says about the person: place, time, device, thumbnails.

The picture's data stay byte for byte, so that a groom from the cleaned photo equals that from the
original. All else is left out and written anew: only the orientation and the focal length stay.
"""

from __future__ import annotations

import re
import struct
import zlib
from fractions import Fraction

from hairkit.errors import FormatError
from hairkit.io.exif import Exif

_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"
_JPEG_KEPT = {*range(0xC0, 0xD0), 0xDA, 0xDB, 0xDD, 0xEE}
"""Markers of frames, tables, scans, restart intervals and Adobe's colour transform (APP14)."""
_START_OF_SCAN, _END_OF_IMAGE, _FILL = 0xDA, 0xD9, 0xFF
_NEXT_MARKER = re.compile(rb"\xff[\x01-\xcf\xd8-\xfe]")
"""A marker that ends a scan's data: neither a stuffed 0 nor a restart marker."""
_CHUNK_BYTES = 12
"""Length, name and checksum of a chunk."""
_PNG_KEPT = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
_SHORT, _LONG, _RATIONAL = 3, 4, 5
"""TIFF types of the numbers in the EXIF block."""
_ORIENTATION, _DETAIL, _ENTRY_BYTES = 0x0112, 0x8769, 12
_TIFF_HEADER = 8
_FOCAL, _FOCAL_35MM, _WIDTH, _HEIGHT = 0x920A, 0xA405, 0xA002, 0xA003
_PLANE_X, _PLANE_UNIT = 0xA20E, 0xA210
"""EXIF's tags, and the size of an entry of a directory."""
_FINEST = 1_000_000
"""Largest denominator of a rational."""
_MILLIMETRE = 4
"""EXIF's FocalPlaneResolutionUnit."""


def clean_photo(data: bytes, exif: Exif) -> bytes:
    """Return a JPEG or PNG file with the same picture and nothing else but `exif`'s facts.

    Raises
    ------
    FormatError
        The file is neither, or damaged.
    """
    try:
        if data.startswith(_JPEG):
            return _clean_jpeg(data, exif_block(exif))
        if data.startswith(_PNG):
            return _clean_png(data, exif_block(exif))
    except (struct.error, IndexError, ValueError) as error:
        raise FormatError("the photo is damaged; save it again") from error
    raise FormatError("not a photo: expected JPEG, PNG or HEIC")


def exif_block(exif: Exif) -> bytes:
    """Return a little-endian TIFF directory with what `read_exif` reads."""
    detail: list[tuple[int, int, Fraction]] = []
    if exif.focal_mm is not None:
        detail.append((_FOCAL, _RATIONAL, Fraction(exif.focal_mm)))
    if exif.pixels is not None:
        detail.append((_WIDTH, _LONG, Fraction(exif.pixels[0])))
        detail.append((_HEIGHT, _LONG, Fraction(exif.pixels[1])))
    if exif.pixels_per_mm is not None:
        detail.append((_PLANE_X, _RATIONAL, Fraction(exif.pixels_per_mm)))
        detail.append((_PLANE_UNIT, _SHORT, Fraction(_MILLIMETRE)))
    if exif.focal_35mm is not None:
        detail.append((_FOCAL_35MM, _SHORT, Fraction(round(exif.focal_35mm))))
    start = _TIFF_HEADER
    main_size = 2 + 2 * _ENTRY_BYTES + 4
    main = [
        (_ORIENTATION, _SHORT, Fraction(exif.orientation)),
        (_DETAIL, _LONG, Fraction(start + main_size)),
    ]
    return (
        b"II*\0"
        + struct.pack("<I", start)
        + _directory(main, start)
        + _directory(detail, start + main_size)
    )


def _directory(entries: list[tuple[int, int, Fraction]], start: int) -> bytes:
    """Return a TIFF directory at the place `start`, its rationals behind it."""
    behind = start + 2 + _ENTRY_BYTES * len(entries) + 4
    table, values = struct.pack("<H", len(entries)), b""
    for tag, kind, value in entries:
        table += struct.pack("<HHI", tag, kind, 1)
        if kind == _RATIONAL:
            table += struct.pack("<I", behind + len(values))
            near = value.limit_denominator(_FINEST)
            values += struct.pack("<II", near.numerator, near.denominator)
        else:
            table += struct.pack("<I", int(value))  # a short's two bytes come first
    return table + struct.pack("<I", 0) + values


def _clean_jpeg(data: bytes, exif: bytes) -> bytes:
    body = b"Exif\0\0" + exif
    pieces = [data[:2], b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body]
    position = 2
    while True:
        while data[position + 1] == _FILL:
            position += 1
        start, marker = data[position : position + 2]
        if start != _FILL:
            raise ValueError("no marker")
        if marker == _END_OF_IMAGE:
            return b"".join([*pieces, b"\xff\xd9"])
        (length,) = struct.unpack_from(">H", data, position + 2)
        end = position + 2 + length
        if marker == _START_OF_SCAN:
            found = _NEXT_MARKER.search(data, end)
            if found is None:
                raise ValueError("no end marker")
            end = found.start()
        if marker in _JPEG_KEPT:
            pieces.append(data[position:end])
        position = end


def _clean_png(data: bytes, exif: bytes) -> bytes:
    pieces, position, name = [_PNG], 8, b""
    while name != b"IEND":
        (length,) = struct.unpack_from(">I", data, position)
        name, end = data[position + 4 : position + 8], position + _CHUNK_BYTES + length
        if end > len(data):
            raise ValueError("cut short")
        if name in _PNG_KEPT:
            pieces.append(data[position:end])
        if name == b"IHDR":
            chunk = b"eXIf" + exif
            pieces.append(
                struct.pack(">I", len(exif)) + chunk + struct.pack(">I", zlib.crc32(chunk))
            )
        position = end
    return b"".join(pieces)
