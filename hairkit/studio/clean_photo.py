"""A photo without what its file says about the person: place, time, device, thumbnails.

The picture's data stay byte for byte, so that a groom from the cleaned photo equals that from the
original. All else is left out and written anew: only the orientation and the focal length stay.
"""

from __future__ import annotations

import re
import struct

from hairkit.errors import FormatError
from hairkit.io.exif import Exif, write_exif
from hairkit.io.png_chunks import SIGNATURE, read_chunks, write_chunk

_JPEG = b"\xff\xd8\xff"
_JPEG_KEPT = {*range(0xC0, 0xD0), 0xDA, 0xDB, 0xDD, 0xEE}
"""Markers of frames, tables, scans, restart intervals and Adobe's colour transform (APP14)."""
_START_OF_SCAN, _END_OF_IMAGE, _FILL = 0xDA, 0xD9, 0xFF
_NEXT_MARKER = re.compile(rb"\xff[\x01-\xcf\xd8-\xfe]")
"""A marker that ends a scan's data: neither a stuffed 0 nor a restart marker."""
_PNG_KEPT = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")


def clean_photo(data: bytes, exif: Exif) -> bytes:
    """Return a JPEG or PNG file with the same picture and nothing else but `exif`'s facts.

    Raises
    ------
    FormatError
        The file is neither, or damaged.
    """
    try:
        if data.startswith(_JPEG):
            return _clean_jpeg(data, write_exif(exif))
        if data.startswith(SIGNATURE):
            return _clean_png(data, write_exif(exif))
    except (struct.error, IndexError, ValueError) as error:
        raise FormatError("the photo is damaged; save it again") from error
    raise FormatError("not a photo: expected JPEG, PNG or HEIC")


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
    pieces = [SIGNATURE]
    for name, block in read_chunks(data):
        if name in _PNG_KEPT:
            pieces.append(write_chunk(name, block))
        if name == b"IHDR":
            pieces.append(write_chunk(b"eXIf", exif))
    return b"".join(pieces)
