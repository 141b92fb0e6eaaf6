"""glTF 2.0 files (.glb and .gltf): the document, its data and its nodes, every size checked.

Khronos glTF 2.0 specification, sections 3.5 (scenes), 3.6 (binary data) and 4 (GLB).
Methods raise `ValueError` and its kin for whatever a document has wrong; callers turn those into
one `FormatError` by working inside `readable`.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import json
import os
import struct
import urllib.parse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float64Array
from hairkit.errors import DataError, FormatError, HairkitError, one_line
from hairkit.storage import MAX_FILE_BYTES, read_bytes

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""NumPy types by the numbers that glTF gives them."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
"""Numbers in one element of an accessor."""
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
MAX_JSON_BYTES = 64 * 2**20
"""Documents larger than this are refused: parsed, they take twenty times their size."""
_MAX_NODES = 100_000
_COMPRESSION = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")


@contextlib.contextmanager
def readable(source: str | os.PathLike[str], what: str) -> Iterator[None]:
    """Turn everything that a malformed document can raise into one `FormatError` of one line.

    A JSON document may hold any type at any place, so that reading it meets the errors of every
    operation on it.
    """
    try:
        # numbers beyond all bounds are found by what they lead to, not by NumPy's warnings
        with np.errstate(all="ignore"):
            yield
    except DataError as error:  # of a type, which does not know the file
        raise FormatError(f"{source}: not a readable {what} ({error})") from error
    except HairkitError:
        raise
    except KeyError as error:
        raise FormatError(f"{source}: not a readable {what} ({error} is missing)") from error
    except (ValueError, IndexError, TypeError, AttributeError, struct.error) as error:
        reason = one_line(error)[:200]
        raise FormatError(f"{source}: not a readable {what} ({reason})") from error
    except (RecursionError, OverflowError, MemoryError) as error:
        raise FormatError(f"{source}: not a readable {what} (too deep or too large)") from error


class GlbFile:
    """An open glTF file: `document` is its JSON, accessors and nodes are read by number."""

    def __init__(self, path: str | os.PathLike[str], limit: int = MAX_FILE_BYTES) -> None:
        """Read a file of at most `limit` bytes; side files must lie in its own folder."""
        self.path = Path(path)
        data = read_bytes(path, limit)
        self.bytes_read = len(data)
        """Bytes of the file and of what it brought in so far: a measure for what may come of it."""
        self._binary: memoryview | None = None
        self._buffers: dict[int, memoryview] = {}
        text: bytes | memoryview = data
        if data[:4] == b"glTF" or self.path.suffix.lower() == ".glb":
            text, self._binary = _chunks(data)
        if len(text) > MAX_JSON_BYTES:
            raise ValueError(f"its JSON has {len(text)} bytes, hairkit reads {MAX_JSON_BYTES}")
        document = json.loads(bytes(text))
        if not isinstance(document, dict):
            raise ValueError("its JSON is no object")
        self.document: dict[str, Any] = document
        wanted = {name for name in document.get("extensionsRequired", []) if name in _COMPRESSION}
        if wanted:
            raise ValueError(f"it is compressed with {wanted.pop()}: export it without compression")

    def accessor(self, number: int) -> npt.NDArray[Any]:
        """Return (count, width) elements as they are stored, read-only, not normalised."""
        accessor = self.item("accessors", number)
        if "sparse" in accessor or "bufferView" not in accessor:
            raise ValueError("it uses sparse or compressed accessors: export it without them")
        data = self.view(self.item("bufferViews", accessor["bufferView"]))
        count, width = _whole(accessor["count"]), WIDTHS[accessor["type"]]
        kind = np.dtype(COMPONENTS[accessor["componentType"]])
        view = self.document["bufferViews"][accessor["bufferView"]]
        stride = _whole(view.get("byteStride", width * kind.itemsize))
        start = _whole(accessor.get("byteOffset", 0))
        if count < 1 or stride < width * kind.itemsize:
            raise ValueError("an accessor's numbers make no sense")
        if start + (count - 1) * stride + width * kind.itemsize > len(data):
            raise ValueError("an accessor reaches beyond the file's data")
        return np.ndarray((count, width), kind, data, start, (stride, kind.itemsize))

    def numbers(self, number: int) -> Float64Array:
        """Return (count, width) values of an accessor, normalised where it says so."""
        rows = self.accessor(number)
        values: Float64Array = rows.astype(np.float64)
        if self.document["accessors"][number].get("normalized", False) and rows.dtype.kind in "iu":
            values = np.maximum(values / np.iinfo(rows.dtype).max, -1.0)
        return values

    def nodes_in_place(self) -> list[tuple[dict[str, Any], Float64Array]]:
        """Return the default scene's nodes with their (4, 4) transforms to the scene.

        Without scenes every node is a root. A node that is reached twice is an error.
        """
        return [(self.item("nodes", index), matrix) for index, matrix in self.placements().items()]

    def placements(self) -> dict[int, Float64Array]:
        """Return scene_from_node (4, 4) of every node of the default scene, by number."""
        nodes, scenes = self.document.get("nodes", []), self.document.get("scenes", [])
        if scenes:
            roots = self.item("scenes", self.document.get("scene", 0)).get("nodes", [])
        else:
            below = {child for node in nodes for child in node.get("children", [])}
            roots = [index for index in range(len(nodes)) if index not in below]
        pending = [(_whole(root), np.eye(4)) for root in reversed(roots)]
        found: dict[int, Float64Array] = {}
        while pending:
            index, above = pending.pop()
            if index in found or len(found) + len(pending) > _MAX_NODES:
                raise ValueError(f"more than {_MAX_NODES} nodes, or a loop of nodes")
            node = self.item("nodes", index)
            found[index] = above @ node_matrix(node)
            children = reversed(node.get("children", []))
            pending += [(_whole(child), found[index]) for child in children]
        return found

    def item(self, kind: str, number: int) -> dict[str, Any]:
        """Return an object of the document by its list and number."""
        items = self.document[kind]
        if not 0 <= _whole(number) < len(items):
            raise ValueError(f"{kind} has no number {number}")
        item: dict[str, Any] = items[number]
        return item

    def view(self, view: dict[str, Any]) -> memoryview:
        """Return the bytes of a buffer view."""
        data = self._buffer(_whole(view["buffer"]))
        start, length = _whole(view.get("byteOffset", 0)), _whole(view["byteLength"])
        if start + length > len(data):
            raise ValueError("a buffer view reaches beyond the file's data")
        return data[start : start + length]

    def _buffer(self, number: int) -> memoryview:
        if number not in self._buffers:
            buffer = self.item("buffers", number)
            data = self._buffer_data(buffer, number)
            length = _whole(buffer["byteLength"])
            if length > len(data):
                raise ValueError(f"buffer {number} has {len(data)} bytes, it claims {length}")
            self._buffers[number] = data[:length]
            if data is not self._binary:
                self.bytes_read += len(data)
        return self._buffers[number]

    def _buffer_data(self, buffer: dict[str, Any], number: int) -> memoryview:
        uri = buffer.get("uri")
        if uri is None:
            if number != 0 or self._binary is None:
                raise ValueError(f"buffer {number} has no data")
            return self._binary
        return self.side_data(uri, f"buffer {number}")

    def side_data(self, uri: str, what: str) -> memoryview:
        """Return the data of a URI: its own, or that of a file in the file's own folder."""
        if uri.startswith("data:"):
            return _decode_data_uri(uri)
        name = urllib.parse.unquote(uri)
        if name != Path(name).name or "\\" in name or ":" in name or name in ("", ".", ".."):
            raise ValueError(f"{what} lies outside the file's folder: {name[:80]!r}")
        file = self.path.parent / name
        if file.resolve().parent != self.path.parent.resolve():
            raise ValueError(f"{what} lies outside the file's folder: {name[:80]!r}")
        return memoryview(read_bytes(file))


def node_matrix(node: dict[str, Any]) -> Float64Array:
    """Return parent_from_node (4, 4) of a node's matrix, or its translation, rotation and scale."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], np.float64).reshape(4, 4).T
    else:
        rotation = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64)
        matrix = np.eye(4)
        turn = Rotation.from_quat(rotation).as_matrix()
        matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), np.float64)
        matrix[:3, 3] = node.get("translation", (0, 0, 0))
    if not np.isfinite(matrix).all():
        raise ValueError("a node's transform is not finite")
    return matrix


def _chunks(data: bytes) -> tuple[memoryview, memoryview | None]:
    """Return the JSON and the binary chunk of a .glb file."""
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != b"glTF" or version != 2 or length > len(data):
        raise ValueError("it is no whole glTF 2.0 binary")
    whole = memoryview(data)[:length]
    found: dict[int, memoryview] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > length:
            raise ValueError(f"a chunk of {size} bytes reaches beyond the file's end")
        found.setdefault(kind, whole[at + 8 : at + 8 + size])
        at += 8 + size
    return found[JSON_CHUNK], found.get(BINARY_CHUNK)


def _decode_data_uri(uri: str) -> memoryview:
    head, comma, body = uri.partition(",")
    if not comma or not head.endswith(";base64"):
        raise ValueError("a data URI is not base64")
    try:
        return memoryview(base64.b64decode(body, validate=True))
    except binascii.Error as error:
        raise ValueError(f"a data URI is damaged: {error}") from error


def _whole(value: Any) -> int:
    """Return a number of the document that must be a whole one, not negative."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != int(value):
        raise ValueError(f"{str(value)[:40]!r} where a whole number is expected")
    if value < 0:
        raise ValueError(f"{value} where no negative number can be")
    return int(value)
