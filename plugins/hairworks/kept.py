"""What an .apx file held beyond its groom, carried to the .apx file that is written of it.

A groom that was read keeps the file it came from. Written again, everything that the groom still
agrees with stays as the artist made it: the material, the textures, the bones with the weights of
the guides, stops and pins, the growth mesh.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.types.groom import Groom

from . import schema
from .asset import ApxAsset, MaterialValue
from .from_groom import Layout, groom_to_asset
from .reader import parse_apx
from .to_groom import asset_to_groom

FORMAT = "HairWorks"
_SAME = 1e-5
"""Relative difference below which a value of the material was not changed."""
_SAME_PLACE = 1e-6
"""Metres, likewise of joints, capsules and roots."""


def asset_carried_by(groom: Groom) -> ApxAsset | None:
    """Return the asset that the groom was read from, or None."""
    if groom.carried is None or groom.carried.format != FORMAT:
        return None
    return parse_apx(groom.carried.content.tobytes())


def with_kept_values(asset: ApxAsset, groom: Groom, kept: ApxAsset, layout: Layout) -> ApxAsset:
    """Return the asset of a groom with all of the carried one that the groom still agrees with.

    Parameters
    ----------
    asset
        What `groom_to_asset` makes of the groom.
    groom
        As it is now.
    kept
        The asset that it was read from.
    layout
        That of `asset`; with hairs=0 the density stays too.
    """
    read = asset_to_groom(kept)
    before = groom_to_asset(read, layout).materials[0]
    now = asset.materials[0]
    changed = {name: value for name, value in now.items() if not _equal(value, before[name])}
    if layout.hairs == 0:
        changed.pop("density", None)
    first = MappingProxyType({**kept.materials[0], **_turned(kept, layout), **changed})
    asset = replace(
        asset,
        materials=(first, *kept.materials[1:]),
        textures=kept.textures,
        info=(*asset.info[:2], _source(kept), *asset.info[3:]),
    )
    if not _same_body(groom, read):
        return asset
    return _with_bones(asset, groom, read, kept, layout)


def _source(kept: ApxAsset) -> str:
    """Return the scene that the file was made from, where its name can be written."""
    source = kept.info[schema.INFO_FIELDS.index("sourcePath")]
    fits = len(source) <= schema.MAX_STRING and source.isascii() and source.isprintable()
    return source if fits else ""


def _equal(first: MaterialValue, second: MaterialValue) -> bool:
    if isinstance(first, (str, bool)) or isinstance(second, (str, bool)):
        return first == second
    return bool(np.allclose(first, second, rtol=_SAME, atol=_SAME))


def _turned(kept: ApxAsset, layout: Layout) -> dict[str, MaterialValue]:
    """Return the material's directions in the axes of the file to be written."""
    turn = _from_kept(kept, layout)[1]
    vectors = {
        name: np.asarray(kept.materials[0][name], np.float64) for name in ("gravity", "wind")
    }
    return {name: tuple((vector @ turn.T + 0.0).tolist()) for name, vector in vectors.items()}


def _from_kept(kept: ApxAsset, layout: Layout) -> tuple[float, Float64Array]:
    """Return the scale and the rotation (3, 3) from the carried file's space to the new one."""
    old = Layout(2, kept.scene_unit, kept.up_axis, kept.handedness, 0, "").turn
    whole = layout.turn @ np.linalg.inv(old)
    scale = float(np.cbrt(abs(np.linalg.det(whole))))
    return scale, whole / scale


def _same_body(groom: Groom, read: Groom) -> bool:
    """Return whether joints and capsules are those that were read."""
    new, old = groom.head, read.head
    pairs = (
        (new.joints, old.joints),
        (new.capsules.first, old.capsules.first),
        (new.capsules.second, old.capsules.second),
        (new.capsules.radius, old.capsules.radius),
    )
    return all(
        one.shape == two.shape and np.allclose(one, two, atol=_SAME_PLACE) for one, two in pairs
    )


def _with_bones(
    asset: ApxAsset, groom: Groom, read: Groom, kept: ApxAsset, layout: Layout
) -> ApxAsset:
    """Return the asset on the carried bones; other guides take the weights of the nearest."""
    scale, turn = _from_kept(kept, layout)
    poses, spheres, pins = kept.bind_poses.copy(), kept.spheres.copy(), kept.pins.copy()
    poses[:, :3, :3] = poses[:, :3, :3] @ turn.T
    poses[:, 3, :3] = scale * poses[:, 3, :3] @ turn.T
    spheres[:, 1:] *= scale
    pins[:, 1:] *= scale
    roots, old = groom.strands.roots, read.strands.roots
    if roots.shape == old.shape and np.allclose(roots, old, atol=_SAME_PLACE):
        near = np.arange(len(old))
        asset = replace(asset, faces=kept.faces, face_uvs=kept.face_uvs)
    else:
        near = cKDTree(old).query(roots)[1]
    bound = bool(len(kept.bone_names))
    return replace(
        asset,
        bone_names=kept.bone_names,
        bone_parents=kept.bone_parents,
        bind_poses=poses,
        spheres=spheres,
        capsules=kept.capsules,
        pins=pins,
        bone_indices=kept.bone_indices[near] if bound else kept.bone_indices,
        bone_weights=kept.bone_weights[near] if bound else kept.bone_weights,
    )
