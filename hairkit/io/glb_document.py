"""A glTF document under construction: its JSON objects, and arrays laid out in one buffer."""

from __future__ import annotations

import itertools
import json
import struct
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.io.byte_writer import as_bytes
from hairkit.io.glb_file import BINARY_CHUNK, JSON_CHUNK
from hairkit.io.streamed import Streamed
from hairkit.storage import write_pieces
from hairkit.types.skin import PNG
from hairkit.types.strand_blocks import bounds as bounds_of
from hairkit.version import __version__

_COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_SHAPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
VERTICES, INDICES = 34962, 34963
"""Targets of buffer views: the OpenGL names of both kinds of buffers."""


class Document:
    """Objects are added in any order and named by the number that `add` returns."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"hairkit {__version__}"}
        }
        self._arrays: list[npt.NDArray[Any] | Streamed] = []
        self._pictures: dict[bytes, int] = {}
        self._end = 0
        self._named: Counter[tuple[str, str]] = Counter()

    def add(self, kind: str, **item: Any) -> int:
        """Append an object to the list `kind`, fields of None left out; return its number.

        Nodes and meshes have names of their own, as programs that go by names demand: what further
        levels of detail repeat gets the level behind its name.
        """
        items = self.json.setdefault(kind, [])
        if kind in ("nodes", "meshes"):
            again = self._named[kind, item["name"]]
            self._named[kind, item["name"]] += 1
            item["name"] += f"_LOD{again}" if again else ""
        items.append({name: value for name, value in item.items() if value is not None})
        return len(items) - 1

    def accessor(
        self,
        array: npt.NDArray[Any] | Streamed,
        target: int | None = VERTICES,
        *,
        bounds: bool = False,
        normalised: bool = False,
    ) -> int:
        """Store an array (count, ...) and return its accessor.

        Parameters
        ----------
        array
            Elements of a glTF type: scalars, vectors, or matrices that are column-major already.
        target
            What the GPU uses it for, or None.
        bounds
            Say the smallest and largest elements, as glTF wants of positions and times; not of
            streamed arrays.
        normalised
            Whole numbers stand for 0 to 1.
        """
        low = high = None
        if bounds and not isinstance(array, Streamed):
            low, high = (end.tolist() for end in bounds_of(array.reshape(len(array), -1)))
        return self.add(
            "accessors",
            bufferView=self.view(array, target),
            componentType=_COMPONENTS[array.dtype.str[1:]],
            normalized=True if normalised else None,
            count=len(array),
            type=_SHAPES[array.shape[1:]],
            min=low,
            max=high,
        )

    def indices(self, array: npt.NDArray[Any], vertices: int) -> int:
        """Store vertex numbers, in two bytes each where they fit."""
        return self.accessor(array.reshape(-1).astype(index_type(vertices), copy=False), INDICES)

    def view(self, array: npt.NDArray[Any] | Streamed, target: int | None = None) -> int:
        """Store bytes in the buffer, at a multiple of four, and return their buffer view."""
        start = self._end
        self._arrays.append(array)
        self._end += -(-array.nbytes // 4) * 4
        return self.add(
            "bufferViews", buffer=0, byteOffset=start, byteLength=array.nbytes, target=target
        )

    def image(self, picture: bytes, name: str) -> int:
        """Store a PNG or JPEG file, if it is new, and return its texture."""
        if picture in self._pictures:
            return self._pictures[picture]
        view = self.view(np.frombuffer(picture, np.uint8))
        kind = "image/png" if picture.startswith(PNG) else "image/jpeg"
        source = self.add("images", bufferView=view, mimeType=kind, name=name)
        if "samplers" not in self.json:
            # linear with mipmaps; across and along a strip the picture does not repeat
            clamp = 33071
            self.add("samplers", magFilter=9729, minFilter=9987, wrapS=clamp, wrapT=clamp)
        self._pictures[picture] = self.add("textures", source=source, sampler=0)
        return self._pictures[picture]

    def joints(
        self, names: Sequence[str], places: Float64Array, parents: Sequence[int]
    ) -> list[int]:
        """Add nodes of joints at places (J, 3), metres, each after its parent; -1 has none."""
        nodes: list[int] = []
        for name, place, parent in zip(names, places, parents, strict=True):
            offset = place if parent < 0 else place - places[parent]
            nodes.append(self.add("nodes", name=name, translation=offset.tolist()))
            if parent >= 0:
                self.json["nodes"][nodes[parent]].setdefault("children", []).append(nodes[-1])
        return nodes

    def skin(self, nodes: list[int], places: Float64Array) -> int:
        """Add a skin of joints at rest at places (J, 3), metres, which all skins share."""
        if "skins" in self.json:
            bind: int = self.json["skins"][0]["inverseBindMatrices"]
        else:
            matrices = np.tile(np.eye(4, dtype=np.float32), (len(places), 1, 1))
            matrices[:, 3, :3] = -places  # column-major: the place is in the last row of the array
            bind = self.accessor(matrices, None)
        return self.add(
            "skins", name="skeleton", joints=nodes, skeleton=nodes[0], inverseBindMatrices=bind
        )

    def write(self, path: Path) -> None:
        """Write the .glb file, atomically; equal documents are equal files."""
        if self._end:
            self.json["buffers"] = [{"byteLength": self._end}]
        text = json.dumps(self.json, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + self._end
        start = struct.pack("<4sIIII", b"glTF", 2, total, len(text), JSON_CHUNK) + text
        start += struct.pack("<II", self._end, BINARY_CHUNK)
        write_pieces(path, itertools.chain([start], self._pieces()))

    def _pieces(self) -> Iterator[bytes | memoryview]:
        for array in self._arrays:
            for piece in array.pieces() if isinstance(array, Streamed) else (array,):
                yield as_bytes(piece.dtype, piece)
            yield bytes(-array.nbytes % 4)


def index_type(vertices: int) -> type[np.uint16 | np.uint32]:
    """Return the type of indices that may name so many vertices; its largest value is none."""
    return np.uint16 if vertices < 2**16 - 1 else np.uint32
