"""The skeleton, its motion, and the head mesh that is skinned to it."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array
from hairkit.grooming.prepare_export import PreparedGroom
from hairkit.head_model.bust import bust_under
from hairkit.head_model.skinning import JOINT_NAMES, head_weights
from hairkit.io.coordinate_space import FileSpace
from hairkit.simulation.rigid_motion import follow_head
from hairkit.types.head import Head
from hairkit.types.point_cache import PointCache

JOINTS = tuple("/".join(JOINT_NAMES[: count + 1]) for count in range(len(JOINT_NAMES)))
"""USD names joints by their paths: root, root/neck, root/neck/head."""


def add_skeleton(stage: Any, ready: PreparedGroom, space: FileSpace, codes: list[float]) -> Any:
    """Add the skeleton at rest, and its motion where the groom is animated; return it.

    A simulated head moves as one rigid piece, so only the root joint is animated.
    """
    from pxr import UsdSkel, Vt

    joints = space.points_to_file(ready.groom.head.joints).astype(np.float64)
    skeleton = UsdSkel.Skeleton.Define(stage, "/Groom/Skeleton")
    skeleton.CreateJointsAttr(Vt.TokenArray(JOINTS))
    skeleton.CreateBindTransformsAttr(_moves(joints))
    skeleton.CreateRestTransformsAttr(_moves(np.diff(joints, axis=0, prepend=np.zeros((1, 3)))))
    if ready.cache is not None:
        motion = _add_motion(stage, ready.cache, space, joints[0], codes)
        binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
        binding.CreateAnimationSourceRel().SetTargets([motion.GetPath()])
    return skeleton


def _moves(offsets: Float64Array) -> Any:
    """Return translations by offsets (N, 3) as USD's matrices, which act on row vectors."""
    from pxr import Gf, Vt

    return Vt.Matrix4dArray(
        [Gf.Matrix4d(1.0).SetTranslate(Gf.Vec3d(*map(float, offset))) for offset in offsets]
    )


def _add_motion(
    stage: Any, cache: PointCache, space: FileSpace, root: Float64Array, codes: list[float]
) -> Any:
    """Add the root joint's translation and rotation at every frame."""
    from pxr import Gf, UsdSkel, Vt

    motion = UsdSkel.Animation.Define(stage, "/Groom/Skeleton/Motion")
    motion.CreateJointsAttr(Vt.TokenArray(JOINTS[:1]))
    translations, rotations = motion.CreateTranslationsAttr(), motion.CreateRotationsAttr()
    motion.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1.0, 1.0, 1.0)]))
    previous = Gf.Quatd(1.0)
    for code, moved in zip(codes, space.transform_to_file(cache.head_from_rest), strict=True):
        place = moved[:3, :3] @ root + moved[:3, 3]
        turn = Gf.Matrix3d(*moved[:3, :3].T.ravel().tolist()).ExtractRotation().GetQuat()
        if Gf.Dot(turn, previous) < 0:
            turn = -turn  # the same turn, without a jump between frames
        previous = turn
        translations.Set(Vt.Vec3fArray([Gf.Vec3f(*map(float, place))]), code)
        rotations.Set(Vt.QuatfArray([Gf.Quatf(turn)]), code)
    return motion


def add_head(stage: Any, head: Head, space: FileSpace, skeleton: Any, material: Any) -> None:
    """Add the head mesh with normals, uv, skin, and what hairkit reads back."""
    from pxr import UsdShade

    mesh = _add_mesh(stage, "/Groom/Head", head.vertices, head.faces, head.normals(), space)
    _add_vertex_data(mesh.GetPrim(), head)
    _add_skin(mesh.GetPrim(), head, skeleton)
    _add_shapes(stage, mesh.GetPrim(), head, space)
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def add_bust(
    stage: Any, ready: PreparedGroom, space: FileSpace, material: Any, codes: list[float]
) -> None:
    """Add the bust under a head that ends at its neck; it hangs on the joint of the neck."""
    from pxr import Gf, UsdShade

    head, cache = ready.groom.head, ready.cache
    bust = bust_under(head, ready.groom.strands)
    if bust is None:
        return
    mesh = _add_mesh(stage, "/Groom/Torso", bust.vertices, bust.faces, bust.normals, space)
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    if cache is not None:
        joint, place = head.joints[1].astype(np.float64), mesh.AddTransformOp()
        torso = np.stack([follow_head(np.eye(4), move, joint) for move in cache.head_from_rest])
        for code, moved in zip(codes, space.transform_to_file(torso), strict=True):
            place.Set(Gf.Matrix4d(*moved.T.ravel().tolist()), code)


def _add_mesh(
    stage: Any,
    path: str,
    vertices: Float32Array,
    faces: Int32Array,
    normals: Float32Array | Float64Array,
    space: FileSpace,
) -> Any:
    from pxr import UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    points = Vt.Vec3fArray.FromNumpy(space.points_to_file(vertices))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel()))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(space.directions_to_file(normals)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    return mesh


def _add_vertex_data(prim: Any, head: Head) -> None:
    from pxr import Sdf, UsdGeom, Vt

    primvars, types, vertex = UsdGeom.PrimvarsAPI(prim), Sdf.ValueTypeNames, UsdGeom.Tokens.vertex
    uv = primvars.CreatePrimvar("st", types.TexCoord2fArray, vertex)
    uv.Set(Vt.Vec2fArray.FromNumpy(head.uv))
    scalp = primvars.CreatePrimvar("hairkit:scalp", types.FloatArray, vertex)
    scalp.Set(Vt.FloatArray.FromNumpy(head.scalp))


def _add_skin(prim: Any, head: Head, skeleton: Any) -> None:
    from pxr import Gf, UsdSkel, Vt

    weights = head_weights(head)
    vertices, joints = weights.shape
    indices = np.tile(np.arange(joints, dtype=np.int32), vertices)
    binding = UsdSkel.BindingAPI.Apply(prim)
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    binding.CreateJointIndicesPrimvar(False, joints).Set(Vt.IntArray.FromNumpy(indices))
    binding.CreateJointWeightsPrimvar(False, joints).Set(Vt.FloatArray.FromNumpy(weights.ravel()))


def _add_shapes(stage: Any, prim: Any, head: Head, space: FileSpace) -> None:
    """Add the head's blendshapes below its mesh."""
    from pxr import Sdf, Tf, UsdSkel, Vt

    if not head.blendshapes:
        return
    paths = []
    for shape in head.blendshapes:
        path = prim.GetPath().AppendChild(Tf.MakeValidIdentifier(shape.name))
        moved = np.flatnonzero(np.abs(shape.offsets).max(axis=1) > 0)
        offsets = space.directions_to_file(shape.offsets[moved]) / space.metres
        target = UsdSkel.BlendShape.Define(stage, path)
        target.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(offsets.astype(np.float32)))
        target.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(moved.astype(np.int32)))
        paths.append(Sdf.Path(path))
    binding = UsdSkel.BindingAPI.Apply(prim)
    binding.CreateBlendShapesAttr(Vt.TokenArray([shape.name for shape in head.blendshapes]))
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)
