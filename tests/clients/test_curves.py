"""Alembic and USD in Blender: hair curves, point by point, still and moving, there and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from blender_session import BlenderSession, only, z_up
from client_groom import moved, nodding, read_back, written

from hairkit.grooming.guide_weights import closest_guides
from hairkit.grooming.prepare_export import point_colours
from hairkit.head_model.skinning import JOINT_NAMES, head_weights
from hairkit.manager import Manager
from hairkit.types.groom import Groom
from hairkit.types.strands import PLANTED

OPERATORS = {".abc": "wm.alembic_import", ".usda": "wm.usd_import", ".usdc": "wm.usd_import"}
ALL = pytest.mark.parametrize("ending", OPERATORS)


@ALL
def test_strands_arrive_point_by_point(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, ending: str
) -> None:
    """Curves of as many points, at the same places; the radius of each point is half its width."""
    path = written(manager, groom, tmp_path / f"hair{ending}")
    things = blender.call("contents.imported", path=path, operator=OPERATORS[ending])
    hair, strands = only(things, "CURVES"), groom.strands
    assert strands.widths is not None
    np.testing.assert_array_equal(hair["offsets"], strands.offsets)
    np.testing.assert_allclose(hair["positions"], z_up(strands.points), atol=1e-7)
    np.testing.assert_allclose(hair["attributes"]["radius"], strands.widths / 2, rtol=1e-6)


@ALL
def test_centimetres_arrive_as_large(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, ending: str
) -> None:
    """USD says its unit, and Blender goes by it; Alembic cannot, the importer's scale tells it."""
    path = written(manager, groom, tmp_path / f"hair{ending}", axis="y_up_centimetres")
    options = {"scale": 0.01} if ending == ".abc" else {}
    things = blender.call(
        "contents.imported", path=path, operator=OPERATORS[ending], options=options
    )
    hair = only(things, "CURVES")
    np.testing.assert_allclose(hair["positions"], z_up(groom.strands.points), atol=1e-6)


@ALL
def test_a_simulation_plays(
    blender: BlenderSession,
    manager: Manager,
    groom: Groom,
    frames: npt.NDArray[np.float32],
    stored_cache: Path,
    tmp_path: Path,
    ending: str,
) -> None:
    """At 24 frames a second, frame k of the cache is where all strands are at frame k."""
    path = written(manager, groom, tmp_path / f"hair{ending}", cache=stored_cache)
    things = blender.call(
        "contents.imported", path=path, operator=OPERATORS[ending], frames=[0, 1, 2]
    )
    np.testing.assert_allclose(only(things, "CURVES")["frames"], frames, atol=1e-7)


@pytest.mark.parametrize("axis", ["z_up_metres", "z_up_centimetres"])
def test_usd_says_its_axes(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, axis: str
) -> None:
    """Hair and head stand where they stood, whatever axes and unit the file has."""
    path = written(manager, groom, tmp_path / "hair.usdc", axis=axis)
    things = blender.call("contents.imported", path=path, operator="wm.usd_import")
    hair, head = only(things, "CURVES"), only(things, "MESH")
    np.testing.assert_allclose(hair["positions"], z_up(groom.strands.points), atol=1e-6)
    np.testing.assert_allclose(head["positions"], z_up(groom.head.vertices), atol=1e-6)


def test_the_head_nods_with_its_hair(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """In USD the skeleton moves the skin of the head as the hair moves."""
    cache = nodding(groom)
    cache.save(tmp_path / "cache.npz")
    path = written(manager, groom, tmp_path / "hair.usdc", cache=tmp_path / "cache.npz")
    call = {"path": path, "operator": "wm.usd_import", "frames": [0, 1, 2]}
    things = blender.call("contents.imported", **call)
    scalp = groom.head.scalp > 0.5
    skin = z_up(moved(cache.head_from_rest, groom.head.vertices[scalp]))
    np.testing.assert_allclose(only(things, "MESH")["frames"][:, scalp], skin, atol=2e-6)
    strands = z_up(moved(cache.head_from_rest, groom.strands.points))
    np.testing.assert_allclose(only(things, "CURVES")["frames"], strands, atol=2e-6)


def test_groups_of_alembic_are_objects(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """With `split` brows and hair are hair curves of these names, point by point."""
    brows = np.arange(len(groom.strands)) % 3 == 0
    group = np.where(brows, PLANTED["brows"], 0)
    grouped = replace(groom, strands=replace(groom.strands, group=group))
    path = written(manager, grouped, tmp_path / "hair.abc", split=True)
    things = blender.call("contents.imported", path=path, operator="wm.alembic_import")
    for name, mask in (("brows", brows), ("hair_0", ~brows)):
        wanted = z_up(groom.strands.select(mask).points)
        np.testing.assert_allclose(only(things, "CURVES", name)["positions"], wanted, atol=1e-7)


def test_usd_carries_what_is_said_of_strands(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """Root uv, groups, guides, colours and guide weights are attributes of the curves."""
    path = written(manager, groom, tmp_path / "hair.usdc")
    things = blender.call("contents.imported", path=path, operator="wm.usd_import")
    have, strands, mix = (
        only(things, "CURVES")["attributes"],
        groom.strands,
        closest_guides(groom.strands),
    )
    for name in ("st", "groom_root_uv"):
        np.testing.assert_allclose(have[name], strands.root_uv, atol=1e-6)
    np.testing.assert_array_equal(have["groom_group_id"], strands.group)
    np.testing.assert_array_equal(have["groom_guide"], strands.guide)
    np.testing.assert_array_equal(have["groom_closest_guides"], mix.guides)
    np.testing.assert_allclose(have["groom_guide_weights"], mix.weights, atol=1e-6)
    np.testing.assert_allclose(have["groom_color"], point_colours(groom), atol=1e-6)


def test_usd_brings_the_head_and_its_skin(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """Vertices, faces and uv of the head, three bones at its joints, and every vertex's weights."""
    path = written(manager, groom, tmp_path / "hair.usdc")
    things = blender.call("contents.imported", path=path, operator="wm.usd_import")
    mesh, bones, head = only(things, "MESH"), only(things, "ARMATURE"), groom.head
    np.testing.assert_allclose(mesh["positions"], z_up(head.vertices), atol=1e-7)
    np.testing.assert_array_equal(mesh["corners"].reshape(-1, 3), head.faces)
    np.testing.assert_allclose(mesh["uv"][0], head.uv[mesh["corners"]], atol=1e-6)
    assert mesh["modifiers"] == ["ARMATURE"]
    assert tuple(bones["bones"]) == tuple(mesh["groups"]) == JOINT_NAMES
    assert bones["parents"] == [None, "root", "neck"]
    np.testing.assert_allclose(bones["heads"], z_up(head.joints), atol=1e-6)
    np.testing.assert_allclose(mesh["weights"], head_weights(head), atol=1e-6)


@pytest.mark.parametrize("ending", [".abc", ".usda", ".usdc"])
def test_what_blender_writes_is_read(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, ending: str
) -> None:
    """Hair curves that Blender exports become a groom of the same points and widths."""
    strands = groom.strands
    assert strands.widths is not None
    path = tmp_path / f"from_blender{ending}"
    blender.call(
        "exports.hair",
        path=path,
        points=z_up(strands.points).tolist(),
        counts=strands.counts.tolist(),
        radius=(strands.widths / 2).tolist(),
    )
    read = read_back(manager, path).strands
    np.testing.assert_array_equal(read.offsets, strands.offsets)
    np.testing.assert_allclose(read.points, strands.points, atol=1e-7)
    np.testing.assert_allclose(read.widths, strands.widths, rtol=1e-5)
