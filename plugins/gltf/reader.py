"""Read the lines of a glTF file as strands; what hairkit wrote comes back as it was."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.grooming.adopt_strands import ImportOptions, adopt
from hairkit.grooming.curve_sets import CurveSet, join_sets, strands_of
from hairkit.head_model.scalp import bind
from hairkit.head_model.skinning import JOINT_NAMES
from hairkit.io.glb_file import GlbFile, readable
from hairkit.io.glb_skin import material_maps, shape_offsets
from hairkit.io.plain_settings import capsules_of, made, ties_of
from hairkit.io.polylines import join_segments
from hairkit.io.textures import as_maps
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Head
from hairkit.types.skin import Blendshape

from .extras import VERSION, with_extras
from .options import Options

_LINES, _LOOP, _STRIP, _TRIANGLES = 1, 2, 3, 4
_MAX_GROUP = 2**31 - 1
_LEAST_BYTES = 4
"""Of a file for each point that is made of it: positions alone take twelve."""
_FARTHEST = 1e5
"""Positions of a head and its hair, in any unit; beyond, 32-bit floats have no millimetres."""


def read_gltf_groom(path: str | os.PathLike[str], options: Options) -> Groom:
    """Return the strands in a file's LINES, LINE_STRIP and LINE_LOOP primitives as a groom.

    The transforms of nodes are applied; a skinned mesh is taken in its bind pose. A file of
    hairkit's brings head, skeleton, capsules, material and physics along, others get what
    `hairkit.grooming.adopt_strands.adopt` says.

    Raises
    ------
    FormatError
        The file is damaged, or holds no lines.
    """
    with readable(path, "glTF groom"):
        file = GlbFile(path)
        own = _own_extras(file)
        metres = 1.0 if own else options.metres
        parts = _parts(file, metres)
        if not parts:
            raise FormatError(
                f"{path}: holds no lines; ribbons and cards cannot be turned back into strands:"
                " export the hair as lines or curves"
            )
        strands, _ = strands_of(join_sets(parts), path)
        head = _own_head(file, own) if own else None
        material = made(HairMaterial, own["material"]) if own else None
        physics = made(HairPhysics, own["physics"]) if own else None
        ties = ties_of(own) if own else ()
    if head is not None and options.head is None and material is not None:
        triangle, barycentric = bind(strands.roots, head)
        groom = Groom(strands, head, triangle, barycentric, material)
        groom.check_reach(path)
    else:
        groom = adopt(strands, ImportOptions(options.head), path, material, head)
    return groom if physics is None else replace(groom, physics=physics, ties=ties)


def _own_extras(file: GlbFile) -> dict[str, Any] | None:
    """Return what hairkit noted in its file, or None in files of others."""
    extras = file.document.get("extras")
    own = extras.get("hairkit") if isinstance(extras, dict) else None
    if own is not None and own["version"] != VERSION:
        raise ValueError(f"it is of hairkit's form {own['version']}, this hairkit reads {VERSION}")
    return own


def _parts(file: GlbFile, metres: float) -> list[CurveSet]:
    parts: list[CurveSet] = []
    read = 0
    for node, placed in file.nodes_in_place():
        if "mesh" not in node:
            continue
        # glTF 2.0, 3.7.3.3: the transform of a skinned mesh's own node is ignored
        matrix = np.eye(4) if "skin" in node else placed
        for primitive in file.document["meshes"][node["mesh"]]["primitives"]:
            if primitive.get("mode", _TRIANGLES) not in (_LINES, _LOOP, _STRIP):
                continue
            part = _part(file, primitive, matrix, metres)
            parts.append(part)
            read += len(part.points)
            if _LEAST_BYTES * read > file.bytes_read:
                raise ValueError("its meshes use the same data over and over")
    return parts


def _part(
    file: GlbFile, primitive: dict[str, Any], matrix: Float64Array, metres: float
) -> CurveSet:
    attributes = primitive["attributes"]
    points = file.accessor(attributes["POSITION"])
    if points.shape[1] != 3 or points.dtype != np.float32:
        raise ValueError("positions are not three 32-bit floats each")
    if not np.isfinite(points).all():
        raise ValueError("positions are not finite numbers")
    segments = _segments(file, primitive, len(points))
    if "_STRAND_ID" not in attributes:
        segments = _weld(segments, points)
    order, counts = join_segments(segments, len(points))
    if not np.array_equal(matrix, np.eye(4)) or metres != 1:
        points = metres * (points @ matrix[:3, :3].T + matrix[:3, 3])
    if not (np.abs(points) <= _FARTHEST).all():
        raise ValueError(f"positions lie beyond {_FARTHEST:g} m")
    custom = _Custom(file, primitive, order, np.cumsum(counts) - counts)
    radius, u, v = (custom.of_points(name) for name in ("_RADIUS", "_ROOT_U", "_ROOT_V"))
    uv = None
    if u is not None and v is not None:
        # glTF counts v from the top of the picture, this project upwards
        uv = np.stack([u, 1 - v], axis=1)[custom.first]
    shade = file.numbers(attributes["COLOR_0"]) if "COLOR_0" in attributes else None
    if shade is not None and (len(shade) != len(points) or not np.isfinite(shade).all()):
        raise ValueError("COLOR_0 is not a finite colour for each point")
    if radius is not None and (radius < 0).any():
        raise ValueError("a radius is below 0")
    return CurveSet(
        points[order].astype(np.float32),
        counts,
        None if radius is None else (2 * radius).astype(np.float32),
        None if uv is None else uv.astype(np.float32),
        None if shade is None else shade[order, :3].astype(np.float32),
        custom.of_strands("group"),
        custom.of_strands("guide"),
    )


@dataclass(frozen=True, eq=False)
class _Custom:
    """The attributes that hairkit adds to lines."""

    file: GlbFile
    primitive: dict[str, Any]
    order: Int64Array
    """(P,) vertices in the order of the strands."""
    first: Int64Array
    """(S,) where in that order each strand starts."""

    def of_points(self, name: str) -> Float64Array | None:
        """Return (P,) values, None where the attribute is missing."""
        attributes = self.primitive["attributes"]
        if name not in attributes:
            return None
        values = self.file.numbers(attributes[name])
        count = self.file.item("accessors", attributes["POSITION"])["count"]
        if values.shape != (count, 1) or not np.isfinite(values).all():
            raise ValueError(f"{name} is not a finite number for each point")
        return np.asarray(values[self.order, 0])

    def of_strands(self, name: str) -> Int64Array | None:
        """Return (S,) whole numbers: of the attribute, or one for all strands in the extras."""
        values = self.of_points(f"_{name.upper()}")
        constant = _read_extras(self.primitive).get(name)
        if values is None and constant is None:
            return None
        column = np.full(len(self.first), constant, np.float64)
        if values is not None:
            column = values[self.first]
        if not (np.abs(column) <= _MAX_GROUP).all():
            raise ValueError(f"_{name.upper()} is beyond what 32 bits hold")
        return np.rint(column).astype(np.int64)


def _read_extras(primitive: dict[str, Any]) -> dict[str, Any]:
    extras = primitive.get("extras")
    own = extras.get("hairkit") if isinstance(extras, dict) else None
    return own if isinstance(own, dict) else {}


def _segments(file: GlbFile, primitive: dict[str, Any], vertices: int) -> Int64Array:
    """Return (M, 2) vertex numbers of a primitive's segments."""
    if "indices" in primitive:
        stored = file.accessor(primitive["indices"])
        if stored.shape[1] != 1 or stored.dtype.kind != "u":
            raise ValueError("indices are not whole numbers")
        index = stored[:, 0].astype(np.int64)
        # the largest number starts a new strip (EXT_mesh_primitive_restart)
        restart = np.iinfo(stored.dtype).max if primitive["mode"] != _LINES else -1
    else:
        index, restart = np.arange(vertices), -1
    if len(index) > _LEAST_BYTES * (vertices + _LEAST_BYTES):
        raise ValueError(f"{len(index)} indices use {vertices} vertices over and over")
    if ((index >= vertices) & (index != restart)).any():
        raise ValueError(f"an index is {index.max()}, the mesh has {vertices} vertices")
    if primitive["mode"] == _LINES:
        if len(index) % 2:
            raise ValueError(f"{len(index)} indices do not make pairs")
        return index.reshape(-1, 2)
    pairs = np.stack([index[:-1], index[1:]], axis=1)
    if primitive["mode"] == _LOOP and len(index) > 2:
        pairs = np.concatenate([pairs, [[index[-1], index[0]]]])
    return np.asarray(pairs[(pairs != restart).all(axis=1)])


def _weld(segments: Int64Array, points: npt.NDArray[Any]) -> Int64Array:
    """Join segments that have their own vertices each, where one starts as the last one ended."""
    if len(segments) < 2 or np.bincount(segments.ravel(), minlength=len(points)).max() > 1:
        return segments
    meets = (points[segments[1:, 0]] == points[segments[:-1, 1]]).all(axis=1)
    segments = segments.copy()
    segments[1:, 0][meets] = segments[:-1, 1][meets]
    return segments


def _own_head(file: GlbFile, own: dict[str, Any]) -> Head | None:
    """Return the head of a file of hairkit's, or None where it was left out."""
    joints = np.zeros((3, 3))
    mesh, primitive = {}, None
    for node, placed in file.nodes_in_place():
        if node.get("name") in JOINT_NAMES:
            joints[JOINT_NAMES.index(node["name"])] = placed[:3, 3]
        if "mesh" in node:
            for candidate in file.document["meshes"][node["mesh"]]["primitives"]:
                if "_SCALP" in candidate["attributes"]:
                    mesh, primitive = file.document["meshes"][node["mesh"]], candidate
    if primitive is None:
        return None
    attributes = primitive["attributes"]
    uv = file.numbers(attributes["TEXCOORD_0"])
    uv[:, 1] = 1 - uv[:, 1]
    vertices = file.numbers(attributes["POSITION"])
    faces = file.accessor(primitive["indices"]).reshape(-1, 3).astype(np.int64)
    if not (np.abs(vertices) <= _FARTHEST).all() or not (np.abs(joints) <= _FARTHEST).all():
        raise ValueError(f"the head lies beyond {_FARTHEST:g} m")
    if faces.max() >= len(vertices):
        raise ValueError("a face of the head names a vertex that does not exist")
    scalp = file.numbers(attributes["_SCALP"])[:, 0]
    head = Head(
        vertices.astype(np.float32),
        faces.astype(np.int32),
        uv.astype(np.float32),
        scalp.astype(np.float32),
        None,
        joints.astype(np.float32),
        capsules_of(own),
        maps=as_maps(material_maps(file, file.item("materials", primitive["material"]))),
        blendshapes=tuple(
            Blendshape(name, offsets.astype(np.float32))
            for name, offsets in shape_offsets(
                file, mesh, primitive, np.eye(4), len(vertices)
            ).items()
        ),
    )
    return with_extras(head, own)
