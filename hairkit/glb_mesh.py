"""The triangle mesh of a binary glTF file (.glb), all its nodes put together in place."""

from __future__ import annotations

import json
import os
import struct
from typing import Any

import numpy as np

from hairkit.errors import FormatError
from hairkit.mesh_files import MAX_FACES, MAX_VERTICES, FileMesh, checked_mesh, read_mesh_bytes
from hairkit.stored import Float64Array

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_MAX_NODES = 10_000
_JSON, _BINARY = 0x4E4F534A, 0x004E4942


def read_glb(path: str | os.PathLike[str]) -> FileMesh:
    """Return the triangles of the default scene in its frame, with TEXCOORD_0 and COLOR_0.

    Each node, mesh and material name becomes a group, and so does each custom scalar attribute
    (`_SCALP` is the group `scalp`). Raises `FormatError` for damaged, compressed or sparse files.
    """
    try:
        document, binary = _chunks(read_mesh_bytes(path))
        parts = _parts(document, binary)
        if not parts:
            raise ValueError("it holds no triangles")
        return checked_mesh(_joined(parts), path)
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{path}: not a readable GLB mesh ({error})") from error
    except (RecursionError, OverflowError, MemoryError) as error:
        raise FormatError(f"{path}: not a readable GLB mesh (too deep or too large)") from error


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != b"glTF" or version != 2 or length > len(data):
        raise ValueError("it is no whole glTF 2.0 binary")
    found: dict[int, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<II", data, at)
        found.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    return json.loads(found[_JSON]), found.get(_BINARY, b"")


def _parts(document: dict[str, Any], binary: bytes) -> list[FileMesh]:
    nodes = document.get("nodes", [])
    scenes = document.get("scenes", [])
    roots = scenes[document.get("scene", 0)].get("nodes", []) if scenes else range(len(nodes))
    pending = [(int(root), np.eye(4)) for root in roots]
    parts: list[FileMesh] = []
    seen = 0
    while pending:
        index, above = pending.pop()
        seen += 1
        if seen + len(pending) > _MAX_NODES or index < 0:
            raise ValueError(f"more than {_MAX_NODES} nodes, or a loop of nodes")
        node = nodes[index]
        placed = above @ _node_matrix(node)
        pending += [(int(child), placed) for child in node.get("children", [])]
        if "mesh" in node:
            mesh = document["meshes"][node["mesh"]]
            names = [node.get("name", ""), mesh.get("name", "")]
            for primitive in mesh["primitives"]:
                if primitive.get("mode", 4) == 4:
                    parts.append(_primitive(document, binary, primitive, placed, names))
            if sum(len(part.vertices) for part in parts) > MAX_VERTICES:
                raise ValueError(f"it has more than {MAX_VERTICES} vertices")
    return parts


def _node_matrix(node: dict[str, Any]) -> Float64Array:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _primitive(
    document: dict[str, Any],
    binary: bytes,
    primitive: dict[str, Any],
    placed: Float64Array,
    names: list[str],
) -> FileMesh:
    if primitive.get("extensions", {}).keys() & {"KHR_draco_mesh_compression"}:
        raise ValueError("it is compressed with Draco: export it without compression")
    attributes = primitive["attributes"]
    points = _accessor(document, binary, attributes["POSITION"])
    vertices = points @ placed[:3, :3].T + placed[:3, 3]
    if "indices" in primitive:
        index = _accessor(document, binary, primitive["indices"]).ravel().astype(np.int64)
    else:
        index = np.arange(len(vertices))
    if len(index) > 3 * MAX_FACES:
        raise ValueError(f"{len(index) // 3} triangles in one part")
    if "material" in primitive:
        names = [*names, document["materials"][primitive["material"]].get("name", "")]
    groups = {name.lower(): np.ones(len(vertices)) for name in names if name}
    for name, number in attributes.items():
        if name.startswith("_") and len(values := _accessor(document, binary, number)) == len(
            points
        ):
            groups[name[1:].lower()] = values[:, 0]
    optional = {
        name: _accessor(document, binary, attributes[name]) if name in attributes else None
        for name in ("TEXCOORD_0", "COLOR_0")
    }
    uv, colours = optional["TEXCOORD_0"], optional["COLOR_0"]
    if any(extra is not None and len(extra) != len(points) for extra in (uv, colours)):
        raise ValueError("its attributes differ in length")
    # glTF counts v from the top of the picture, this project and OBJ from the bottom.
    flipped = None if uv is None else np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1)
    return FileMesh(
        vertices, index[: len(index) // 3 * 3].reshape(-1, 3), flipped,
        None if colours is None else colours[:, :3], groups,
    )  # fmt: skip


def _accessor(document: dict[str, Any], binary: bytes, number: int) -> Float64Array:
    """(count, width) values of an accessor, normalised where it says so."""
    accessor = document["accessors"][number]
    if "sparse" in accessor or "bufferView" not in accessor:
        raise ValueError("it uses sparse or compressed accessors: export it without them")
    view = document["bufferViews"][accessor["bufferView"]]
    if view["buffer"] != 0 or "uri" in document["buffers"][0]:
        raise ValueError("its data lie in another file: export it as one .glb")
    count, width = int(accessor["count"]), _WIDTHS[accessor["type"]]
    kind = np.dtype(_COMPONENTS[accessor["componentType"]])
    stride = int(view.get("byteStride", width * kind.itemsize))
    start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    if not (0 < count <= 3 * MAX_VERTICES and start >= 0 and stride >= width * kind.itemsize):
        raise ValueError("an accessor's numbers make no sense")
    if start + (count - 1) * stride + width * kind.itemsize > len(binary):
        raise ValueError("an accessor reaches beyond the file's data")
    rows = np.ndarray((count, width), kind, binary, start, (stride, kind.itemsize))
    values = rows.astype(np.float64)
    if accessor.get("normalized", False) and kind.kind in "iu":
        values = np.maximum(values / np.iinfo(kind).max, -1.0)
    return values


def _joined(parts: list[FileMesh]) -> FileMesh:
    counts = [len(part.vertices) for part in parts]
    firsts = np.cumsum([0, *counts[:-1]])
    faces = np.concatenate([part.faces + first for part, first in zip(parts, firsts, strict=True)])
    for part in parts:
        if len(part.faces) and part.faces.max() >= len(part.vertices):
            raise ValueError("a face names a vertex that does not exist")
    uv = [part.uv for part in parts if part.uv is not None]
    colours = [part.colours for part in parts if part.colours is not None]
    names = sorted({name for part in parts for name in part.groups})
    groups = {
        name: np.concatenate(
            [part.groups.get(name, np.zeros(len(part.vertices))) for part in parts]
        )
        for name in names
    }
    return FileMesh(
        np.concatenate([part.vertices for part in parts]),
        faces,
        np.concatenate(uv) if len(uv) == len(parts) else None,
        np.concatenate(colours) if len(colours) == len(parts) else None,
        groups,
    )
