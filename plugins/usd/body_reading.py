"""The head that hairkit wrote into a USD file."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Int32Array
from hairkit.errors import FormatError, InputError
from hairkit.head_model.skinning import JOINT_NAMES
from hairkit.io.coordinate_space import FileSpace
from hairkit.io.plain_settings import capsules_of
from hairkit.types.head import Head

from .guarded import Contents

_log = logging.getLogger("hairkit")


def read_head(
    found: Contents, settings: dict[str, Any], space: FileSpace, path: Path
) -> Head | None:
    """Return the head whose mesh has hairkit's scalp; None where no mesh has it."""
    meshes = found.description["meshes"]
    if not meshes:
        return None
    mesh = meshes[0]
    if len(meshes) > 1:
        _log.warning("%s: %d heads; %s is taken", path, len(meshes), mesh["path"])
    arrays = {name: found.arrays.get(mesh["name"] + name) for name in _NAMES}
    missing = [name for name, array in arrays.items() if array is None]
    if missing:
        raise FormatError(f"{path}: {mesh['path']} lacks {missing[0]}")
    try:
        return Head(
            _place(arrays["points"], mesh, space),
            _triangles(arrays["faceVertexCounts"], arrays["faceVertexIndices"]),
            np.asarray(arrays["st"]),
            np.asarray(arrays["hairkit:scalp"]),
            settings.get("landmark_vertices"),
            _joints(found, space, path),
            capsules_of(settings),
        )
    except InputError as error:
        raise FormatError(f"{path}: {mesh['path']} is no head: {error}") from error


_NAMES = ("points", "faceVertexCounts", "faceVertexIndices", "st", "hairkit:scalp")


def _place(points: Any, mesh: dict[str, Any], space: FileSpace) -> Float32Array:
    matrix = np.array(mesh["to_stage"], np.float64)
    if not np.array_equal(matrix, np.eye(4)):
        points = points @ matrix[:3, :3] + matrix[3, :3]
    return space.points_to_head(points)


def _triangles(counts: Any, indices: Any) -> Int32Array:
    """Return faces (F, 3); hairkit's heads have no others."""
    if (counts != 3).any() or len(indices) != 3 * len(counts):
        raise InputError("its faces are not triangles")
    return np.asarray(indices, np.int32).reshape(-1, 3)


def _joints(found: Contents, space: FileSpace, path: Path) -> Float32Array:
    """Return (3, 3) where the skeleton's root, neck and head joints are bound."""
    named: list[str] = []
    if "joint_names" in found.arrays:
        named = json.loads(found.arrays["joint_names"].tobytes())
    if any(name not in named for name in JOINT_NAMES):
        raise FormatError(f"{path}: no skeleton with the joints {', '.join(JOINT_NAMES)}")
    places = found.arrays["joints"][[named.index(name) for name in JOINT_NAMES]]
    return space.points_to_head(places)
