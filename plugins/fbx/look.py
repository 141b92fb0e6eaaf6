"""The head's material with its texture maps, which the file holds, and its blendshapes."""

from __future__ import annotations

import numpy as np

from hairkit.types.head import Head
from hairkit.types.skin import SkinMaps, Texture

from .builder import Scene, one, properties70
from .records import array, number, raw, record, text

SKIN = (0.5, 0.36, 0.29)
"""Linear RGB of a head without an albedo map."""
SKIN_SPECULAR = 0.1
"""Factor of the skin's highlight, of 1: skin is matt."""
FULL_WEIGHT = 100.0
"""Per cent of a blendshape at which it is whole."""
_SLOTS = {
    "albedo": "DiffuseColor",
    "normal": "NormalMap",
    "bump": "Bump",
    "roughness": "ShininessExponent",
}
"""Properties of the material that the maps drive; as Blender and Maya name them."""


def add_skin_material(scene: Scene, maps: SkinMaps | None) -> int:
    """Add the material and its maps; return its id."""
    present = {} if maps is None else maps.present()
    material = add_material(scene, "skin", (1, 1, 1) if "albedo" in present else SKIN)
    for kind, texture in present.items():
        scene.connect(_add_texture(scene, kind, texture), material, _SLOTS[kind])
    return material


def add_material(scene: Scene, name: str, colour: tuple[float, float, float]) -> int:
    """Add a matt material of one colour, linear RGB; return its id."""
    return scene.add(
        "Material",
        name,
        "",
        record("Version", number("I", 102)),
        record("ShadingModel", text("phong")),
        record("MultiLayer", number("I", 0)),
        properties70(
            one("DiffuseColor", "Color", "", "A", *colour),
            one("SpecularFactor", "Number", "", "A", SKIN_SPECULAR),
        ),
    )


def _add_texture(scene: Scene, kind: str, texture: Texture) -> int:
    """Add a picture with its file inside, and the texture that shows it over `map1`."""
    name = f"head.{kind}{texture.suffix}"
    files = record("FileName", text(name)), record("RelativeFilename", text(name))
    video = scene.add(
        "Video",
        kind,
        "Clip",
        record("Type", text("Clip")),
        record("UseMipMap", number("I", 0)),
        *files,
        record("Content", raw(texture.data.tobytes())),
    )
    drawn = scene.add(
        "Texture",
        kind,
        "",
        record("Type", text("TextureVideoClip")),
        record("Version", number("I", 202)),
        record("Media", text(kind)),
        *files,
        record("Texture_Alpha_Source", text("None")),
        properties70(record("P", text("UVSet"), text("KString"), text(""), text(""), text("map1"))),
    )
    scene.connect(video, drawn)
    return drawn


def add_shapes(scene: Scene, geometry: int, head: Head) -> None:
    """Add the head's blendshapes: one deformer, a channel and a shape each."""
    if not head.blendshapes:
        return
    deformer = scene.add(
        "Deformer", "head_shapes", "BlendShape", record("Version", number("I", 100))
    )
    scene.connect(deformer, geometry)
    for shape in head.blendshapes:
        channel = scene.add(
            "Deformer",
            shape.name,
            "BlendShapeChannel",
            record("Version", number("I", 100)),
            record("DeformPercent", number("D", 0.0)),
            record("FullWeights", array("d", [FULL_WEIGHT])),
            label="SubDeformer",
        )
        moved = np.flatnonzero(np.abs(shape.offsets).max(axis=1) > 0)
        offsets = scene.space.directions_to_file(shape.offsets[moved]) / scene.space.metres
        target = scene.add(
            "Geometry",
            shape.name,
            "Shape",
            record("Version", number("I", 100)),
            record("Indexes", array("i", moved)),
            record("Vertices", array("d", offsets)),
            record("Normals", array("d", np.zeros_like(offsets))),
        )
        scene.connect(channel, deformer)
        scene.connect(target, channel)
