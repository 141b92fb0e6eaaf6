"""The Ogawa container: groups of numbers that point at other groups and at blocks of data.

Every position and size is checked against the file before it is followed, and the bytes looked at
in all are bounded, so that blocks which are pointed at again and again end in an error too.
Source: Ogawa of Alembic 1.8. Little-endian throughout.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path

from hairkit.errors import FormatError, InputError
from hairkit.storage import read_bytes

_MAGIC, _HDF5, _FROZEN = b"Ogawa", b"\x89HDF", 0xFF
_HEADER_BYTES = 16
_IS_DATA = 1 << 63
_STRUCTURE, _SAMPLES = (2, 1 << 16), (16, 1 << 20)
"""So many times the file, and so many bytes more, may be read in all: samples may be shared."""


class Ogawa:
    """A file in memory; a child is a position, with the top bit set where it is data."""

    def __init__(self, data: bytes, source: str | os.PathLike[str]) -> None:
        self.bytes, self.source = data, source
        self.structure_left = _STRUCTURE[0] * len(data) + _STRUCTURE[1]
        self.samples_left = _SAMPLES[0] * len(data) + _SAMPLES[1]
        head = data[:_HEADER_BYTES]
        if head.startswith(_HDF5):
            raise InputError(
                f"{source}: an Alembic file of the old HDF5 kind; convert it with"
                " abcconvert -toOgawa"
            )
        if len(head) < _HEADER_BYTES or not head.startswith(_MAGIC):
            raise FormatError(f"{source}: not an Alembic file; it does not begin with 'Ogawa'")
        if head[5] != _FROZEN:
            raise FormatError(f"{source}: the program that wrote this file did not finish it")
        self.root = int.from_bytes(head[8:], "little")

    @classmethod
    def open(cls, path: Path) -> Ogawa:
        """Read a file; raises `InputError` when it is missing, `FormatError` when not Ogawa."""
        return cls(read_bytes(path), path)

    def group(self, child: int, name: str) -> tuple[int, ...]:
        """Return the children of a group; 0 is an empty group."""
        if is_data(child):
            raise self.error(f"{name} is data, expected a group")
        if child == 0:
            return ()
        count = self._size(child, 8, name)
        self._spend_structure(8 * count + 8, name)
        return struct.unpack_from(f"<{count}Q", self.bytes, child + 8)

    def headers(self, child: int, name: str) -> Headers:
        """Return a reader of a block of headers."""
        start, size = self._block(child, name)
        self._spend_structure(size + 8, name)
        return Headers(self.bytes[start : start + size], self)

    def sample(self, child: int, name: str) -> memoryview:
        """Return a block of numbers as bytes, without a copy."""
        start, size = self._block(child, name)
        self.samples_left -= size
        if self.samples_left < 0:
            raise self.error(f"{name} and others share their numbers again and again")
        return memoryview(self.bytes)[start : start + size]

    def error(self, reason: str) -> FormatError:
        """Return the error to raise: it names the file."""
        return FormatError(f"{self.source}: damaged, or of an unknown Alembic version: {reason}")

    def _block(self, child: int, name: str) -> tuple[int, int]:
        """Return where a block of data begins, and its bytes; position 0 is an empty block."""
        if not is_data(child):
            raise self.error(f"{name} is a group, expected data")
        if child == _IS_DATA:
            return 0, 0
        at = child ^ _IS_DATA
        return at + 8, self._size(at, 1, name)

    def _size(self, at: int, item: int, name: str) -> int:
        """Return the number of items of so many bytes that a group or block says it has."""
        left = len(self.bytes) - at - 8
        if left < 0:
            raise self.error(f"{name} would be at byte {at} of {len(self.bytes)}")
        size = int.from_bytes(self.bytes[at : at + 8], "little")
        if size * item > left:
            raise self.error(f"{name} would be {size} x {item} bytes, but {left} are left")
        return size

    def _spend_structure(self, size: int, name: str) -> None:
        self.structure_left -= size
        if self.structure_left < 0:
            raise self.error(f"{name} and others are pointed at again and again")


class Headers:
    """A place in a block of headers, which moves on as they are read."""

    def __init__(self, data: bytes, file: Ogawa) -> None:
        self.bytes, self.file, self.at = data, file, 0

    @property
    def left(self) -> int:
        """Bytes from here to the block's end."""
        return len(self.bytes) - self.at

    def number(self, size: int, name: str) -> int:
        """Return the whole number in the next `size` bytes."""
        return int.from_bytes(self._next(size, name), "little")

    def text(self, size: int, name: str) -> str:
        """Return the text in the next `size` bytes."""
        return self._next(size, name).decode("utf-8", "replace")

    def _next(self, size: int, name: str) -> bytes:
        if size > self.left:
            raise self.file.error(f"{name} has {size} bytes, but {self.left} are left")
        self.at += size
        return self.bytes[self.at - size : self.at]


def is_data(child: int) -> bool:
    """Return whether a child is a block of data, not a group."""
    return bool(child & _IS_DATA)


def is_complete(path: Path) -> bool:
    """Return whether a file is an Ogawa file that was closed and ends where its root group does."""
    with path.open("rb") as file:
        head = file.read(_HEADER_BYTES)
        if len(head) < _HEADER_BYTES or head[:5] != _MAGIC or head[5] != _FROZEN:
            return False
        root = int.from_bytes(head[8:], "little")
        file.seek(root)
        children = int.from_bytes(file.read(8), "little")
        return path.stat().st_size == root + 8 + 8 * children
