"""The head's material: its texture maps, or plain skin."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.io.glb_document import Document
from hairkit.io.glb_skin import ROUGHNESS_CHANNEL
from hairkit.io.textures import grey
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.skin_look import SkinLook

from .texture import white_picture

SKIN_COLOUR = np.array([0.58, 0.4, 0.32])
"""Linear RGB of skin without an albedo map."""
LOOK = SkinLook()
"""Roughness of skin without a roughness map, and its refractive index."""
_INDEX = "KHR_materials_ior"
"""Extension of glTF that takes that index."""


def skin_material(document: Document, maps: SkinMaps) -> int:
    """Add the material and return it. glTF has no bump maps: that one is left out."""
    colour = [1.0, 1.0, 1.0] if maps.albedo is not None else SKIN_COLOUR.tolist()
    # without a picture of the skin, validators call the uv unused
    albedo = white_picture() if maps.albedo is None else maps.albedo.data.tobytes()
    look: dict[str, Any] = {
        "baseColorFactor": [*colour, 1.0],
        "baseColorTexture": {"index": document.image(albedo, "albedo")},
        "metallicFactor": 0.0,
        "roughnessFactor": LOOK.roughness,
    }
    if maps.roughness is not None:
        packed = _pack_roughness(maps.roughness)
        look["metallicRoughnessTexture"] = {"index": document.image(packed, "roughness")}
        look["roughnessFactor"] = 1.0
    normal = None
    if maps.normal is not None:
        normal = {"index": document.image(maps.normal.data.tobytes(), "normal")}
    index = {_INDEX: {"ior": LOOK.ior}}
    document.json.setdefault("extensionsUsed", []).append(_INDEX)
    return document.add(
        "materials",
        name="head",
        pbrMetallicRoughness=look,
        normalTexture=normal,
        extensions=index,
    )


def _pack_roughness(roughness: Texture) -> bytes:
    """Return a PNG with the roughness in the channel where glTF reads it."""
    values = grey(roughness)
    packed = np.zeros((*values.shape, 3), np.uint8)
    packed[..., ROUGHNESS_CHANNEL] = values
    return Texture.encode(packed).data.tobytes()
