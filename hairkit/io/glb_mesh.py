"""The triangle mesh of a binary glTF file (.glb), all its nodes put together in place.

Not read by trimesh (5.2.0): for an accessor without data it allocates what the accessor claims, 1.5
GB for a file of 1 kB, and it passes over nodes that name meshes which do not exist.
"""

from __future__ import annotations

import logging
import os
from dataclasses import replace
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.io.glb_file import GlbFile, readable
from hairkit.io.glb_skin import material_maps, shape_offsets
from hairkit.io.mesh_text import MAX_FACES, MAX_MESH_BYTES, MAX_VERTICES, FileMesh, check_mesh
from hairkit.types.skin import Texture

_log = logging.getLogger("hairkit")


def read_glb(path: str | os.PathLike[str]) -> FileMesh:
    """Return the triangles of the default scene in its frame, with TEXCOORD_0 and COLOR_0.

    Each node, mesh and material name becomes a group, and so does each custom scalar attribute
    (`_SCALP` is the group `scalp`). Where some meshes have `_SCALP`, only those are the head.
    Raises `FormatError` for damaged, compressed or sparse files.
    """
    with readable(path, "GLB mesh"):
        parts = _parts(GlbFile(path, MAX_MESH_BYTES))
        if not parts:
            raise ValueError("it holds no triangles")
        return check_mesh(_join(parts, path), path)


def _parts(file: GlbFile) -> list[FileMesh]:
    parts: list[FileMesh] = []
    nodes = [(node, placed) for node, placed in file.nodes_in_place() if "mesh" in node]
    meshes = file.document["meshes"]
    marked = [
        (node, placed)
        for node, placed in nodes
        if any("_SCALP" in part["attributes"] for part in meshes[node["mesh"]]["primitives"])
    ]
    for node, placed in marked or nodes:
        mesh = meshes[node["mesh"]]
        names = [node.get("name", ""), mesh.get("name", "")]
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) == 4:
                part = _primitive(file, primitive, placed, names)
                shapes = shape_offsets(file, mesh, primitive, placed, len(part.vertices))
                parts.append(replace(part, shapes=shapes))
        if sum(len(part.vertices) for part in parts) > MAX_VERTICES:
            raise ValueError(f"it has more than {MAX_VERTICES} vertices")
    return parts


def _primitive(
    file: GlbFile, primitive: dict[str, Any], placed: Float64Array, names: list[str]
) -> FileMesh:
    if primitive.get("extensions", {}).keys() & {"KHR_draco_mesh_compression"}:
        raise ValueError("it is compressed with Draco: export it without compression")
    attributes = primitive["attributes"]
    points = file.numbers(attributes["POSITION"])
    vertices = points @ placed[:3, :3].T + placed[:3, 3]
    if "indices" in primitive:
        index = file.numbers(primitive["indices"]).ravel().astype(np.int64)
    else:
        index = np.arange(len(vertices))
    if len(index) > 3 * MAX_FACES:
        raise ValueError(f"{len(index) // 3} triangles in one part")
    maps: dict[str, Texture] = {}
    if "material" in primitive:
        material = file.document["materials"][primitive["material"]]
        names = [*names, material.get("name", "")]
        maps = material_maps(file, material)
    groups = {name.lower(): np.ones(len(vertices)) for name in names if name}
    for name, number in attributes.items():
        if name.startswith("_") and len(values := file.numbers(number)) == len(points):
            groups[name[1:].lower()] = values[:, 0]
    optional = {
        name: file.numbers(attributes[name]) if name in attributes else None
        for name in ("TEXCOORD_0", "COLOR_0")
    }
    uv, colours = optional["TEXCOORD_0"], optional["COLOR_0"]
    if any(extra is not None and len(extra) != len(points) for extra in (uv, colours)):
        raise ValueError("its attributes differ in length")
    # glTF counts v from the top of the picture, this project and OBJ from the bottom.
    flipped = None if uv is None else np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1)
    return FileMesh(
        vertices, index[: len(index) // 3 * 3].reshape(-1, 3), flipped,
        None if colours is None else colours[:, :3], groups, maps,
    )  # fmt: skip


def _join(parts: list[FileMesh], path: str | os.PathLike[str]) -> FileMesh:
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
    shapes = {
        name: np.concatenate(
            [part.shapes.get(name, np.zeros_like(part.vertices)) for part in parts]
        )
        for name in dict.fromkeys(name for part in parts for name in part.shapes)
    }
    mapped = [part for part in parts if "albedo" in part.maps]
    if len({part.maps["albedo"].data.tobytes() for part in mapped}) > 1:
        _log.warning("%s: of several materials only that of most triangles is used", path)
    return FileMesh(
        np.concatenate([part.vertices for part in parts]),
        faces,
        np.concatenate(uv) if len(uv) == len(parts) else None,
        np.concatenate(colours) if len(colours) == len(parts) else None,
        groups,
        max(mapped or parts, key=lambda part: len(part.faces)).maps,
        shapes,
    )
