"""The cards as a glTF document: a scene a level, on a skeleton with chains of bones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.head_model.skinning import HEAD_JOINT, JOINT_NAMES, JOINT_PARENTS, head_weights
from hairkit.io.glb_document import Document
from hairkit.types.groom import Groom

from .bones import Chains, weigh
from .build import CardSet, Level

CUTOFF = 0.4
"""Alpha from which a texel is drawn."""
SKIN = (0.58, 0.4, 0.32, 1.0)
"""Linear RGBA of skin without an albedo map."""
ROUGHNESS = {"hair": 0.45, "skin": 0.5}


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Joints of a document: places in the world, parents and names, each after its parent."""

    names: list[str]
    places: Float64Array
    """(J, 3) metres."""
    parents: list[int]
    """-1 for the root."""
    head: tuple[int, int, int]
    """Numbers of the groom's joints: root, neck and head."""
    chains: int
    """Number of the first joint of the first chain."""


def plain_skeleton(groom: Groom, chains: Chains | None) -> Skeleton:
    """Return the groom's three joints, and the chains on the last."""
    places = groom.head.joints.astype(np.float64)
    return with_chains(list(JOINT_NAMES), places, list(JOINT_PARENTS), (0, 1, 2), chains)


def with_chains(
    names: list[str],
    places: Float64Array,
    parents: list[int],
    head: tuple[int, int, int],
    chains: Chains | None,
) -> Skeleton:
    """Return a skeleton with chains added to its head joint."""
    begin = len(names)
    if chains is None:
        return Skeleton(names, places, parents, head, begin)
    number = np.searchsorted(chains.first, np.arange(len(chains.places)), side="right") - 1
    added = [f"hair_{c}_{j - chains.first[c]}" for j, c in enumerate(number)]
    above = [head[HEAD_JOINT] if p < 0 else int(p) + begin for p in chains.parent]
    return Skeleton(
        names + added, np.concatenate([places, chains.places]), parents + above, head, begin
    )


class Scenes:
    """Adds levels, the head and skeletons to a document."""

    def __init__(self, groom: Groom, cards: CardSet, chains: Chains | None, alpha: str) -> None:
        self.document, self.groom = Document(), groom
        self.cards, self.chains = cards, chains
        self.hair = self._hair_material(alpha)

    def level(self, number: int, skeleton: Skeleton, *, head: bool) -> list[int]:
        """Add a scene with one level and a skeleton of its own; return the skeleton's nodes."""
        document, level = self.document, self.cards.levels[number]
        nodes = document.joints(skeleton.names, skeleton.places, skeleton.parents)
        skin = document.skin(nodes, skeleton.places)
        name = f"cards_LOD{number}"
        parts = [(name, self._mesh(name, level, skeleton))]
        if head:
            parts.append(("head_mesh", self._head(skeleton)))
        shown = [document.add("nodes", name=n, mesh=mesh, skin=skin) for n, mesh in parts]
        document.add("scenes", name=f"LOD{number}", nodes=[nodes[0], *shown])
        document.json["scene"] = 0
        return nodes

    def _mesh(self, name: str, level: Level, skeleton: Skeleton) -> int:
        add = self.document.accessor
        count = len(level.vertices)
        if self.chains is None:
            joints, weights = np.zeros((count, 4), np.int64), np.zeros((count, 4), np.float32)
            joints[:, 0], weights[:, 0] = skeleton.head[HEAD_JOINT], 1
        else:
            joints, weights = weigh(level, self.chains)
            joints = np.where(weights > 0, joints + skeleton.chains, 0)
        attributes = {
            "POSITION": add(level.vertices, bounds=True),
            "NORMAL": add(level.normals),
            "TANGENT": add(level.tangents),
            "TEXCOORD_0": add(level.uv),
            "JOINTS_0": add(joints.astype(np.uint16)),
            "WEIGHTS_0": add(weights),
        }
        primitive = {
            "attributes": attributes,
            "indices": self.document.indices(level.faces, count),
            "material": self.hair,
        }
        return self.document.add("meshes", name=name, primitives=[primitive])

    def _hair_material(self, alpha: str) -> int:
        albedo = self.document.image(self.cards.maps["albedo"], "albedo")
        normal = self.document.image(self.cards.maps["normal"], "normal")
        return self.document.add(
            "materials",
            name="hair",
            pbrMetallicRoughness={
                "baseColorTexture": {"index": albedo},
                "metallicFactor": 0.0,
                "roughnessFactor": ROUGHNESS["hair"],
            },
            normalTexture={"index": normal},
            alphaMode=alpha,
            alphaCutoff=CUTOFF if alpha == "MASK" else None,
            doubleSided=True,
        )

    def _head(self, skeleton: Skeleton) -> int:
        head, add = self.groom.head, self.document.accessor
        normals = head.normals()
        lost = np.linalg.norm(normals, axis=1) < 0.5
        normals[lost] = (0.0, 1.0, 0.0)
        weights = np.zeros((len(head.vertices), 4), np.float32)
        weights[:, :3] = head_weights(head)
        weights /= weights.sum(axis=1, keepdims=True)
        joints = np.where(weights > 0, np.array([*skeleton.head, 0]), 0)
        attributes = {
            "POSITION": add(head.vertices, bounds=True),
            "NORMAL": add(normals.astype(np.float32)),
            "JOINTS_0": add(joints.astype(np.uint16)),
            "WEIGHTS_0": add(weights),
        }
        look: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": ROUGHNESS["skin"]}
        if head.maps is not None and head.maps.albedo is not None:
            picture = self.document.image(head.maps.albedo.data.tobytes(), "skin")
            look["baseColorTexture"] = {"index": picture}
            uv = head.uv.astype(np.float32, copy=True)
            uv[:, 1] = 1 - uv[:, 1]
            attributes["TEXCOORD_0"] = add(uv)
        else:
            look["baseColorFactor"] = list(SKIN)
        primitive = {
            "attributes": attributes,
            "indices": self.document.indices(head.faces, len(head.vertices)),
            "material": self.document.add("materials", name="skin", pbrMetallicRoughness=look),
        }
        return self.document.add("meshes", name="head_mesh", primitives=[primitive])
