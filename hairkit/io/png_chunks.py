"""The chunks of a PNG file, and whether its picture data is whole (PNG, third edition, 2025)."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Samples of a pixel by colour type."""


def read_chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the name and the data of every chunk, IHDR first and IEND last.

    Raises `ValueError` or `struct.error` when the file is damaged or cut short.
    """
    position, name = len(SIGNATURE), b""
    if data[12:16] != b"IHDR":
        raise ValueError("no IHDR")
    while name != b"IEND":
        (length,) = struct.unpack_from(">I", data, position)
        name, end = data[position + 4 : position + 8], position + 8 + length
        if struct.unpack_from(">I", data, end) != (zlib.crc32(data[position + 4 : end]),):
            raise ValueError("a chunk's checksum is wrong")
        yield name, data[position + 8 : end]
        position = end + 4


def write_chunk(name: bytes, block: bytes) -> bytes:
    """Return a chunk with its length and checksum."""
    checksum = zlib.crc32(name + block)
    return struct.pack(">I", len(block)) + name + block + struct.pack(">I", checksum)


def scan_png(data: bytes) -> tuple[int, int, bytes]:
    """Return width, height and the EXIF block, maybe empty; raises as `read_chunks`."""
    blocks = dict(read_chunks(data))
    return (*struct.unpack_from(">II", data, 16), blocks.get(b"eXIf", b""))


def check_png_data(data: bytes) -> None:
    """Raise `ValueError` when the packed data is not of the size of the picture."""
    width, height, depth, colour = struct.unpack_from(">IIBB", data, 16)
    interlaced = data[28] != 0
    row = -(-width * depth * _CHANNELS.get(colour, 4) // 8)
    least = height * (row + (not interlaced))  # each row has a filter byte, interlaced ones more
    most = height * (1 + 8 * width) + 8 * (height + 8)  # 16 bit RGBA, a filter byte a row and pass
    inflate, found = zlib.decompressobj(), 0
    for packed in (block for name, block in read_chunks(data) if name == b"IDAT"):
        try:
            found += len(inflate.decompress(packed, most + 1 - found))
        except zlib.error as error:
            raise ValueError(f"its picture data cannot be unpacked: {error}") from error
        if found > most:
            raise ValueError("it unpacks to more than its picture holds")
    if found < least or not inflate.eof:
        raise ValueError("some of its picture data is missing")
