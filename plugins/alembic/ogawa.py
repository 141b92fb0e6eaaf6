"""The Ogawa container: groups of numbers that point at other groups and at blocks of data.

Every position and size is checked against the file before it is followed, and the bytes looked at
in all are bounded, so that blocks which are pointed at again and again end in an error too.
Source: Ogawa of Alembic 1.8. Little-endian throughout.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from hairkit.byte_reader import ByteReader, read_file
from hairkit.errors import FormatError, InputError
from hairkit.stored import UInt8Array

_MAGIC, _HDF5, _FROZEN = b"Ogawa", b"\x89HDF", 0xFF
_HEADER_BYTES = 16
_IS_DATA = 1 << 63
_STRUCTURE, _SAMPLES = (2, 1 << 16), (16, 1 << 20)
"""So many times the file, and so many bytes more, may be read in all: samples may be shared."""


class Ogawa:
    """A file in memory; a child is a position, with the top bit set where it is data."""

    def __init__(self, data: bytes, source: str | os.PathLike[str]) -> None:
        self.reader = ByteReader(data, source)
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
        return cls(read_file(path), path)

    def group(self, child: int, name: str) -> list[int]:
        """Return the children of a group; 0 is an empty group."""
        if is_data(child):
            raise self.reader.error(f"{name} is data, expected a group")
        if child == 0:
            return []
        self.reader.seek(child, name)
        count = int(self.reader.number("<u8", name))
        children = self.reader.array("<u8", count, name)
        self._spend_structure(8 * count + 8, name)
        return [int(child) for child in children]

    def headers(self, child: int, name: str) -> ByteReader:
        """Return a reader of a block of headers."""
        raw = self._block(child, name).tobytes()
        self._spend_structure(len(raw) + 8, name)
        return ByteReader(raw, self.reader.source)

    def sample(self, child: int, name: str) -> UInt8Array:
        """Return a block of numbers as bytes, without a copy; position 0 is an empty block."""
        raw = self._block(child, name)
        self.samples_left -= len(raw)
        if self.samples_left < 0:
            raise self.reader.error(f"{name} and others share their numbers again and again")
        return raw

    def _block(self, child: int, name: str) -> UInt8Array:
        if not is_data(child):
            raise self.reader.error(f"{name} is a group, expected data")
        if child == _IS_DATA:
            return np.zeros(0, np.uint8)
        self.reader.seek(child ^ _IS_DATA, name)
        size = int(self.reader.number("<u8", name))
        result: UInt8Array = self.reader.array(np.uint8, size, name)
        return result

    def _spend_structure(self, size: int, name: str) -> None:
        self.structure_left -= size
        if self.structure_left < 0:
            raise self.reader.error(f"{name} and others are pointed at again and again")


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
