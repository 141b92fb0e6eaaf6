"""Triangle meshes of OBJ and PLY files, with what may mark a scalp.

PLY is read by trimesh, whose reader neither hangs nor allocates more than a damaged file is worth;
it accepts text files that end early, so that the counts are compared with the header here. OBJ is
read here: trimesh (5.2.0) leaves out the vertices that no face uses, which renumbers the rest, and
joins groups, so that landmarks and the scalp's group would be lost.
STL files are not read, because nothing in them can mark a scalp.
"""

from __future__ import annotations

import io
import logging
import os
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError, one_line
from hairkit.io.textures import read_maps, read_mtl
from hairkit.storage import read_bytes
from hairkit.types.skin import Texture

_log = logging.getLogger("hairkit")

MAX_MESH_BYTES = 512 * 2**20
MAX_VERTICES = 2_000_000
MAX_FACES = 4_000_000

_MAX_PLY_HEADER = 2**16
"""Bytes in which a PLY header ends; trimesh reads the lines of an endless one for minutes."""
_MAX_REASON = 200
_PLY_TEXTURE = re.compile(rb"^comment TextureFile (.+?)\r?$", re.MULTILINE)


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
    maps: dict[str, Texture] = field(default_factory=dict)
    """Textures by the names of the fields of `SkinMaps`."""
    shapes: dict[str, Float64Array] = field(default_factory=dict)
    """Name of a blendshape: (V, 3) offsets."""


def check_mesh(mesh: FileMesh, path: str | os.PathLike[str]) -> FileMesh:
    """Return `mesh` without collapsed faces; `FormatError` naming `path` when it is unusable."""
    if not (0 < len(mesh.vertices) <= MAX_VERTICES and 0 < len(mesh.faces) <= MAX_FACES):
        raise FormatError(
            f"{path}: {len(mesh.vertices)} vertices and {len(mesh.faces)} triangles, expected 1 to "
            f"{MAX_VERTICES} and 1 to {MAX_FACES}"
        )
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise FormatError(f"{path}: a face names a vertex that does not exist")
    arrays = [mesh.vertices, mesh.uv, mesh.colours, *mesh.groups.values(), *mesh.shapes.values()]
    if not all(np.isfinite(array).all() for array in arrays if array is not None):
        raise FormatError(f"{path}: holds coordinates or weights that are not finite numbers")
    if np.abs(mesh.vertices).max() > 1e9:
        raise FormatError(f"{path}: coordinates up to {np.abs(mesh.vertices).max():.3g}")
    a, b, c = mesh.faces.T
    kept = mesh.faces[(a != b) & (b != c) & (c != a)]
    if not len(kept):
        raise FormatError(f"{path}: every face is collapsed to a line or a point")
    return replace(mesh, faces=kept)


def vertex_share(faces: Int64Array, chosen: npt.NDArray[np.bool_], count: int) -> Float64Array:
    """Return (count,) for each vertex the share of its faces that are `chosen` (F,)."""
    uses = np.bincount(faces.ravel(), minlength=count)
    chosen_uses = np.bincount(faces[chosen].ravel(), minlength=count)
    return np.asarray(chosen_uses / np.maximum(uses, 1), np.float64)


def read_obj(path: str | os.PathLike[str]) -> FileMesh:
    """Return the mesh of a Wavefront OBJ file: `v` (with colours), `vt`, `f`, `g`, `o`, `usemtl`.

    Polygons are cut into fans; a group's or material's weight at a vertex is the share of the
    vertex's faces that are in it. Maps are those of the material, of the files named by `mtllib`,
    that most faces have of those with an albedo. Raises `FormatError` with the line's number.
    """
    parser = _ObjParser()
    text = read_bytes(path, MAX_MESH_BYTES).decode("latin-1")
    for number, line in enumerate(text.splitlines(), 1):
        try:
            parser.read(line)
        except (ValueError, IndexError, OverflowError) as error:
            raise FormatError(f"{path}: line {number} is not OBJ ({error})") from error
    mesh = parser.mesh()
    if mesh.uv is None:
        return check_mesh(mesh, path)
    return check_mesh(replace(mesh, maps=_obj_maps(Path(path), parser)), path)


def obj_side_files(path: Path) -> list[Path]:
    """Return the MTL files of an OBJ file and their pictures; none for other kinds of files."""
    if path.suffix.lower() != ".obj":
        return []
    text = read_bytes(path, MAX_MESH_BYTES).decode("latin-1")
    found = _libraries(path, re.findall(r"^mtllib (.+)$", text, re.MULTILINE))
    pictures = [each for file in found if file.exists() for each in read_mtl(file).values()]
    return [*found, *(picture for maps in pictures for picture in maps.values())]


def _libraries(path: Path, names: list[str]) -> list[Path]:
    """Return the MTL files of these names beside an OBJ file."""
    return [path.with_name(Path(name.strip().replace("\\", "/")).name) for name in names]


def _obj_maps(path: Path, parser: _ObjParser) -> dict[str, Texture]:
    materials: dict[str, dict[str, Path]] = {}
    for library in _libraries(path, parser.libraries):
        if library.exists():
            materials |= read_mtl(library)
        else:
            _log.warning("%s: no such file; the head has no texture maps", library)
    coloured = [name for name in materials if "albedo" in materials[name]] or list(materials)
    if not coloured:
        return {}
    chosen = max(coloured, key=lambda name: parser.uses[name])
    others = sorted(name for name in coloured if name != chosen and parser.uses[name])
    if others:
        _log.warning("%s: of several materials only %s is used", path, chosen)
    return read_maps(materials[chosen])


class _ObjParser:
    def __init__(self) -> None:
        self.vertices: list[list[float]] = []
        self.texture: list[list[float]] = []
        self.faces: list[tuple[int, int, int]] = []
        self.corners: list[tuple[int, int, int]] = []
        self.face_group: list[int] = []
        self.groups: list[frozenset[str]] = [frozenset()]
        self.names: dict[str, frozenset[str]] = {}
        self.libraries: list[str] = []
        self.material = ""
        self.uses: Counter[str] = Counter()

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
            if kind == "usemtl":
                self.material = rest.strip().lower()
        elif kind == "mtllib":
            self.libraries.append(rest.strip())

    def _face(self, items: list[str]) -> None:
        corners, textures = [], []
        for item in items:
            parts = item.split("/")
            corners.append(_obj_index(parts[0], len(self.vertices)))
            has_texture = len(parts) > 1 and parts[1]
            textures.append(_obj_index(parts[1], len(self.texture)) if has_texture else -1)
        if len(corners) < 3:
            raise ValueError("a face needs three corners")
        self.uses[self.material] += 1
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

    A comment `TextureFile NAME`, as MeshLab writes it, names the albedo beside the file. Every
    scalar vertex property that is no position, normal, colour or texture coordinate becomes
    a group of that name, with values above 1 divided by 255. Raises `FormatError`.
    """
    from trimesh.exchange.ply import load_ply

    data = read_bytes(path, MAX_MESH_BYTES)
    try:
        if not data.startswith(b"ply") or b"end_header" not in data[:_MAX_PLY_HEADER]:
            raise ValueError("it has no header from 'ply' to 'end_header'")
        with np.errstate(all="ignore"):  # damaged numbers are found by `check_mesh`
            mesh = _ply_mesh(load_ply(io.BytesIO(data), fix_texture=False, skip_materials=True))
            named = _PLY_TEXTURE.search(data[: data.find(b"end_header")])
    except Exception as error:  # trimesh raises almost anything on damaged files
        reason = one_line(f"{type(error).__name__}: {error}")[:_MAX_REASON]
        raise FormatError(f"{path}: not a readable PLY mesh ({reason})") from error
    if named is not None and mesh.uv is not None:
        picture = Path(named[1].decode("latin-1").replace("\\", "/")).name
        mesh = replace(mesh, maps=read_maps({"albedo": Path(path).with_name(picture)}))
    return check_mesh(mesh, path)


def _ply_mesh(found: dict[str, Any]) -> FileMesh:
    """Return the mesh of what trimesh read, which must be as much as the header says."""
    elements = found["metadata"]["_ply_raw"]
    for name in ("vertex", "face"):
        wanted, rows = elements[name]["length"], elements[name]["data"]
        if any(len(rows[column]) != wanted for column in elements[name]["properties"]):
            raise ValueError(f"it ends before the last {name} of {wanted}")
    table = elements["vertex"]
    columns = {
        name.lower(): np.asarray(table["data"][name], np.float64).reshape(-1)
        for name in table["properties"]
    }
    vertices = np.stack([columns.pop(axis) for axis in "xyz"], axis=1)
    colours = _ply_columns(columns, [("red", "green", "blue"), ("r", "g", "b")])
    uv = _ply_columns(columns, [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
    for name in ("nx", "ny", "nz", "alpha", "a"):
        columns.pop(name, None)
    return FileMesh(
        vertices,
        np.asarray(found["faces"], np.int64).reshape(-1, 3),
        uv,
        None if colours is None else _unit_colours(colours),
        {name: _unit_colours(values) for name, values in columns.items()},
    )


def _ply_columns(columns: dict[str, Any], names: list[tuple[str, ...]]) -> Float64Array | None:
    for wanted in names:
        if all(name in columns for name in wanted):
            return np.stack([columns.pop(name) for name in wanted], axis=1)
    return None
