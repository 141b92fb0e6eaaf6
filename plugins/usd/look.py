"""Materials: UsdPreviewSurface with the captured colour, and a plain one for the skin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hairkit.arrays import Float32Array
from hairkit.types.groom import Groom

SKIN = (0.5, 0.36, 0.29)
"""Linear RGB of the head mesh, whose colour the photos do not give."""
_HAIR_ROUGHNESS, _SKIN_ROUGHNESS = 0.35, 0.6


@dataclass(frozen=True)
class Materials:
    """The stage's UsdShade.Material of hair and of skin."""

    hair: Any
    skin: Any


def add_materials(stage: Any, groom: Groom) -> Materials:
    """Add both; hair has the mean of its root's and tip's colour, `displayColor` the gradient."""
    from pxr import UsdGeom

    UsdGeom.Scope.Define(stage, "/Groom/Materials")
    look = groom.material
    mean: Float32Array = 0.5 * (look.root_colour + look.tip_colour)
    colour = (float(mean[0]), float(mean[1]), float(mean[2]))
    return Materials(
        _add(stage, "/Groom/Materials/Hair", colour, _HAIR_ROUGHNESS),
        _add(stage, "/Groom/Materials/Skin", SKIN, _SKIN_ROUGHNESS),
    )


def _add(stage: Any, path: str, colour: tuple[float, float, float], roughness: float) -> Any:
    from pxr import Gf, Sdf, UsdShade

    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*colour))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(roughness)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.0)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    return material
