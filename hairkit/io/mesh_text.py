"""Triangle meshes as they stand in OBJ and PLY files, with what may mark a scalp."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.storage import read_bytes

MAX_MESH_BYTES = 512 * 2**20
MAX_VERTICES = 2_000_000
MAX_FACES = 4_000_000

_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_PLY_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True, eq=False)
class FileMesh:
    """A mesh in its file's own units and axes; vertices keep the file's order and numbers."""

    vertices: Float64Array
    """(V, 3)."""
    faces: Int64Array
    """(F, 3)."""
    uv: Float64Array | None = None
    """(V, 2); vertices that a texture seam needs twice are repeated at the end."""
    colours: Float64Array | None = None
    """(V, 3) painted colours in [0, 1]."""
    groups: dict[str, Float64Array] = field(default_factory=dict)
    """Lower-case name of a group, material or vertex property: (V,) weights in [0, 1]."""


def checked_mesh(mesh: FileMesh, path: str | os.PathLike[str]) -> FileMesh:
    """Return `mesh` without collapsed faces; `FormatError` naming `path` when it is unusable."""
    if not (0 < len(mesh.vertices) <= MAX_VERTICES and 0 < len(mesh.faces) <= MAX_FACES):
        raise FormatError(
            f"{path}: {len(mesh.vertices)} vertices and {len(mesh.faces)} triangles, expected 1 to "
            f"{MAX_VERTICES} and 1 to {MAX_FACES}"
        )
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise FormatError(f"{path}: a face names a vertex that does not exist")
    arrays = [mesh.vertices, mesh.uv, mesh.colours, *mesh.groups.values()]
    if not all(np.isfinite(array).all() for array in arrays if array is not None):
        raise FormatError(f"{path}: holds coordinates or weights that are not finite numbers")
    if np.abs(mesh.vertices).max() > 1e9:
        raise FormatError(f"{path}: coordinates up to {np.abs(mesh.vertices).max():.3g}")
    a, b, c = mesh.faces.T
    kept = mesh.faces[(a != b) & (b != c) & (c != a)]
    if not len(kept):
        raise FormatError(f"{path}: every face is collapsed to a line or a point")
    return FileMesh(mesh.vertices, kept, mesh.uv, mesh.colours, mesh.groups)


def vertex_share(faces: Int64Array, chosen: npt.NDArray[np.bool_], count: int) -> Float64Array:
    """Return (count,) for each vertex the share of its faces that are `chosen` (F,)."""
    uses = np.bincount(faces.ravel(), minlength=count)
    chosen_uses = np.bincount(faces[chosen].ravel(), minlength=count)
    return np.asarray(chosen_uses / np.maximum(uses, 1), np.float64)


def read_obj(path: str | os.PathLike[str]) -> FileMesh:
    """Return the mesh of a Wavefront OBJ file: `v` (with colours), `vt`, `f`, `g`, `o`, `usemtl`.

    Polygons are cut into fans; a group's or material's weight at a vertex is the share of the
    vertex's faces that are in it. Raises `FormatError` with the line's number.
    """
    parser = _ObjParser()
    text = read_bytes(path, MAX_MESH_BYTES).decode("latin-1")
    for number, line in enumerate(text.splitlines(), 1):
        try:
            parser.read(line)
        except (ValueError, IndexError, OverflowError) as error:
            raise FormatError(f"{path}: line {number} is not OBJ ({error})") from error
    return checked_mesh(parser.mesh(), path)


class _ObjParser:
    def __init__(self) -> None:
        self.vertices: list[list[float]] = []
        self.texture: list[list[float]] = []
        self.faces: list[tuple[int, int, int]] = []
        self.corners: list[tuple[int, int, int]] = []
        self.face_group: list[int] = []
        self.groups: list[frozenset[str]] = [frozenset()]
        self.names: dict[str, frozenset[str]] = {}

    def read(self, line: str) -> None:
        kind, _, rest = line.partition(" ")
        if kind == "v":
            values = [float(value) for value in rest.split()]
            if len(values) < 3:
                raise ValueError("a vertex needs three coordinates")
            self.vertices.append(values[:3] + (values[3:6] if len(values) >= 6 else []))
        elif kind == "vt":
            self.texture.append([float(value) for value in rest.split()[:2]])
        elif kind == "f":
            self._face(rest.split())
        elif kind in ("g", "o", "usemtl"):
            self.names[kind] = frozenset(rest.lower().split())
            self.groups.append(frozenset().union(*self.names.values()))

    def _face(self, items: list[str]) -> None:
        corners, textures = [], []
        for item in items:
            parts = item.split("/")
            corners.append(_obj_index(parts[0], len(self.vertices)))
            has_texture = len(parts) > 1 and parts[1]
            textures.append(_obj_index(parts[1], len(self.texture)) if has_texture else -1)
        if len(corners) < 3:
            raise ValueError("a face needs three corners")
        for i in range(1, len(corners) - 1):
            self.faces.append((corners[0], corners[i], corners[i + 1]))
            self.corners.append((textures[0], textures[i], textures[i + 1]))
            self.face_group.append(len(self.groups) - 1)

    def mesh(self) -> FileMesh:
        coloured = [len(row) == 6 for row in self.vertices]
        rows = [row[:3] for row in self.vertices]
        vertices = np.array(rows, np.float64).reshape(-1, 3)
        colours = None
        if coloured and all(coloured):
            colours = _unit_colours(np.array([row[3:] for row in self.vertices], np.float64))
        faces = np.array(self.faces, np.int64).reshape(-1, 3)
        corners = np.array(self.corners, np.int64).reshape(-1, 3)
        names = sorted(frozenset().union(*self.groups))
        member = np.array(self.face_group, np.int64)
        groups = {
            name: vertex_share(
                faces, np.array([name in group for group in self.groups])[member], len(vertices)
            )
            for name in names
        }
        if not self.texture or (corners < 0).any():
            return FileMesh(vertices, faces, None, colours, groups)
        texture = np.array([[*row, 0.0, 0.0][:2] for row in self.texture], np.float64)
        return _split_at_seams(FileMesh(vertices, faces, None, colours, groups), corners, texture)


def _obj_index(text: str, count: int) -> int:
    index = int(text)
    resolved = index - 1 if index > 0 else count + index
    if index == 0 or not 0 <= resolved < count:
        raise ValueError(f"index {index} of {count}")
    return resolved


def _unit_colours(colours: Float64Array) -> Float64Array:
    """Colours in [0, 1], whether they were written so or as 0 to 255."""
    return colours / 255.0 if len(colours) and colours.max() > 1.0 else colours


def _split_at_seams(mesh: FileMesh, corners: Int64Array, texture: Float64Array) -> FileMesh:
    """Repeat vertices that carry several texture coordinates; the first stay in their places."""
    count = len(mesh.vertices)
    key = mesh.faces.ravel() * len(texture) + corners.ravel()
    pairs, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    vertex = pairs[order] // len(texture)
    leading = np.zeros(len(order), bool)
    leading[np.unique(vertex, return_index=True)[1]] = True
    slot = np.where(leading, vertex, count + np.cumsum(~leading) - 1)
    source = np.concatenate([np.arange(count), vertex[~leading]])
    uv = np.zeros((len(source), 2))
    uv[slot] = texture[pairs[order] % len(texture)]
    rank = np.empty(len(order), np.int64)
    rank[order] = slot
    colours = None if mesh.colours is None else mesh.colours[source]
    groups = {name: weight[source] for name, weight in mesh.groups.items()}
    faces = rank[inverse.reshape(-1)].reshape(-1, 3)
    return FileMesh(mesh.vertices[source], faces, uv, colours, groups)


def read_ply(path: str | os.PathLike[str]) -> FileMesh:
    """Return the mesh of a PLY file, text or binary, with colours, uv and further properties.

    Every scalar vertex property that is no position, normal, colour or texture coordinate becomes
    a group of that name, with values above 1 divided by 255. Raises `FormatError`.
    """
    data = read_bytes(path, MAX_MESH_BYTES)
    try:
        elements, order, body = _ply_header(data)
        tables = _ply_tables(elements, order, body)
        mesh = _ply_mesh(tables)
    except (ValueError, IndexError, KeyError, TypeError, OverflowError) as error:
        raise FormatError(f"{path}: not a readable PLY mesh ({error})") from error
    return checked_mesh(mesh, path)


_Elements = list[tuple[str, int, list[tuple[str, ...]]]]


def _ply_header(data: bytes) -> tuple[_Elements, str, bytes]:
    if not data.startswith(b"ply"):
        raise ValueError("it does not begin with 'ply'")
    end = data.index(b"end_header")
    body = data.index(b"\n", end) + 1
    elements: _Elements = []
    order = ""
    for line in data[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            order = _PLY_ORDERS[words[1]]
        elif words[:1] == ["element"]:
            if not 0 <= int(words[2]) <= len(data):
                raise ValueError(f"{words[2]} of {words[1]} in {len(data)} bytes")
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(tuple(words[1:]))
    if not order:
        raise ValueError("its header names no format")
    return elements, order, data[body:]


def _ply_tables(elements: _Elements, order: str, body: bytes) -> dict[str, dict[str, Any]]:
    """Per element name its columns: arrays for scalars, lists of tuples for lists."""
    tables: dict[str, dict[str, Any]] = {}
    words = body.split() if order == "=" else []
    at = 0
    for name, count, properties in elements:
        lists = [item for item in properties if item[0] == "list"]
        if order == "=":
            tables[name], at = _ply_text(properties, count, words, at)
        elif not lists:
            kind = np.dtype([(item[1], order + _PLY_TYPES[item[0]]) for item in properties])
            rows = np.frombuffer(body, kind, count, at)
            tables[name] = {item[1]: rows[item[1]] for item in properties}
            at += kind.itemsize * count
        else:
            tables[name], at = _ply_lists(properties, count, order, body, at)
    return tables


def _ply_text(
    properties: list[tuple[str, ...]], count: int, words: list[bytes], at: int
) -> tuple[dict[str, Any], int]:
    if not any(item[0] == "list" for item in properties):
        width = len(properties)
        if at + width * count > len(words):
            raise ValueError("it ends too early")
        rows = np.array(words[at : at + width * count], np.float64).reshape(count, width)
        return {item[1]: rows[:, k] for k, item in enumerate(properties)}, at + width * count
    columns: dict[str, Any] = {item[-1]: [] for item in properties}
    for _ in range(count):
        for item in properties:
            length = int(words[at]) if item[0] == "list" else 1
            first = at + (item[0] == "list")
            if length < 0 or first + length > len(words):
                raise ValueError("it ends too early")
            values = tuple(float(word) for word in words[first : first + length])
            columns[item[-1]].append(values if item[0] == "list" else values[0])
            at = first + length
    return columns, at


def _ply_lists(
    properties: list[tuple[str, ...]], count: int, order: str, body: bytes, at: int
) -> tuple[dict[str, Any], int]:
    columns: dict[str, Any] = {item[-1]: [] for item in properties}
    kinds = [
        [
            np.dtype(order + _PLY_TYPES[kind])
            for kind in (item[1:3] if item[0] == "list" else item[:1])
        ]
        for item in properties
    ]
    for _ in range(count):
        for item, kind in zip(properties, kinds, strict=True):
            length = 1
            if item[0] == "list":
                length = int(np.frombuffer(body, kind[0], 1, at)[0])
                at += kind[0].itemsize
            values = np.frombuffer(body, kind[-1], length, at) if length > 0 else np.zeros(0)
            at += kind[-1].itemsize * max(length, 0)
            columns[item[-1]].append(tuple(values.tolist()) if item[0] == "list" else values[0])
    return columns, at


@np.errstate(invalid="ignore")  # damaged numbers are found by whoever reads on
def _ply_mesh(tables: dict[str, dict[str, Any]]) -> FileMesh:
    columns = {key.lower(): value for key, value in tables["vertex"].items()}
    vertices = np.stack([np.asarray(columns.pop(axis), np.float64) for axis in "xyz"], axis=1)
    polygons = tables["face"].get("vertex_indices", tables["face"].get("vertex_index"))
    if polygons is None:
        raise ValueError("its faces have no vertex_indices")
    faces = [
        (polygon[0], polygon[i], polygon[i + 1])
        for polygon in polygons
        for i in range(1, len(polygon) - 1)
    ]
    colours = _ply_columns(columns, [("red", "green", "blue"), ("r", "g", "b")])
    uv = _ply_columns(columns, [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
    for name in ("nx", "ny", "nz", "alpha", "a"):
        columns.pop(name, None)
    groups = {name: np.asarray(value, np.float64) for name, value in columns.items()}
    groups = {name: value / 255 if value.max() > 1 else value for name, value in groups.items()}
    return FileMesh(
        vertices,
        np.array(faces, np.int64).reshape(-1, 3),
        uv,
        None if colours is None else _unit_colours(colours),
        groups,
    )


def _ply_columns(columns: dict[str, Any], names: list[tuple[str, ...]]) -> Float64Array | None:
    for wanted in names:
        if all(name in columns for name in wanted):
            return np.stack([np.asarray(columns.pop(name), np.float64) for name in wanted], axis=1)
    return None
