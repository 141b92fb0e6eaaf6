"""Laws of .apx files written of .apx files: what was not changed stays the artist's."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hairkit_plugins import hairworks
from hairkit_plugins.hairworks import schema
from hypothesis import given, settings
from hypothesis import strategies as st
from references import reference

from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom, HairMaterial

NAMES = ("Head", "Spine03", "Neck", "Clavicle_L", "Clavicle_R")
PARENTS = (2, -1, 1, 2, 2)
"""The skeleton of a head of NVIDIA's: the root has a name of its own."""


def artists_asset(seed: int = 0, **space: Any) -> hairworks.ApxAsset:
    """Return an asset whose every value is somebody's: random material, textures, bones, pins."""
    rng = np.random.default_rng(seed)
    options = hairworks.Options(points_per_strand=int(rng.integers(2, 9)), **space)
    asset = hairworks.exported_asset(bristle_groom(), options)
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, :3, :3] = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(5)]
    poses[:, 3, :3] = rng.normal(scale=0.1, size=(5, 3)) * 100 / asset.scene_unit
    return replace(
        asset,
        bone_names=NAMES,
        bone_parents=np.array(PARENTS),
        bind_poses=poses,
        spheres=np.column_stack([rng.integers(0, 5, 6), rng.uniform(1, 9, (6, 4))]),
        capsules=rng.permutation(6).reshape(3, 2),
        pins=np.column_stack([rng.integers(0, 5, 2), rng.uniform(1, 9, (2, 4))]),
        bone_indices=rng.integers(0, 5, (asset.guides, 4)).astype(float),
        bone_weights=rng.dirichlet(np.ones(4), asset.guides),
        textures=tuple(f"t{n}.tga" if rng.random() < 0.5 else "" for n in range(16)),
        materials=tuple(_random_material(rng) for _ in range(4)),
    )


def _random_material(rng: np.random.Generator) -> MappingProxyType[str, Any]:
    made: dict[str, Any] = {}
    for field in schema.MATERIAL_FIELDS:
        made[field.name] = {
            "String": lambda: "skin",
            "Bool": lambda: bool(rng.random() < 0.5),
            "U32": lambda: int(rng.integers(0, 5)),
            "F32": lambda: float(rng.uniform(0.1, 2)),
        }.get(field.type, lambda n=field: tuple(rng.uniform(0, 1, schema.COMPONENTS[n.type])))()
    return MappingProxyType(made)


def through(asset: hairworks.ApxAsset, folder: Path, **options: Any) -> hairworks.ApxAsset:
    """Return the asset after it was read as a groom, stored, and written again."""
    (folder / "in.apx").write_text(hairworks.asset_text(asset))
    groom = hairworks.import_groom(folder / "in.apx", hairworks.Options())
    groom.save(folder / "groom.npz")
    hairworks.export_groom(
        Groom.load(folder / "groom.npz"), folder / "out.apx", hairworks.Options(**options)
    )
    return hairworks.read_apx(folder / "out.apx")


def assert_same(found: hairworks.ApxAsset, wanted: hairworks.ApxAsset) -> None:
    for field in fields(wanted):
        one, two = getattr(found, field.name), getattr(wanted, field.name)
        if field.name == "info":
            continue
        if field.name != "materials":
            kind = np.testing.assert_array_equal if one is two or _texts(one) else _close
            kind(one, two, err_msg=field.name)
            continue
        for mine, theirs in zip(one, two, strict=True):
            for name, value in theirs.items():
                same = np.testing.assert_array_equal if isinstance(value, (str, bool)) else _close
                same(mine[name], value, err_msg=name)


def _texts(value: object) -> bool:
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], str)


def _close(one: Any, two: Any, err_msg: str) -> None:
    np.testing.assert_allclose(one, two, rtol=1e-6, atol=2e-6, err_msg=err_msg)


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 1000))
@pytest.mark.parametrize("axis", ["y_up", "z_up"])
def test_nothing_of_an_artists_file_is_lost(
    tmp_path_factory: pytest.TempPathFactory, axis: str, seed: int
) -> None:
    """Material, textures, bones, weights, stops, pins, growth mesh and points: read and written."""
    asset = artists_asset(seed, axis=axis, unit="m" if seed % 2 else "cm")
    assert_same(through(asset, tmp_path_factory.mktemp("apx")), asset)


def test_a_left_handed_file_stays_one(tmp_path: Path) -> None:
    """Handedness is kept, and with it every number."""
    asset = replace(artists_asset(3), handedness=2)
    assert_same(through(asset, tmp_path), asset)


def test_what_was_changed_changes_and_nothing_else(tmp_path: Path) -> None:
    """A new colour reaches the file; the other 129 values of the material are the artist's."""
    (tmp_path / "in.apx").write_text(hairworks.asset_text(artists_asset(4)))
    groom = hairworks.import_groom(tmp_path / "in.apx", hairworks.Options())
    old = hairworks.read_apx(tmp_path / "in.apx").materials[0]
    look = HairMaterial(np.array([0.5, 0, 0]), groom.material.tip_colour, groom.material.width,
                        groom.material.curl_radius, groom.material.curl_pitch)  # fmt: skip
    hairworks.export_groom(replace(groom, material=look), tmp_path / "out.apx", hairworks.Options())
    new = hairworks.read_apx(tmp_path / "out.apx").materials[0]
    changed = {name for name in old if not np.all(np.isclose(_n(old[name]), _n(new[name])))}
    assert changed == {"rootColor"}


def _n(value: Any) -> Any:
    return float(len(value)) if isinstance(value, str) else np.asarray(value, float)


def test_fewer_guides_keep_bones_and_weights(tmp_path: Path) -> None:
    """Guides that were taken away leave the others with their own weights."""
    asset = artists_asset(5)
    (tmp_path / "in.apx").write_text(hairworks.asset_text(asset))
    groom = hairworks.import_groom(tmp_path / "in.apx", hairworks.Options())
    keep = np.arange(len(groom.strands)) % 3 > 0
    hairworks.export_groom(groom.select(keep), tmp_path / "o.apx", hairworks.Options())
    found = hairworks.read_apx(tmp_path / "o.apx")
    assert found.bone_names == NAMES
    _close(found.bone_weights, asset.bone_weights[keep], "weights")
    _close(found.spheres, asset.spheres, "spheres")


def test_another_unit_and_axis_move_bones_as_they_move_hair(tmp_path: Path) -> None:
    """Asked for metres and Z up, a file reads back as the same groom on the same bones."""
    asset = artists_asset(6, axis="y_up", unit="cm")
    turned = through(asset, tmp_path, axis="z_up", unit="m")
    assert (turned.up_axis, turned.scene_unit) == (2, 100.0)
    one, two = (
        hairworks.import_groom(tmp_path / name, hairworks.Options())
        for name in ("in.apx", "out.apx")
    )
    _close(two.strands.points, one.strands.points, "points")
    _close(two.head.joints, one.head.joints, "joints")
    _close(two.head.capsules.first, one.head.capsules.first, "capsules")
    _close(two.head.capsules.radius, one.head.capsules.radius, "radii")
    _close(two.physics.gravity, one.physics.gravity, "gravity")


def test_joints_are_those_of_the_skeleton_whatever_their_names(tmp_path: Path) -> None:
    """The root is the bone that has no parent, the neck lies between it and the head."""
    asset = artists_asset(7)
    (tmp_path / "in.apx").write_text(hairworks.asset_text(asset))
    groom = hairworks.import_groom(tmp_path / "in.apx", hairworks.Options())
    places = asset.bind_poses[:, 3, :3] * asset.scene_unit / 100
    _close(groom.head.joints, places[[1, 2, 0]], "joints")


def test_colours_are_those_of_the_picker() -> None:
    """Files hold sRGB: half of the light is 188 of 255."""
    look = HairMaterial(np.array([0.5, 0.0, 1.0]))
    groom = replace(bristle_groom(), material=look)
    asset = hairworks.exported_asset(groom, hairworks.Options())
    _close(asset.materials[0]["rootColor"], (0.735357, 0, 1, 1), "colour")


def test_the_growth_mesh_is_cut_at_the_parting() -> None:
    """No edge joins guides that run more than a right angle apart, and every root has a face."""
    groom = bristle_groom()
    x = groom.strands.roots[:, 0]
    points = groom.strands.points.reshape(len(x), -1, 3).copy()
    lie = np.linspace(0, 0.03, points.shape[1])
    points[:] = points[:, :1]
    points[..., 0] += np.where(x >= 0, 1, -1)[:, None] * lie
    parted = replace(groom, strands=replace(groom.strands, points=points.reshape(-1, 3)))
    asset = hairworks.exported_asset(parted, hairworks.Options())
    side = np.where(x >= 0, 1, -1)[asset.faces]
    assert (side == side[:, :1]).all()
    assert set(asset.faces.ravel()) == set(range(len(x)))


def test_a_file_of_nvidias_comes_back_whole(tmp_path: Path) -> None:
    """A real file is written as it was read, but for the tool's name and the date."""
    path = reference("apx/ExampleAsset_unity3d-jp.apx")
    groom = hairworks.import_groom(path, hairworks.Options())
    hairworks.export_groom(groom, tmp_path / "out.apx", hairworks.Options())
    assert_same(hairworks.read_apx(tmp_path / "out.apx"), hairworks.read_apx(path))
