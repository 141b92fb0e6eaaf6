"""Texture maps and morph targets of glTF meshes.

Khronos glTF 2.0 specification, sections 3.9 (materials) and 3.7.2.2 (morph targets).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.colour import linear_from_srgb, srgb_from_linear
from hairkit.io.glb_file import GlbFile
from hairkit.io.textures import grey, texture_of
from hairkit.types.skin import Texture

ROUGHNESS_CHANNEL = 1
"""Green of a metallic-roughness picture; blue is metal, red occlusion."""
_MAX_SHAPES = 2000


def material_maps(file: GlbFile, material: dict[str, Any]) -> dict[str, Texture]:
    """Return albedo, roughness and normal maps of a material, those that it has.

    A base colour factor other than white is multiplied into the albedo.
    """
    look = material.get("pbrMetallicRoughness", {})
    named = {
        "albedo": look.get("baseColorTexture"),
        "roughness": look.get("metallicRoughnessTexture"),
        "normal": material.get("normalTexture"),
    }
    maps = {name: _texture(file, slot["index"]) for name, slot in named.items() if slot}
    if "roughness" in maps:
        maps["roughness"] = Texture.encode(grey(maps["roughness"], ROUGHNESS_CHANNEL))
    factor = np.array(look.get("baseColorFactor", [1, 1, 1, 1]), np.float64)[:3]
    if "albedo" in maps:
        if (maps["albedo"].pixels == 255).all():
            del maps["albedo"]  # the place of a map that is not there
        elif (factor != 1).any():
            linear = linear_from_srgb(maps["albedo"].pixels / 255) * factor.clip(0, 1)
            pixels = np.rint(255 * srgb_from_linear(linear)).astype(np.uint8)
            maps["albedo"] = Texture.encode(pixels)
    return maps


def shape_offsets(
    file: GlbFile,
    mesh: dict[str, Any],
    primitive: dict[str, Any],
    placed: Float64Array,
    vertices: int,
) -> dict[str, Float64Array]:
    """Return the offsets (V, 3) of a primitive's morph targets in the scene's frame, by name."""
    targets = primitive.get("targets", [])
    if len(targets) > _MAX_SHAPES:
        raise ValueError(f"it has {len(targets)} morph targets")
    names = mesh.get("extras", {}).get("targetNames", []) if "extras" in mesh else []
    found: dict[str, Float64Array] = {}
    for number, target in enumerate(targets):
        if "POSITION" not in target:
            continue
        offsets = file.numbers(target["POSITION"]) @ placed[:3, :3].T
        if len(offsets) != vertices:
            raise ValueError(f"morph target {number} has {len(offsets)} vertices, not {vertices}")
        name = str(names[number]) if number < len(names) else f"shape_{number}"
        found[name if name not in found else f"{name}_{number}"] = offsets
    return found


def _texture(file: GlbFile, number: int) -> Texture:
    texture = file.item("textures", number)
    image = file.item("images", texture["source"])
    where = f"{file.path}: image {texture['source']}"
    if "bufferView" in image:
        return texture_of(bytes(file.view(file.item("bufferViews", image["bufferView"]))), where)
    return texture_of(bytes(file.side_data(image["uri"], f"image {texture['source']}")), where)
