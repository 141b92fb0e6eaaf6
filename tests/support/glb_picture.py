"""Pictures of the hair mesh of a .glb as a client draws it: from the file's own numbers alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from gltf_player import GltfPlayer

Array = npt.NDArray[Any]
SIZE, SPAN = 64, 0.26
"""Pixels and metres of a picture's edge."""
LIGHT = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])
"""Towards the light, as the camera sees it: right, up, towards the camera."""
GLOSS = 12
"""Exponent of the highlight (Blinn 1977)."""
VIEWS = {
    "front": np.eye(3),
    "left": np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]]),
    "top": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
}
"""Rows: right, up and towards the camera, in the head frame."""


@dataclass(frozen=True)
class Surface:
    """Triangles with what a shader reads at their corners."""

    points: Array
    normals: Array
    colours: Array
    uv: Array
    root_uv: Array
    faces: Array

    @classmethod
    def of(cls, path: Path, time: float = 0.0, name: str = "hair_LOD0") -> Surface:
        """Return the mesh of a file at a time, skinned and coloured as three.js does."""
        player = GltfPlayer(path)
        node = next(n for n in player.json["nodes"] if n.get("name") == name)
        primitive = player.json["meshes"][node["mesh"]]["primitives"][0]
        attributes = primitive["attributes"]
        look = player.json["materials"][primitive["material"]]["pbrMetallicRoughness"]
        tip = player.mesh(name, time, "three", along=attributes["NORMAL"])
        points = player.mesh(name, time, "three")
        return cls(
            points,
            tip - points,
            player.array(attributes["COLOR_0"])[:, :3] * look["baseColorFactor"][:3],
            player.array(attributes["TEXCOORD_0"]),
            player.array(attributes["TEXCOORD_1"]),
            player.array(primitive["indices"]).reshape(-1, 3).astype(int),
        )


@dataclass(frozen=True)
class Picture:
    """What one camera sees, (SIZE, SIZE) each; 0 where there is no hair."""

    covered: Array
    lit: Array
    """(SIZE, SIZE, 3) diffuse light times colour."""
    shine: Array
    colours: Array
    uv: Array
    """(SIZE, SIZE, 4) texture coordinates along the strip, and of its root."""


def draw(surface: Surface, view: str) -> Picture:
    """Draw the triangles with a depth buffer; the normals of back faces are turned, as shaders do.

    Parallel projection; corners are interpolated linearly.
    """
    turn = VIEWS[view]
    place = surface.points @ turn.T
    pixel = (place[:, :2] / SPAN + 0.5) * SIZE
    normals = surface.normals / np.linalg.norm(surface.normals, axis=1, keepdims=True) @ turn.T
    values = np.column_stack([surface.colours, surface.uv, surface.root_uv, normals])
    depth = np.full((SIZE, SIZE), -np.inf)
    seen = np.zeros((SIZE, SIZE, values.shape[1]))
    for face in surface.faces:
        _fill(pixel[face], place[face, 2], values[face], depth, seen)
    covered = np.isfinite(depth)
    normal = seen[..., 7:] / np.maximum(np.linalg.norm(seen[..., 7:], axis=2, keepdims=True), 1e-9)
    half = LIGHT + np.array([0, 0, 1])
    half /= np.linalg.norm(half)
    diffuse = np.maximum(normal @ LIGHT, 0)
    shine = np.maximum(normal @ half, 0) ** GLOSS
    return Picture(
        covered, diffuse[..., None] * seen[..., :3], shine, seen[..., :3], seen[..., 3:7]
    )


def _fill(corner: Array, z: Array, values: Array, depth: Array, seen: Array) -> None:
    """Draw one triangle of corners (3, 2) in pixels."""
    (x0, y0), (x1, y1) = np.floor(corner.min(0)).astype(int), np.ceil(corner.max(0)).astype(int)
    x0, y0, x1, y1 = max(x0, 0), max(y0, 0), min(x1, SIZE), min(y1, SIZE)
    one, two = corner[1] - corner[0], corner[2] - corner[0]
    area = one[0] * two[1] - one[1] * two[0]
    if x0 >= x1 or y0 >= y1 or abs(area) < 1e-9:
        return
    x, y = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
    x, y = x - corner[0, 0], y - corner[0, 1]
    second, third = (x * two[1] - y * two[0]) / area, (y * one[0] - x * one[1]) / area
    weights = np.stack([1 - second - third, second, third], axis=-1)
    near = weights @ z
    room = depth[y0:y1, x0:x1]
    inside = (weights >= -1e-9).all(axis=-1) & (near > room)
    room[inside] = near[inside]
    found = weights @ values
    if area < 0:
        found[..., 7:] *= -1
    seen[y0:y1, x0:x1][inside] = found[inside]


def differences(one: Picture, two: Picture) -> dict[str, float]:
    """Return by how much two pictures differ: 0 for equal ones."""
    both = one.covered & two.covered
    union = max(np.count_nonzero(one.covered | two.covered), 1)
    if not both.any():
        return {"silhouette": 1.0}
    mean = {
        name: float(np.abs(getattr(one, name)[both] - getattr(two, name)[both]).mean())
        for name in ("lit", "shine", "colours", "uv")
    }
    return {"silhouette": 1 - np.count_nonzero(both) / union, **mean}
