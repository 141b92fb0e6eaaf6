"""The strands as BasisCurves: points, widths and what engines want to know of each strand."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Int32Array
from hairkit.grooming.guide_weights import closest_guides, guide_mask
from hairkit.grooming.prepare_export import PreparedGroom, point_colours
from hairkit.head_model.skinning import HEAD_JOINT
from hairkit.io.coordinate_space import FileSpace
from hairkit.types.groom import Groom

ROOT_DENSITY = "hairkit:root_density"
"""Primvar of the density of the hair about each root, 0 to 1."""


def add_hair(
    stage: Any,
    ready: PreparedGroom,
    space: FileSpace,
    skeleton: Any,
    material: Any,
    codes: list[float],
    *,
    attributes: bool = True,
    mark_guides: bool = False,
) -> None:
    """Add all strands as one linear BasisCurves, its points and extent at every time code too.

    Where the strands are guides and nothing else they are not marked, as in Alembic files: Unreal
    draws unmarked strands alone.
    """
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
    if attributes:
        marked = mark_guides or not guide_mask(strands).all()
        _add_primvars(UsdGeom.PrimvarsAPI(hair.GetPrim()), ready.groom, marked)
    UsdShade.MaterialBindingAPI.Apply(hair.GetPrim()).Bind(material)
    if ready.cache is None:
        _bind_to_head(hair.GetPrim(), skeleton)


def _add_primvars(primvars: Any, groom: Groom, marked: bool) -> None:
    """Add the colours at every point and what is known of every strand."""
    from pxr import Sdf, UsdGeom, Vt

    types = Sdf.ValueTypeNames
    colours = Vt.Vec3fArray.FromNumpy(point_colours(groom))
    for name, kind in (("displayColor", types.Color3fArray), ("groom_color", types.Float3Array)):
        primvars.CreatePrimvar(name, kind, UsdGeom.Tokens.vertex).Set(colours)
    assert groom.strands.root_uv is not None
    uv = Vt.Vec2fArray.FromNumpy(groom.strands.root_uv)
    for name, kind in (("st", types.TexCoord2fArray), ("groom_root_uv", types.Float2Array)):
        primvars.CreatePrimvar(name, kind, UsdGeom.Tokens.uniform).Set(uv)
    for name, values in _numbers(groom, marked).items():
        array, kind = Vt.IntArray.FromNumpy(values), types.IntArray
        primvars.CreatePrimvar(name, kind, UsdGeom.Tokens.uniform).Set(array)
    density = Vt.FloatArray.FromNumpy(groom.root_density)
    primvars.CreatePrimvar(ROOT_DENSITY, types.FloatArray, UsdGeom.Tokens.uniform).Set(density)
    for name, rows in _triples(groom, marked).items():
        array, kind = Vt.Vec3fArray.FromNumpy(rows), types.Float3Array
        primvars.CreatePrimvar(name, kind, UsdGeom.Tokens.uniform).Set(array)


def _numbers(groom: Groom, marked: bool) -> dict[str, Int32Array]:
    """Return the whole numbers (S,) of every strand."""
    strands = groom.strands
    assert strands.group is not None
    assert strands.guide is not None
    numbers = {
        "groom_id": np.arange(len(strands), dtype=np.int32),
        "groom_group_id": strands.group,
        "hairkit:root_triangle": groom.root_triangle,
    }
    return numbers | ({"groom_guide": strands.guide.astype(np.int32)} if marked else {})


def _triples(groom: Groom, marked: bool) -> dict[str, Float32Array]:
    """Return three numbers (S, 3) of every strand; ids of guides too, as Unreal reads no int3."""
    triples = {"hairkit:root_barycentric": groom.root_barycentric}
    if marked and guide_mask(groom.strands).any():
        mix = closest_guides(groom.strands)
        triples["groom_closest_guides"] = mix.guides.astype(np.float32)
        triples["groom_guide_weights"] = mix.weights
    return triples


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
