"""The strands as BasisCurves: points, widths and what engines want to know of each strand."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.exporting import PreparedGroom, point_colours
from hairkit.file_space import FileSpace
from hairkit.groom import Groom
from hairkit.guide_weights import closest_guides
from hairkit.head_skin import HEAD_JOINT


def add_hair(
    stage: Any,
    ready: PreparedGroom,
    space: FileSpace,
    skeleton: Any,
    material: Any,
    codes: list[float],
) -> None:
    """Add all strands as one linear BasisCurves, its points and extent at every time code too."""
    from pxr import UsdGeom, UsdShade, Vt

    strands = ready.groom.strands
    hair = UsdGeom.BasisCurves.Define(stage, "/Groom/Hair")
    hair.CreateTypeAttr(UsdGeom.Tokens.linear)
    hair.CreateWrapAttr(UsdGeom.Tokens.nonperiodic)
    hair.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(strands.counts.astype(np.int32)))
    assert strands.widths is not None
    widths = Vt.FloatArray.FromNumpy(strands.widths / np.float32(space.metres))
    hair.CreateWidthsAttr(widths)
    hair.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    points, extent = hair.CreatePointsAttr(), hair.CreateExtentAttr()
    frames = [] if ready.cache is None else list(ready.cache.points)
    for code, frame in zip([None, *codes], [strands.points, *frames], strict=True):
        place = Vt.Vec3fArray.FromNumpy(space.points_to_file(frame))
        when = () if code is None else (code,)
        points.Set(place, *when)
        extent.Set(UsdGeom.Curves.ComputeExtent(place, widths), *when)
    _add_primvars(UsdGeom.PrimvarsAPI(hair.GetPrim()), ready.groom)
    UsdShade.MaterialBindingAPI.Apply(hair.GetPrim()).Bind(material)
    if ready.cache is None:
        _bind_to_head(hair.GetPrim(), skeleton)


def _add_primvars(primvars: Any, groom: Groom) -> None:
    """Add primvars of types that Unreal reads: int, float2, float3; so ids of guides are floats."""
    from pxr import Sdf, UsdGeom, Vt

    strands, types = groom.strands, Sdf.ValueTypeNames
    assert strands.root_uv is not None
    assert strands.group is not None
    assert strands.guide is not None
    colours = Vt.Vec3fArray.FromNumpy(point_colours(groom))
    uv = Vt.Vec2fArray.FromNumpy(strands.root_uv)
    uniform, vertex = UsdGeom.Tokens.uniform, UsdGeom.Tokens.vertex
    ids = np.arange(len(strands), dtype=np.int32)
    values = [
        ("displayColor", types.Color3fArray, vertex, colours),
        ("st", types.TexCoord2fArray, uniform, uv),
        ("groom_color", types.Float3Array, vertex, colours),
        ("groom_root_uv", types.Float2Array, uniform, uv),
        ("groom_id", types.IntArray, uniform, Vt.IntArray.FromNumpy(ids)),
        ("groom_group_id", types.IntArray, uniform, Vt.IntArray.FromNumpy(strands.group)),
        (
            "groom_guide",
            types.IntArray,
            uniform,
            Vt.IntArray.FromNumpy(strands.guide.astype(np.int32)),
        ),
        (
            "hairkit:root_triangle",
            types.IntArray,
            uniform,
            Vt.IntArray.FromNumpy(groom.root_triangle),
        ),
        (
            "hairkit:root_barycentric",
            types.Float3Array,
            uniform,
            Vt.Vec3fArray.FromNumpy(groom.root_barycentric),
        ),
    ]
    if strands.guide.any():
        mix = closest_guides(strands)
        guides = Vt.Vec3fArray.FromNumpy(mix.guides.astype(np.float32))
        weights = Vt.Vec3fArray.FromNumpy(mix.weights)
        values.append(("groom_closest_guides", types.Float3Array, uniform, guides))
        values.append(("groom_guide_weights", types.Float3Array, uniform, weights))
    for name, kind, interpolation, value in values:
        primvars.CreatePrimvar(name, kind, interpolation).Set(value)


def _bind_to_head(prim: Any, skeleton: Any) -> None:
    """Bind all points rigidly: one joint of weight 1, said once (constant) for the whole prim."""
    from pxr import Gf, UsdGeom, UsdSkel, Vt

    binding = UsdSkel.BindingAPI.Apply(prim)
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    indices = binding.CreateJointIndicesPrimvar(True, 1)
    indices.Set(Vt.IntArray([HEAD_JOINT]))
    indices.SetInterpolation(UsdGeom.Tokens.constant)
    weights = binding.CreateJointWeightsPrimvar(True, 1)
    weights.Set(Vt.FloatArray([1.0]))
    weights.SetInterpolation(UsdGeom.Tokens.constant)
