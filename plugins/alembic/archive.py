"""Objects and properties of an Alembic archive, at the first sample.

Source: AbcCoreOgawa of Alembic 1.8 (object and property headers, samples with a 16-byte key).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.io.byte_reader import finite

from .ogawa import Headers, Ogawa

_PODS = "?,u1,i1,u2,i2,u4,i4,u8,i8,f2,f4,f8".replace(",", " <").split()
"""NumPy's name of each plain type, by Alembic's number; strings (12, 13) are not read."""
_KEY_BYTES, _HASH_BYTES = 16, 32
_LONG_METADATA = 255
_ROOT_CHILDREN = 6


def tag(metadata: str, key: str) -> str:
    """Return a value of metadata, `key=value` joined by semicolons; empty where there is none."""
    pairs = (part.partition("=") for part in metadata.split(";"))
    return next((value for name, _, value in pairs if name == key), "")


@dataclass(frozen=True)
class Property:
    """A header; values are read when they are asked for."""

    archive: Archive
    name: str
    metadata: str
    kind: int
    """0 compound, 1 scalar, 2 array, 3 array of one element."""
    pod: int
    extent: int
    samples: int
    child: int

    def properties(self) -> dict[str, Property]:
        """Return the properties of a compound by name, empty for any other kind."""
        return self.archive.properties(self.child) if self.kind == 0 else {}

    def floats(self) -> Float64Array | None:
        """Return (N, extent) the first sample; raises `FormatError` when it is not finite."""
        numbers = self._first_sample("f")
        if numbers is None:
            return None
        source = self.archive.file.source
        return finite(numbers, source, self.name).astype(np.float64)

    def float32(self) -> Float32Array | None:
        """Return the first sample as `floats` does, in single precision and without a copy."""
        numbers = self._first_sample("f")
        if numbers is None or numbers.dtype != np.float32:
            wide = self.floats()
            with np.errstate(over="ignore"):
                return None if wide is None else wide.astype(np.float32)
        return finite(numbers, self.archive.file.source, self.name)

    def integers(self) -> Int64Array | None:
        """Return (N, extent) the first sample; None where there is none."""
        numbers = self._first_sample("iub")
        return None if numbers is None else numbers.astype(np.int64)

    def _first_sample(self, kinds: str) -> npt.NDArray[Any] | None:
        if self.kind == 0 or not self.samples or self.pod >= len(_PODS) or not self.extent:
            return None
        file, dtype = self.archive.file, np.dtype(_PODS[self.pod])
        children = file.group(self.child, self.name)
        if not children or dtype.kind not in kinds:
            return None
        raw = file.sample(children[0], self.name)
        size = dtype.itemsize * self.extent
        if len(raw) < _KEY_BYTES + size:
            return None
        if (len(raw) - _KEY_BYTES) % size:
            raise file.error(f"{self.name} is cut within a number")
        return np.frombuffer(raw[_KEY_BYTES:], dtype).reshape(-1, self.extent)


@dataclass(frozen=True)
class Object:
    """A node of the scene."""

    archive: Archive
    name: str
    metadata: str
    children: tuple[int, ...]
    """Its group: properties, child objects, data of their headers."""

    def properties(self) -> dict[str, Property]:
        """Return the object's properties by name."""
        return self.archive.properties(self.children[0]) if self.children else {}

    def is_a(self, schema: str) -> bool:
        """Return whether the object has a schema of any version: `AbcGeom_Curve`."""
        return tag(self.metadata, "schema").startswith(f"{schema}_v")

    def objects(self) -> Iterator[Object]:
        """Yield the objects under this one."""
        if len(self.children) < 2:
            return
        file = self.archive.file
        headers = file.headers(self.children[-1], f"headers of {self.name}")
        child = 0
        while headers.left > _HASH_BYTES:
            child += 1
            name = headers.text(headers.number(4, "length of a name"), "name of an object")
            metadata = self.archive.metadata_text(headers, headers.number(1, name), 4)
            if child >= len(self.children) - 1:
                raise headers.file.error(f"{self.name} has fewer objects than headers")
            group = file.group(self.children[child], name)
            yield Object(self.archive, name, metadata, group)


class Archive:
    """A file's tree, read as it is walked."""

    def __init__(self, file: Ogawa) -> None:
        self.file = file
        self.children = file.group(file.root, "root group")
        if len(self.children) < _ROOT_CHILDREN:
            raise file.error(f"the root group has {len(self.children)} parts, expected 6")
        self.metadata = [""]
        reader = file.headers(self.children[5], "metadata")
        while reader.left:
            length = reader.number(1, "length of metadata")
            self.metadata.append(reader.text(length, "metadata"))

    @classmethod
    def open(cls, path: Path) -> Archive:
        """Read a file; raises `InputError` or `FormatError` when it is no Alembic archive."""
        return cls(Ogawa.open(path))

    def top(self) -> Object:
        """Return the object above all others."""
        return Object(self, "ABC", "", self.file.group(self.children[2], "top object"))

    def properties(self, child: int) -> dict[str, Property]:
        """Return the properties of a compound's group by name."""
        children = self.file.group(child, "properties")
        if not children:
            return {}
        headers = self.file.headers(children[-1], "property headers")
        found: list[Property] = []
        while headers.left:
            if len(found) >= len(children) - 1:
                raise headers.file.error("there are fewer properties than headers")
            found.append(self._header(headers, children[len(found)]))
        return {header.name: header for header in found}

    def metadata_text(self, reader: Headers, index: int, size: int) -> str:
        """Return metadata by its number in the file's table, or from here in `size` bytes."""
        if index == _LONG_METADATA:
            length = reader.number(size, "length of metadata")
            return reader.text(length, "metadata")
        if index >= len(self.metadata):
            raise reader.file.error(f"metadata {index} of {len(self.metadata)}")
        return self.metadata[index]

    def _header(self, reader: Headers, child: int) -> Property:
        """Read one property header; the numbers in it are 1, 2 or 4 bytes wide, as it says."""
        info = reader.number(4, "property header")
        kind, hint = info & 3, info >> 2 & 3
        if hint > 2:
            raise reader.file.error("property header has numbers of an unknown size")
        width = 1 << hint
        samples = 0
        if kind:
            samples = reader.number(width, "number of samples")
            # first and last changed sample, and the time sampling, where the flags say so
            for flag, name in ((0x200, "changed"), (0x200, "changed"), (0x100, "sampling")):
                if info & flag:
                    reader.number(width, name)
        name = reader.text(reader.number(width, "length of a name"), "name of a property")
        metadata = self.metadata_text(reader, info >> 20 & 0xFF, width)
        return Property(
            self, name, metadata, kind, info >> 4 & 15, info >> 12 & 0xFF, samples, child
        )
