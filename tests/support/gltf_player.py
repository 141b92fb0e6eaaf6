"""A small glTF player that places vertices as two clients do, written apart from the plugin.

`blender` clamps morph weights to 0 to 1, as shape keys are by default, and skins every mesh that
has a skin. `three` skins triangles only: three.js makes `LineSegments` of lines, skin or not, which
stay with their own node.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

Client = Literal["blender", "three"]
_TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_TRIANGLES = 4


class GltfPlayer:
    """One .glb file, its arrays and its first animation."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        length = struct.unpack_from("<I", data, 12)[0]
        self.json: dict[str, Any] = json.loads(data[20 : 20 + length])
        self._binary = data[20 + length + 8 :]
        self._above = {
            child: number
            for number, node in enumerate(self.json["nodes"])
            for child in node.get("children", [])
        }

    def array(self, number: int) -> npt.NDArray[Any]:
        """Return (count, width) the elements of an accessor, normalised where it says so."""
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        kind, width = np.dtype(_TYPES[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        flat = np.frombuffer(self._binary, kind, accessor["count"] * width, start)
        scale = np.iinfo(kind).max if accessor.get("normalized") else 1
        return flat.reshape(-1, width) / scale if scale != 1 else flat.reshape(-1, width)

    @property
    def times(self) -> npt.NDArray[Any]:
        """(T,) the keys of the first animation, seconds."""
        return self.array(self.json["animations"][0]["samplers"][0]["input"])[:, 0]

    def mesh(
        self, name: str, time: float, client: Client, along: int | None = None
    ) -> npt.NDArray[Any]:
        """Return (V, 3) where a client draws the vertices of the mesh of a node so named.

        `along` names an accessor of vectors: then it is where their ends are.
        """
        number = next(n for n, node in enumerate(self.json["nodes"]) if node.get("name") == name)
        node, animated = self.json["nodes"][number], self._sampled(time)
        mesh = self.json["meshes"][node["mesh"]]
        primitive = mesh["primitives"][0]
        points = self.array(primitive["attributes"]["POSITION"]).astype(float)
        weights = animated.get((number, "weights"), np.array(mesh.get("weights", [])))
        if client == "blender":
            weights = np.clip(weights, 0, 1)
        for weight, target in zip(weights, primitive.get("targets", []), strict=True):
            points = points + weight * self.array(target["POSITION"])
        points = points if along is None else points + self.array(along)
        skins = client == "blender" or primitive.get("mode", _TRIANGLES) == _TRIANGLES
        if "skin" in node and skins:
            return self._skinned(points, primitive["attributes"], node["skin"], animated)
        placed = self._world(number, animated)
        return points @ placed[:3, :3].T + placed[:3, 3]

    def _skinned(
        self, points: npt.NDArray[Any], attributes: dict[str, int], skin: int, animated: Any
    ) -> npt.NDArray[Any]:
        bound = self.json["skins"][skin]
        inverse = self.array(bound["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        matrices = np.stack(
            [
                self._world(joint, animated) @ bind
                for joint, bind in zip(bound["joints"], inverse, strict=True)
            ]
        )
        joints, weights = self.array(attributes["JOINTS_0"]), self.array(attributes["WEIGHTS_0"])
        blend = np.einsum("vj,vjab->vab", weights, matrices[joints.astype(int)])
        return np.einsum("vab,vb->va", blend[:, :3, :3], points) + blend[:, :3, 3]

    def _world(self, number: int, animated: Any) -> npt.NDArray[Any]:
        """Return scene_from_node (4, 4): the product of all nodes down to this one."""
        node = self.json["nodes"][number]
        place, turn = (
            animated.get((number, path), np.array(node.get(path, rest), float))
            for path, rest in (("translation", (0, 0, 0)), ("rotation", (0, 0, 0, 1)))
        )
        x, y, z, w = turn / np.linalg.norm(turn)
        local = np.eye(4)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        local[:3, :3] += 2 * w * cross + 2 * cross @ cross
        local[:3, 3] = place
        above = self._above.get(number)
        return local if above is None else self._world(above, animated) @ local

    def _sampled(self, time: float) -> dict[tuple[int, str], npt.NDArray[Any]]:
        """Return the animated properties of nodes at a time, between keys by the shorter arc."""
        found: dict[tuple[int, str], npt.NDArray[Any]] = {}
        if "animations" not in self.json:
            return found
        animation = self.json["animations"][0]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            keys = self.array(sampler["input"])[:, 0].astype(float)
            values = self.array(sampler["output"]).astype(float).reshape(len(keys), -1)
            after = int(np.clip(np.searchsorted(keys, time, side="right"), 1, len(keys) - 1))
            share = np.clip((time - keys[after - 1]) / (keys[after] - keys[after - 1]), 0, 1)
            low, high = values[after - 1], values[after]
            if channel["target"]["path"] == "rotation" and low @ high < 0:
                high = -high
            target = channel["target"]
            found[target["node"], target["path"]] = (1 - share) * low + share * high
        return found
