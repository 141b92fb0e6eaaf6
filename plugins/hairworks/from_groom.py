"""Make a HairWorks asset of a groom: resample, bind, fill in the material."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.colour import srgb_from_linear
from hairkit.head_model.scalp import growth_mesh, roots_at
from hairkit.head_model.skinning import HEAD_JOINT, JOINT_NAMES, JOINT_PARENTS
from hairkit.types.groom import Groom
from hairkit.types.head import Head, Roots
from hairkit.types.strands import Strands
from hairkit.version import __version__

from . import schema
from .asset import ApxAsset, Material, MaterialValue
from .space import LEFT_HANDED, file_from_head

LAST_MODIFIED = "2000-01-01 00:00:00 UTC"
"""Date in the file; fixed, so that equal grooms are equal files."""
STANDARD_GRAVITY = 9.81
_WAVE_POINTS = 4
_MIN_DENSITY, _MAX_DENSITY = 0.01, 10.0


@dataclass(frozen=True)
class Layout:
    """How an asset is laid out: the plugin's options, or what the file said that was read."""

    points: int
    """Points of every guide."""
    centimetres: float
    """Of one unit of the file."""
    up_axis: int
    handedness: int
    hairs: int
    """Drawn in all."""
    author: str

    @property
    def turn(self) -> Float64Array:
        """(3, 3) from metres in the head frame."""
        return file_from_head(self.centimetres, self.up_axis, self.handedness)


def groom_to_asset(groom: Groom, layout: Layout) -> ApxAsset:
    """Return the asset of a groom, all its strands guides.

    Raises
    ------
    InputError
        There are fewer than three guides, or they stand on one line.
    """
    head, turn = groom.head, layout.turn
    strands = groom.strands
    if (strands.counts != layout.points).any():
        strands = strands.resampled(layout.points)
    roots = _roots(groom)
    faces = _parted(growth_mesh(roots, head).astype(np.int64), roots, strands)
    uv = roots.uv[faces].astype(np.float64)
    uv[..., 1] = 1.0 - uv[..., 1]
    joints = head.joints.astype(np.float64) @ turn.T
    poses = np.tile(np.eye(4), (len(joints), 1, 1))
    poses[:, 3, :3] = joints
    spheres, capsules = _collision(head, joints, turn)
    count = len(strands)
    return ApxAsset(
        vertices=strands.points.astype(np.float64) @ turn.T,
        end_indices=strands.offsets[1:] - 1,
        faces=faces[:, ::-1] if layout.handedness == LEFT_HANDED else faces,
        face_uvs=uv[:, ::-1] if layout.handedness == LEFT_HANDED else uv,
        bone_indices=np.tile([float(HEAD_JOINT), 0.0, 0.0, 0.0], (count, 1)),
        bone_weights=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        bone_names=JOINT_NAMES,
        bind_poses=poses,
        bone_parents=np.array(JOINT_PARENTS),
        spheres=spheres,
        capsules=capsules,
        scene_unit=layout.centimetres,
        up_axis=layout.up_axis,
        handedness=layout.handedness,
        materials=_materials(groom, strands, len(faces), len(capsules) > 0, layout),
        info=("1.1", f"hairkit {__version__}", "", layout.author, LAST_MODIFIED),
    )


def _roots(groom: Groom) -> Roots:
    """Return the roots exactly where the guides start, as HairWorks demands of its growth mesh."""
    bound = roots_at(groom.head, groom.root_triangle, groom.root_barycentric)
    uv = groom.strands.root_uv
    return Roots(
        groom.strands.roots,
        bound.normals,
        bound.uv if uv is None else uv,
        bound.triangle,
        bound.barycentric,
    )


def _parted(faces: Int64Array, roots: Roots, strands: Strands) -> Int64Array:
    """Return the growth mesh cut where hair parts, with every root in a face.

    HairWorks interpolates hair over each face ("Using HairWorks", NVIDIA: cut a gap where hair
    parts), so that no edge may join guides that run more than a right angle apart. A root that is
    left without a face gets one with the nearest roots that run as it does.
    """
    way = (strands.tips - strands.roots).astype(np.float64)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
    agree = np.stack([(way[faces[:, k]] * way[faces[:, k - 1]]).sum(axis=1) for k in range(3)])
    faces = faces[(agree >= 0).all(axis=0)]
    idle = np.setdiff1d(np.arange(len(roots)), faces)
    added = [_own_face(root, roots, way) for root in idle]
    return np.concatenate([faces, np.array(added, np.int64).reshape(-1, 3)])


def _own_face(root: int, roots: Roots, way: Float64Array) -> Int64Array:
    """Return a face of a root and the two nearest that run as it does, or the two nearest."""
    offset = roots.positions.astype(np.float64) - roots.positions[root]
    order = np.argsort((offset**2).sum(axis=1), kind="stable")
    order = order[order != root]
    agreeing = order[(way[order] @ way[root] >= 0)]
    second = agreeing[0] if len(agreeing) else order[0]
    third = agreeing[way[agreeing] @ way[second] >= 0]
    third = third[third != second]
    corners = np.array([root, second, third[0] if len(third) else order[order != second][0]])
    a, b, c = roots.positions[corners].astype(np.float64)
    outward = roots.normals[corners].sum(axis=0)
    return corners if np.cross(b - a, c - a) @ outward >= 0 else corners[::-1]


def _collision(
    head: Head, joints: Float64Array, turn: Float64Array
) -> tuple[Float64Array, Int64Array]:
    """Return spheres (2C, 5), each on the joint nearest to it, and capsules (C, 2) of the head."""
    shapes = head.capsules
    centres = np.stack([shapes.first, shapes.second], axis=1).reshape(-1, 3) @ turn.T
    radii = shapes.radius.reshape(-1).astype(np.float64) * np.linalg.norm(turn[0])
    away = np.linalg.norm(centres[:, None] - joints, axis=-1)
    bone = away.argmin(axis=1)
    local = centres - joints[bone]
    spheres = np.column_stack([bone.astype(np.float64), radii, local])
    return spheres, np.arange(len(spheres)).reshape(-1, 2)


def _materials(
    groom: Groom, strands: Strands, faces: int, collide: bool, layout: Layout
) -> tuple[Material, ...]:
    """Return the captured material and three unused ones."""
    up = layout.turn[:, 1] / np.linalg.norm(layout.turn[:, 1])
    strength = groom.physics.gravity / STANDARD_GRAVITY
    gravity = tuple(float(value) + 0.0 for value in -up * strength)
    defaults = {f.name: _default(f) for f in schema.MATERIAL_FIELDS} | {"gravity": gravity}
    density = layout.hairs / (schema.HAIRS_PER_FACE * faces)
    look, physics = groom.material, groom.physics
    captured: dict[str, MaterialValue] = {
        "width": look.width * 1000,
        "density": float(np.clip(density, _MIN_DENSITY, _MAX_DENSITY)),
        "lengthNoise": 0.0,  # lengths are captured; no random trimming
        # colours as pickers show them: files of NVIDIA's tools hold sRGB
        "rootColor": (*map(float, srgb_from_linear(look.root_colour)), 1.0),
        "tipColor": (*map(float, srgb_from_linear(look.tip_colour)), 1.0),
        "stiffness": physics.stiffness,
        "bendStiffness": physics.bend_stiffness,
        "damping": physics.damping,
        "friction": physics.friction,
        "useCollision": collide,
        "inertiaScale": 1.0,  # the SDK's 0 would leave hair still when the head moves
        "inertiaLimit": 1000.0,
        **_waves(groom, strands),
    }
    unused = MappingProxyType(defaults)
    return (MappingProxyType(defaults | captured), *[unused] * (schema.MATERIALS - 1))


def _waves(groom: Groom, strands: Strands) -> dict[str, MaterialValue]:
    """Return HairWorks' waves: what the guides' points are too far apart to show.

    Amplitude in centimetres, frequency in turns along the mean guide.
    """
    look, length = groom.material, float(strands.lengths().mean())
    spacing = length / max(len(strands.points) // len(strands) - 1, 1)
    if not (look.curl_radius > 0 and look.curl_pitch > 0) or length == 0:
        return {}
    if spacing * _WAVE_POINTS <= look.curl_pitch:
        return {}
    return {"waveScale": look.curl_radius * 100, "waveFreq": length / look.curl_pitch}


def _default(field: schema.Field) -> MaterialValue:
    if field.type == "String":
        return field.default
    if field.type == "Bool":
        return field.default == "true"
    if field.type == "U32":
        return schema.NO_BONE if field.default == schema.NO_BONE_TEXT else int(field.default)
    numbers = tuple(float(word) for word in field.default.split())
    return numbers[0] if field.type == "F32" else numbers
