"""Make a HairWorks asset of a groom: resample, bind, fill in the material."""

from __future__ import annotations

from types import MappingProxyType
from typing import Protocol

import numpy as np

import hairkit
from hairkit.arrays import Float64Array, Int64Array
from hairkit.head_model.scalp import growth_mesh, roots_at
from hairkit.types.groom import Groom
from hairkit.types.head import Head, Roots
from hairkit.types.strands import Strands

from . import schema
from .asset import ApxAsset, Material, MaterialValue

CENTIMETRES = {"cm": 1.0, "m": 100.0}
UP_AXIS = {"y_up": 1, "z_up": 2}
RIGHT_HANDED = 1
BONES = ("root", "neck", "head")
PARENTS = (-1, 0, 1)

FILE_FROM_HEAD = {
    "y_up": np.eye(3),
    "z_up": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
"""Rotations from the head frame to the file's axes: z_up is (x, -z, y)."""

STANDARD_GRAVITY = 9.81
_WAVE_POINTS = 4
_MIN_DENSITY, _MAX_DENSITY = 0.01, 10.0


class ApxOptions(Protocol):
    """Options of the plugin that `groom_to_asset` uses."""

    @property
    def points_per_strand(self) -> int: ...
    @property
    def unit(self) -> str: ...
    @property
    def axis(self) -> str: ...
    @property
    def hairs(self) -> int: ...
    @property
    def author(self) -> str: ...
    @property
    def last_modified(self) -> str: ...


def groom_to_asset(groom: Groom, options: ApxOptions) -> ApxAsset:
    """Return the asset of a groom, all its strands guides, in the unit and axes of `options`.

    Raises
    ------
    InputError
        There are fewer than three guides, or they stand on one line.
    """
    head = groom.head
    turn = FILE_FROM_HEAD[options.axis] * (100.0 / CENTIMETRES[options.unit])
    strands = groom.strands.resampled(options.points_per_strand)
    roots = _roots(groom)
    faces = _every_root_used(growth_mesh(roots, head).astype(np.int64), roots)
    uv = roots.uv[faces].astype(np.float64)
    uv[..., 1] = 1.0 - uv[..., 1]
    joints = head.joints.astype(np.float64) @ turn.T
    spheres, capsules = _collision(head, joints, turn)
    count = len(strands)
    return ApxAsset(
        vertices=strands.points.astype(np.float64) @ turn.T,
        end_indices=strands.offsets[1:] - 1,
        faces=faces,
        face_uvs=uv,
        bone_indices=np.tile([float(BONES.index("head")), 0.0, 0.0, 0.0], (count, 1)),
        bone_weights=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        bone_names=BONES,
        bind_poses=_bind_poses(joints),
        bone_parents=np.array(PARENTS),
        spheres=spheres,
        capsules=capsules,
        scene_unit=CENTIMETRES[options.unit],
        up_axis=UP_AXIS[options.axis],
        handedness=RIGHT_HANDED,
        materials=_materials(groom, strands, len(faces), len(capsules) > 0, options),
        info=("1.1", f"hairkit {hairkit.__version__}", "", options.author, options.last_modified),
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


def _every_root_used(faces: Int64Array, roots: Roots) -> Int64Array:
    """Return the faces and one more for each root without any: its nearest neighbour's, moved."""
    idle = np.setdiff1d(np.arange(len(roots)), faces)
    if not len(idle):
        return faces
    used = np.unique(faces)
    added = []
    for root in idle:
        offset = roots.positions[used] - roots.positions[root]
        twin = used[np.einsum("nc,nc->n", offset, offset).argmin()]
        face = faces[(faces == twin).any(axis=1)][0]
        added.append(np.where(face == twin, root, face))
    return np.concatenate([faces, added])


def _bind_poses(joints: Float64Array) -> Float64Array:
    poses = np.tile(np.eye(4), (len(joints), 1, 1))
    poses[:, 3, :3] = joints
    return poses


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
    groom: Groom, strands: Strands, faces: int, collide: bool, options: ApxOptions
) -> tuple[Material, ...]:
    """Return the captured material and three unused ones."""
    up = FILE_FROM_HEAD[options.axis] @ np.array([0.0, 1.0, 0.0])
    strength = groom.physics.gravity / STANDARD_GRAVITY
    gravity = tuple(float(value) + 0.0 for value in -up * strength)
    defaults = {f.name: _default(f) for f in schema.MATERIAL_FIELDS} | {"gravity": gravity}
    density = options.hairs / (schema.HAIRS_PER_FACE * faces)
    look, physics = groom.material, groom.physics
    captured: dict[str, MaterialValue] = {
        "width": look.width * 1000,
        "density": float(np.clip(density, _MIN_DENSITY, _MAX_DENSITY)),
        "lengthNoise": 0.0,  # lengths are captured; no random trimming
        "rootColor": (*map(float, look.root_colour), 1.0),
        "tipColor": (*map(float, look.tip_colour), 1.0),
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
