"""What files of hair cards hold: levels of detail, bones. They hold no strands, and are no heads.

Cards are known by the names that hairkit's exporter gives them, `cards_LOD0` and so on.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from hairkit.io.glb_file import GlbFile, readable
from hairkit.storage import read_bytes

_LEVEL = re.compile(r"cards_LOD(\d{1,3})")
_BONE = re.compile(r"hair_\d+_\d+")
_DOCUMENTS = (".glb", ".gltf", ".vrm")


@dataclass(frozen=True)
class CardFile:
    """The cards in a file."""

    triangles: dict[str, int]
    """Of each level, by its name."""
    bones: int = 0
    """Joints of the hair's chains."""
    springs: int = 0
    """Chains that swing (`VRMC_springBone`)."""


def read_card_file(path: Path) -> CardFile | None:
    """Return what a .glb, .gltf, .vrm or .obj file says of its cards, None where it has none.

    Raises `FormatError` where it is damaged.
    """
    if path.suffix.lower() in _DOCUMENTS:
        with readable(path, "glTF file"):
            return _of_document(GlbFile(path))
    if path.suffix.lower() == ".obj":
        return _of_text(read_bytes(path))
    return None


def _of_document(file: GlbFile) -> CardFile | None:
    document, triangles = file.document, {}
    for mesh in document.get("meshes", []):
        if _LEVEL.fullmatch(str(mesh.get("name", ""))):
            corners = [file.item("accessors", p["indices"])["count"] for p in mesh["primitives"]]
            triangles[str(mesh["name"])] = int(sum(corners)) // 3
    if not triangles:
        return None
    names = [str(node.get("name", "")) for node in document.get("nodes", [])]
    springs = document.get("extensions", {}).get("VRMC_springBone", {}).get("springs", [])
    return CardFile(
        triangles, sum(_BONE.fullmatch(name) is not None for name in names), len(springs)
    )


def _of_text(data: bytes) -> CardFile | None:
    """Return the cards of an OBJ file, which has one level."""
    found = re.search(rb"^o (cards_LOD\d{1,3})\s*$", data, re.MULTILINE)
    if found is None:
        return None
    return CardFile({found[1].decode("ascii"): len(re.findall(rb"^f ", data, re.MULTILINE))})
