"""The chunks of a WebP file, checked before a decoder sees the file (RFC 9649)."""

from __future__ import annotations

import struct

from hairkit.errors import FormatError

_LOSSY_START = b"\x9d\x01\x2a"
_LOSSLESS_START = 0x2F
_ANIMATED = 0x02
"""Flag of the extended header."""
_EXIF = b"Exif\0\0"


def is_webp(data: bytes) -> bool:
    """Return whether a file begins as WebP files do."""
    return data[:4] == b"RIFF" and data[8:12] == b"WEBP"


def scan_webp(data: bytes, where: str) -> tuple[int, int, bytes]:
    """Return width, height and the EXIF block, maybe empty, of a WebP file.

    Raises
    ------
    FormatError
        An animation; the message begins with `where`.
    ValueError, struct.error, IndexError
        The file is damaged or cut short.
    """
    (length,) = struct.unpack_from("<I", data, 4)
    end = 8 + length
    if end > len(data):
        raise ValueError("cut short")
    size, canvas, exif, position = None, None, b"", 12
    while position + 8 <= end:
        name, (length,) = (
            data[position : position + 4],
            struct.unpack_from("<I", data, position + 4),
        )
        block = data[position + 8 : position + 8 + length]
        if position + 8 + length > end:
            raise ValueError("cut short")
        if name == b"VP8X":
            if block[0] & _ANIMATED:
                raise FormatError(f"{where}: an animation, expected a photo")
            canvas = tuple(1 + int.from_bytes(block[at : at + 3], "little") for at in (4, 7))
        elif name == b"VP8 ":
            size = size or _lossy_size(block)
        elif name == b"VP8L":
            size = size or _lossless_size(block)
        elif name == b"EXIF":
            exif = exif or block.removeprefix(_EXIF)
        position += 8 + length + length % 2
    if size is None or canvas not in (None, size):
        raise ValueError("no picture of the size that the header tells")
    return (*size, exif)


def _lossy_size(block: bytes) -> tuple[int, int]:
    """Return the size that the frame header of VP8 tells (RFC 6386, 9.1)."""
    if block[3:6] != _LOSSY_START:
        raise ValueError("no key frame")
    width, height = struct.unpack_from("<HH", block, 6)
    return width & 0x3FFF, height & 0x3FFF


def _lossless_size(block: bytes) -> tuple[int, int]:
    """Return the size that the header of lossless WebP tells, 14 bits each."""
    if block[0] != _LOSSLESS_START:
        raise ValueError("no signature")
    (bits,) = struct.unpack_from("<I", block, 1)
    return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
