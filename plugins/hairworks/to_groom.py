"""Make a groom of a HairWorks asset: the growth mesh becomes its head."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.colour import linear_from_srgb
from hairkit.errors import FormatError
from hairkit.head_model.skinning import JOINT_NAMES
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Capsules, Head
from hairkit.types.strands import Strands

from .asset import ApxAsset, Material
from .from_groom import STANDARD_GRAVITY
from .space import file_from_head

_SMALLEST_WIDTH_MM = 1e-3
_FARTHEST = 1e6


def asset_to_groom(asset: ApxAsset) -> Groom:
    """Return the guides in the head frame and metres, on the growth mesh as their head.

    Raises
    ------
    FormatError
        A guide is on no face of the growth mesh, so nothing says where it is bound.
    """
    turn = head_from_file(asset)
    points = asset.vertices @ turn.T
    counts = np.full(asset.guides, asset.points_per_guide)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    roots = points[offsets[:-1]]
    faces = asset.faces if np.linalg.det(turn) > 0 else asset.faces[:, ::-1]
    uv = _root_uv(asset)
    bones = (asset.bind_poses[:, 3, :3] @ turn.T).reshape(-1, 3)
    head = Head(
        _float32("vertices", roots),
        faces.astype(np.int32),
        _float32("faceUVs", uv),
        np.ones(asset.guides, np.float32),
        None,
        _float32("bindPoses", _joints(asset, bones)),
        _capsules(asset, turn),
    )
    triangle, barycentric = _binding(faces, asset.guides)
    strands = Strands(_float32("vertices", points), offsets, root_uv=head.uv)
    material = asset.materials[0]
    physics = _physics(material)
    look = _look(material, float(strands.lengths().mean()))
    return Groom(strands, head, triangle, barycentric, look, physics)


def head_from_file(asset: ApxAsset) -> Float64Array:
    """Return the (3, 3) matrix to metres in the head frame; left-handed files are mirrored."""
    turn = file_from_head(asset.scene_unit, asset.up_axis, asset.handedness)
    return np.asarray(np.linalg.inv(turn), np.float64)


def _root_uv(asset: ApxAsset) -> Float64Array:
    """Return (G, 2) the texture coordinates of each guide's first corner, v upwards."""
    uv = np.zeros((asset.guides, 2))
    corner, first = np.unique(asset.faces.reshape(-1), return_index=True)
    uv[corner] = asset.face_uvs.reshape(-1, 2)[first]
    uv[:, 1] = 1.0 - uv[:, 1]
    return uv


def _binding(faces: Int64Array, guides: int) -> tuple[Int32Array, Float32Array]:
    """Return the first face (G,) at whose corner each guide is rooted, and its weights (G, 3)."""
    corner, first = np.unique(faces.reshape(-1), return_index=True)
    if len(corner) != guides:
        idle = np.setdiff1d(np.arange(guides), corner)
        raise FormatError(f"guide {idle[0]} is rooted on no face of the growth mesh")
    return (first // 3).astype(np.int32), np.eye(3, dtype=np.float32)[first % 3]


def _joints(asset: ApxAsset, bones: Float64Array) -> Float64Array:
    """Return root, neck and head: the bone that the hair hangs on most, or that is named head.

    The neck is the bone so named on the way from there up, or the one above; the root is where the
    way ends.
    """
    if not len(bones):
        return np.zeros((len(JOINT_NAMES), 3))
    lowered = [name.lower() for name in asset.bone_names]
    held = np.zeros(len(bones))
    np.add.at(held, asset.bone_indices.astype(np.int64), asset.bone_weights)
    named = [k for k, name in enumerate(lowered) if "head" in name]
    way = [max(named, key=lambda k: held[k]) if named else int(held.argmax())]
    while asset.bone_parents[way[-1]] >= 0 and len(way) < len(bones):
        way.append(int(asset.bone_parents[way[-1]]))
    necks = [k for k in way if "neck" in lowered[k]]
    return bones[[way[-1], necks[0] if necks else way[min(1, len(way) - 1)], way[0]]]


def _capsules(asset: ApxAsset, turn: Float64Array) -> Capsules:
    """Return capsules in the head frame; spheres in none become capsules without length."""
    bone = asset.spheres[:, 0].astype(np.int64)
    local = np.column_stack([asset.spheres[:, 2:], np.ones(len(bone))])
    placed = np.einsum("nc,nck->nk", local, asset.bind_poses[bone])[:, :3] @ turn.T
    radius = asset.spheres[:, 1] * asset.scene_unit / 100.0
    single = np.setdiff1d(np.arange(len(bone)), asset.capsules)
    pairs = np.concatenate([asset.capsules, np.column_stack([single, single])])
    return Capsules(
        _float32("boneSpheres", placed[pairs[:, 0]]),
        _float32("boneSpheres", placed[pairs[:, 1]]),
        _float32("boneSpheres", radius[pairs]),
    )


def _look(material: Material, length: float) -> HairMaterial:
    waves = _number(material, "waveFreq")
    waved = _number(material, "waveScale") > 0 and waves > 0 and length > 0
    return HairMaterial(
        _float32("rootColor", linear_from_srgb(_vector(material, "rootColor")[:3])),
        _float32("tipColor", linear_from_srgb(_vector(material, "tipColor")[:3])),
        max(_number(material, "width"), _SMALLEST_WIDTH_MM) / 1000,
        _number(material, "waveScale") / 100 if waved else 0.0,
        length / waves if waved else 0.0,
    )


def _physics(material: Material) -> HairPhysics:
    return HairPhysics(
        _number(material, "stiffness"),
        _number(material, "bendStiffness"),
        _number(material, "damping"),
        _number(material, "friction"),
        float(np.linalg.norm(_vector(material, "gravity"))) * STANDARD_GRAVITY,
    )


def _float32(name: str, values: Float64Array) -> Float32Array:
    if values.size and np.abs(values).max() > _FARTHEST:
        raise FormatError(f"{name} lies {np.abs(values).max():.3g} m away, expected a head")
    return values.astype(np.float32)


def _number(material: Material, name: str) -> float:
    return float(np.asarray(material[name], np.float64))


def _vector(material: Material, name: str) -> Float64Array:
    return np.asarray(material[name], np.float64)
