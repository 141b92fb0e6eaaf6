"""Materials: UsdPreviewSurface with the captured colour, and a plain one for the skin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hairkit.arrays import Float32Array
from hairkit.head_model.bust import CLOTH
from hairkit.types.groom import Groom
from hairkit.types.skin_look import SkinLook

SKIN = (0.5, 0.36, 0.29)
"""Linear RGB of the head mesh, whose colour the photos do not give."""
_HAIR_ROUGHNESS, _CLOTH_ROUGHNESS = 0.35, 0.9


@dataclass(frozen=True)
class Materials:
    """The stage's UsdShade.Material of hair, skin and clothes."""

    hair: Any
    skin: Any
    cloth: Any


def add_materials(stage: Any, groom: Groom, pictures: Mapping[str, str]) -> Materials:
    """Add them; hair has the mean of its root's and tip's colour, `displayColor` the gradient.

    `pictures` are the file names of the skin's maps, beside the stage's own file.
    """
    from pxr import UsdGeom

    UsdGeom.Scope.Define(stage, "/Groom/Materials")
    look = groom.material
    mean: Float32Array = 0.5 * (look.root_colour + look.tip_colour)
    colour = (float(mean[0]), float(mean[1]), float(mean[2]))
    hair = _add(stage, "/Groom/Materials/Hair", colour, _HAIR_ROUGHNESS)
    skin = _add(stage, "/Groom/Materials/Skin", SKIN, SkinLook().roughness, SkinLook().ior)
    _add_pictures(stage, "/Groom/Materials/Skin", pictures)
    cloth = _add(stage, "/Groom/Materials/Cloth", CLOTH, _CLOTH_ROUGHNESS)
    return Materials(hair, skin, cloth)


def _add(
    stage: Any,
    path: str,
    colour: tuple[float, float, float],
    roughness: float,
    ior: float | None = None,
) -> Any:
    from pxr import Gf, Sdf, UsdShade

    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*colour))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(roughness)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.0)
    if ior is not None:
        shader.CreateInput("ior", Sdf.ValueTypeNames.Float).Set(ior)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    return material


_INPUTS = {
    "albedo": ("diffuseColor", "rgb", "sRGB"),
    "roughness": ("roughness", "r", "raw"),
    "normal": ("normal", "rgb", "raw"),
}
"""Input of UsdPreviewSurface, output and colour space of each map; it has no bump."""


def _add_pictures(stage: Any, path: str, pictures: Mapping[str, str]) -> None:
    """Connect the skin's inputs to pictures read over the primvar `st`."""
    from pxr import Gf, Sdf, UsdShade

    types = Sdf.ValueTypeNames
    surface = UsdShade.Shader.Get(stage, f"{path}/Surface")
    used = {kind: name for kind, name in pictures.items() if kind in _INPUTS}
    if not used:
        return
    place = UsdShade.Shader.Define(stage, f"{path}/Place")
    place.CreateIdAttr("UsdPrimvarReader_float2")
    place.CreateInput("varname", types.String).Set("st")
    st = place.CreateOutput("result", types.Float2)
    for kind, name in used.items():
        slot, output, space = _INPUTS[kind]
        shader = UsdShade.Shader.Define(stage, f"{path}/{kind.capitalize()}")
        shader.CreateIdAttr("UsdUVTexture")
        shader.CreateInput("file", types.Asset).Set(Sdf.AssetPath(f"./{name}"))
        shader.CreateInput("sourceColorSpace", types.Token).Set(space)
        shader.CreateInput("st", types.Float2).ConnectToSource(st)
        if kind == "normal":
            shader.CreateInput("scale", types.Float4).Set(Gf.Vec4f(2, 2, 2, 1))
            shader.CreateInput("bias", types.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
            surface.CreateInput(slot, types.Normal3f)
        kind_of = types.Float if output == "r" else types.Float3
        surface.GetInput(slot).ConnectToSource(shader.CreateOutput(output, kind_of))
