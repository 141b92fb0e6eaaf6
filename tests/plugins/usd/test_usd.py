"""USD: what is written is valid, means the groom, and comes back."""

from __future__ import annotations

import logging
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich_groom import rich_groom as rich_groom_on_ball

from hairkit.arrays import Float64Array
from hairkit.errors import InputError, MissingExtraError
from hairkit.grooming.prepare_export import complete_groom, dense_groom
from hairkit.head_model.skinning import head_weights
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.storage import to_arrays
from hairkit.synth import grow
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.point_cache import PointCache

pytest.importorskip("pxr", reason="usd-core is not installed")


def rich_groom() -> Groom:
    """Return guides and hair of unequal counts with everything that a groom may hold."""
    groom = dense_groom(bristle_groom(), 300, seed=3)
    strands = groom.strands.resampled_by_length(0.004)
    count, points = len(strands), len(strands.points)
    generator = np.random.default_rng(1)
    strands = replace(
        strands,
        widths=generator.uniform(5e-5, 1e-4, points).astype(np.float32),
        group=generator.integers(0, 3, count).astype(np.int32),
        guide=np.arange(count) < 264,
    )
    look = HairMaterial(np.array([0.2, 0.1, 0.05]), np.array([0.5, 0.3, 0.2]), 7e-5, 0.004, 0.03)
    physics = HairPhysics(stiffness=0.3, gravity=9.5)
    head = replace(groom.head, landmark_vertices=np.arange(68))
    return replace(groom, strands=strands, head=head, material=look, physics=physics)


def turning(groom: Groom, frames: int = 4) -> PointCache:
    """Return guides that turn rigidly with the head about a tilted axis while it moves."""
    moves = np.tile(np.eye(4), (frames, 1, 1))
    for frame, angle in enumerate(np.linspace(0.1, 2.9, frames)):
        moves[frame, :3, :3] = _rotation(angle)
        moves[frame, :3, 3] = [0.01 * frame, 0.02, -0.03]
    points = groom.strands.points.astype(np.float64)
    moved = np.einsum("tij,pj->tpi", moves[:, :3, :3], points) + moves[:, None, :3, 3]
    return PointCache(moved, np.arange(frames) / 30 + 0.5, moves)


def _rotation(angle: float) -> Float64Array:
    x, y, z = np.array([1.0, 2.0, 2.0]) / 3
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Float64Array = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn


def exported(
    manager: Manager, groom: Groom, folder: Path, *, animated: bool = False, **values: Any
) -> Path:
    """Return the crate file that the groom was written to."""
    path = folder / "groom.usdc"
    if animated:
        mask = complete_groom(groom).strands.guide
        assert mask is not None
        turning(groom.select(mask)).save(folder / "cache.npz")
        values["cache"] = folder / "cache.npz"
    options = manager.options("usd", values)
    manager.call("export_groom", "usd", options, groom=groom, path=path)
    return path


def opened(path: Path) -> Any:
    """Return the stage in a file."""
    from pxr import Usd

    return Usd.Stage.Open(str(path))


@pytest.mark.parametrize(
    ("name", "axis"),
    [
        ("a.usda", "y_up_metres"),
        ("a.usdc", "y_up_metres"),
        ("a.usd", "z_up_centimetres"),
    ],
)
def test_export_then_import_gives_the_whole_groom(
    manager: Manager, tmp_path: Path, name: str, axis: str
) -> None:
    """Every array comes back within float32 in other axes and units, and exactly in our own."""
    groom, path = rich_groom(), tmp_path / name
    options = manager.options("usd", {"axis": axis})
    manager.call("export_groom", "usd", options, groom=groom, path=path)
    back = to_arrays(manager.call("import_groom", "usd", options, path=path))
    there = to_arrays(complete_groom(groom))
    assert there.keys() == back.keys()
    for field, array in there.items():
        if axis == "y_up_metres":
            assert np.array_equal(array, back[field]), field
        np.testing.assert_allclose(back[field], array, rtol=3e-7, atol=3e-8, err_msg=field)


@pytest.mark.parametrize("animated", [False, True])
def test_validators_are_silent(manager: Manager, tmp_path: Path, animated: bool) -> None:
    """All of USD's validators have nothing to say about a still and an animated stage."""
    validation = pytest.importorskip("pxr.UsdValidation", reason="usd-core is too old")
    path = exported(manager, rich_groom(), tmp_path, animated=animated)
    validators = validation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) >= 20
    found = validation.ValidationContext(validators).Validate(opened(path))
    assert [(error.GetName(), error.GetMessage()) for error in found] == []


def test_equal_grooms_are_equal_files(manager: Manager, tmp_path: Path) -> None:
    """Writing twice gives the same bytes, as text and as crate."""
    groom = rich_groom()
    for suffix in (".usda", ".usdc"):
        paths = [tmp_path / f"{name}{suffix}" for name in "ab"]
        for path in paths:
            options = manager.options("usd", {})
            manager.call("export_groom", "usd", options, groom=groom, path=path)
        assert paths[0].read_bytes() == paths[1].read_bytes()


def test_guides_alone_are_marked_only_when_asked(manager: Manager, tmp_path: Path) -> None:
    """A file of guides alone marks none, as in Alembic: Unreal draws no marked strands."""
    from pxr import UsdGeom

    for asked in (False, True):
        folder = tmp_path / str(asked)  # the library keeps a stage for each path
        folder.mkdir()
        stage = opened(exported(manager, bristle_groom(), folder, mark_guides=asked))
        primvars = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/Groom/Hair"))
        assert bool(primvars.GetPrimvar("groom_guide")) == asked
        assert bool(primvars.GetPrimvar("groom_closest_guides")) == asked


def test_engines_find_what_they_read(manager: Manager, tmp_path: Path) -> None:
    """Unreal's attributes have the types its USD import takes; guides of guides are themselves."""
    from pxr import UsdGeom

    groom = rich_groom()
    stage = opened(exported(manager, groom, tmp_path))
    assert stage.GetDefaultPrim().GetTypeName() == "SkelRoot"
    hair = UsdGeom.BasisCurves(stage.GetPrimAtPath("/Groom/Hair"))
    assert (hair.GetTypeAttr().Get(), hair.GetWrapAttr().Get()) == ("linear", "nonperiodic")
    assert hair.GetWidthsInterpolation() == "vertex"
    primvars = UsdGeom.PrimvarsAPI(hair.GetPrim())
    types = {
        "groom_guide": "int[]",
        "groom_id": "int[]",
        "groom_group_id": "int[]",
        "groom_root_uv": "float2[]",
        "groom_color": "float3[]",
        "groom_closest_guides": "float3[]",
        "groom_guide_weights": "float3[]",
    }
    assert {name: str(primvars.GetPrimvar(name).GetTypeName()) for name in types} == types
    closest = np.array(primvars.GetPrimvar("groom_closest_guides").Get())
    assert np.array_equal(closest[:264, 0], np.arange(264))
    assert closest.max() < 264
    np.testing.assert_allclose(
        np.array(primvars.GetPrimvar("groom_guide_weights").Get()).sum(axis=1), 1, atol=1e-6
    )


def test_widths_and_extents_are_in_the_stage_unit(manager: Manager, tmp_path: Path) -> None:
    """Points, widths and extent scale together; metersPerUnit brings them back to metres."""
    from pxr import UsdGeom

    groom = rich_groom()
    stage = opened(exported(manager, groom, tmp_path, axis="z_up_centimetres"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    assert metres == 0.01
    hair = UsdGeom.BasisCurves(stage.GetPrimAtPath("/Groom/Hair"))
    widths = np.array(hair.GetWidthsAttr().Get()) * metres
    np.testing.assert_allclose(widths, groom.strands.widths, rtol=1e-6)
    x, y, z = (np.array(hair.GetPointsAttr().Get()) * metres).T
    np.testing.assert_allclose(np.stack([x, z, -y], 1), groom.strands.points, atol=1e-7)
    low, high = np.array(hair.GetExtentAttr().Get()) * metres
    assert (low <= [x.min(), y.min(), z.min()]).all()
    assert (high >= [x.max(), y.max(), z.max()]).all()


def test_left_handed_axes_are_refused(manager: Manager, tmp_path: Path) -> None:
    """USD has no left-handed stages; the error says what to take."""
    with pytest.raises(InputError, match="right-handed; take z_up_centimetres"):
        exported(manager, bristle_groom(), tmp_path, axis="unreal")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("axis", ["y_up_metres", "z_up_centimetres"])
def test_skin_and_hair_move_as_the_cache(manager: Manager, tmp_path: Path, axis: str) -> None:
    """At each frame USD's own skinning puts the head where the motion says, hair beside it.

    The hair's points are the cache's and no skeleton moves them again.
    """
    from pxr import Usd, UsdGeom, UsdSkel

    groom = bristle_groom()
    stage = opened(exported(manager, groom, tmp_path, animated=True, axis=axis))
    cache, space = turning(groom), manager.options("usd", {"axis": axis}).space
    hair = UsdGeom.BasisCurves(stage.GetPrimAtPath("/Groom/Hair"))
    assert not hair.GetPrim().HasAPI(UsdSkel.BindingAPI)
    mesh = stage.GetPrimAtPath("/Groom/Head")
    skins = UsdSkel.Cache()
    root = UsdSkel.Root(stage.GetDefaultPrim())
    skins.Populate(root, Usd.PrimDefaultPredicate)
    query = skins.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath("/Groom/Skeleton")))
    skin = skins.GetSkinningQuery(mesh)
    codes = hair.GetPointsAttr().GetTimeSamples()
    seconds = np.array(codes) / stage.GetTimeCodesPerSecond()
    np.testing.assert_allclose(seconds, cache.times, atol=1e-6)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (codes[0], codes[-1])
    for frame, code in enumerate(codes):
        here = space.points_to_head(np.array(hair.GetPointsAttr().Get(code)))
        np.testing.assert_allclose(here, cache.points[frame], atol=1e-7)
        points = UsdGeom.Mesh(mesh).GetPointsAttr().Get()
        assert skin.ComputeSkinnedPoints(query.ComputeSkinningTransforms(code), points, code)
        move = cache.head_from_rest[frame]
        wanted = groom.head.vertices @ move[:3, :3].T + move[:3, 3]
        np.testing.assert_allclose(space.points_to_head(np.array(points)), wanted, atol=2e-6)


def test_the_bust_hangs_on_the_neck(manager: Manager, tmp_path: Path) -> None:
    """In every frame the bust has a rigid motion that leaves the neck's joint on the head."""
    from pxr import UsdGeom

    groom = grow("straight", default_head(), 20, 0)
    space = manager.options("usd", {"axis": "z_up_centimetres"}).space
    stage = opened(exported(manager, groom, tmp_path, animated=True, axis="z_up_centimetres"))
    torso, cache = UsdGeom.Mesh(stage.GetPrimAtPath("/Groom/Torso")), turning(groom)
    joint = groom.head.joints[1].astype(np.float64)
    codes = torso.GetOrderedXformOps()[0].GetTimeSamples()
    for code, motion in zip(codes, cache.head_from_rest, strict=True):
        move = np.array(torso.GetLocalTransformation(code))
        placed = space.points_to_file(joint[None]) @ move[:3, :3] + move[3, :3]
        wanted = motion[:3, :3] @ joint + motion[:3, 3]
        np.testing.assert_allclose(space.points_to_head(placed)[0], wanted, atol=1e-6)


def test_still_hair_follows_the_head_joint(manager: Manager, tmp_path: Path) -> None:
    """A still groom is bound rigidly to the head joint, the mesh by the head's skin weights."""
    from pxr import UsdSkel

    groom = bristle_groom()
    stage = opened(exported(manager, groom, tmp_path))
    joints = UsdSkel.Skeleton(stage.GetPrimAtPath("/Groom/Skeleton")).GetJointsAttr().Get()
    assert list(joints) == ["root", "root/neck", "root/neck/head"]
    hair = UsdSkel.BindingAPI(stage.GetPrimAtPath("/Groom/Hair"))
    assert hair.GetJointIndicesPrimvar().GetInterpolation() == "constant"
    assert list(hair.GetJointIndicesAttr().Get()) == [2]
    mesh = UsdSkel.BindingAPI(stage.GetPrimAtPath("/Groom/Head"))
    weights = np.array(mesh.GetJointWeightsAttr().Get()).reshape(-1, 3)
    assert np.array_equal(weights, head_weights(groom.head))


def test_the_rest_pose_of_an_animated_file_is_read(
    manager: Manager, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The groom comes back as it was at rest, with a warning that frames were left."""
    groom = bristle_groom()
    path = exported(manager, groom, tmp_path, animated=True)
    with caplog.at_level(logging.WARNING, "hairkit"):
        back = manager.call("import_groom", "usd", manager.options("usd", {}), path=path)
    assert np.array_equal(back.strands.points, groom.strands.points)
    assert "4 frames; only one is read" in caplog.text


def test_hair_alone_goes_on_the_default_head(
    manager: Manager, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Without head mesh and guides the strands and settings come back all the same."""
    groom = rich_groom()
    path = exported(manager, groom, tmp_path, head_mesh=False, strands="hair")
    with caplog.at_level(logging.WARNING, "hairkit"):
        back = manager.call("import_groom", "usd", path=path)
    assert "no head; the default head" in caplog.text
    assert np.array_equal(back.strands.points, groom.strands.select(np.arange(264, 300)).points)
    assert vars(back.physics) == vars(groom.physics)
    assert back.material.curl_pitch == groom.material.curl_pitch


def test_colour_is_on_the_material(manager: Manager, tmp_path: Path) -> None:
    """The bound surface has the mean colour, and every point its own."""
    from pxr import UsdShade

    groom = rich_groom()
    stage = opened(exported(manager, groom, tmp_path))
    prim = stage.GetPrimAtPath("/Groom/Hair")
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    surface = material.ComputeSurfaceSource()[0]
    look = groom.material
    np.testing.assert_allclose(
        np.array(surface.GetInput("diffuseColor").Get()),
        (look.root_colour + look.tip_colour) / 2,
        rtol=1e-6,
    )
    colours = np.array(prim.GetAttribute("primvars:displayColor").Get())
    offsets = groom.strands.offsets
    np.testing.assert_allclose(colours[offsets[:-1]], np.tile(look.root_colour, (300, 1)))
    np.testing.assert_allclose(colours[offsets[1:] - 1], np.tile(look.tip_colour, (300, 1)))


def test_strands_without_length_are_left_out(
    manager: Manager, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """They are counted in a warning; the others are as before."""
    groom = bristle_groom()
    points = groom.strands.points.copy()
    points[5:10] = points[5]
    damaged = replace(groom, strands=replace(groom.strands, points=points))
    with caplog.at_level(logging.WARNING, "hairkit"):
        stage = opened(exported(manager, damaged, tmp_path))
    assert "1 strands without length are not written" in caplog.text
    counts = stage.GetPrimAtPath("/Groom/Hair").GetAttribute("curveVertexCounts").Get()
    assert len(counts) == len(groom.strands) - 1


def test_a_failed_export_leaves_the_old_file(
    manager: Manager, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither half a file nor a temporary one remains."""
    path = exported(manager, bristle_groom(), tmp_path)
    before = path.read_bytes()

    def interrupted(source: object, target: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        exported(manager, bristle_groom(), tmp_path, strands="guides", axis="z_up_metres")
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == before


def test_without_the_library_one_line_names_the_extra(
    manager: Manager, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Reading and writing say what to install."""
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'hairkit\[usd\]'"):
        exported(manager, bristle_groom(), tmp_path)
    with pytest.raises(MissingExtraError, match=r"pip install 'hairkit\[usd\]'"):
        manager.call(
            "import_groom", "usd", manager.options("usd", {}), path=tmp_path / "groom.usdc"
        )


def test_attributes_can_be_left_out(manager: Manager, tmp_path: Path) -> None:
    """Points and widths stay, the primvars of strands go; the validators stay silent."""
    from pxr import UsdGeom

    groom = rich_groom()
    path = exported(manager, groom, tmp_path, attributes=False)
    stage = opened(path)
    hair = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/Groom/Hair"))
    assert not [p for p in hair.GetPrimvars() if p.GetPrimvarName().startswith("groom_")]
    curves = UsdGeom.BasisCurves(stage.GetPrimAtPath("/Groom/Hair"))
    np.testing.assert_array_equal(curves.GetPointsAttr().Get(), groom.strands.points)


def test_the_skin_reads_its_pictures_beside_the_file(tmp_path: Path, manager: Manager) -> None:
    """Maps stand beside the stage, which reads them over `st`; blendshapes move as they should."""
    pxr = pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
    from pxr import UsdShade, UsdSkel

    groom = rich_groom_on_ball()
    manager.call("export_groom", "usd", groom=groom, path=tmp_path / "a.usda")
    stage = pxr.Stage.Open(str(tmp_path / "a.usda"))
    surface = UsdShade.Shader.Get(stage, "/Groom/Materials/Skin/Surface")
    for slot, name in (
        ("diffuseColor", "Albedo"),
        ("roughness", "Roughness"),
        ("normal", "Normal"),
    ):
        assert surface.GetInput(slot).HasConnectedSource()
        shader = UsdShade.Shader.Get(stage, f"/Groom/Materials/Skin/{name}")
        assert (tmp_path / shader.GetInput("file").Get().path).is_file()
    metres = stage.GetMetadata("metersPerUnit")
    query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(stage.GetPrimAtPath("/Groom/Head")))
    assert query.GetNumBlendShapes() == 2
    first = UsdSkel.BlendShape.Get(stage, "/Groom/Head/smile").GetOffsetsAttr().Get()
    wanted = np.linalg.norm(groom.head.blendshapes[0].offsets, axis=1)
    np.testing.assert_allclose(np.linalg.norm(first, axis=1) * metres, wanted, rtol=1e-5)
