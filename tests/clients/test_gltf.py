"""glTF in Blender: lines, ribbons and head, skinned, and a simulation that plays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from blender_session import BlenderSession, only, z_up
from client_groom import moved, nodding, off_strands, swinging, written

from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.skinning import HEAD_JOINT, JOINT_NAMES
from hairkit.manager import Manager
from hairkit.types.groom import Groom

STRIPS, POINTS = 30, 12
RIBBONS = {"lines": "none", "strips": STRIPS, "strip_points": POINTS}
IMPORT = "import_scene.gltf"


def seen(blender: BlenderSession, path: Path, frames: Any = ()) -> list[dict[str, Any]]:
    """Return what Blender imports, without the shape that it makes to show bones."""
    things = blender.call("contents.imported", path=path, operator=IMPORT, frames=frames)
    return [thing for thing in things if thing["name"] != "Icosphere"]


def test_ribbons_lie_on_strands(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """The middle of every ribbon runs along a strand, v runs from root to tip, u across."""
    things = seen(blender, written(manager, groom, tmp_path / "hair.glb", **RIBBONS))
    mesh = only(things, "MESH", "hair")
    assert len(mesh["positions"]) == STRIPS * POINTS * 2
    middle = mesh["positions"].reshape(-1, 2, 3).mean(axis=1)
    assert off_strands(middle, z_up(groom.strands.points), groom.strands) < 1e-6
    corner = mesh["corners"]
    share = (corner // 2 % POINTS) / (POINTS - 1)
    np.testing.assert_allclose(mesh["uv"][0][:, 0], corner % 2, atol=1e-6)
    np.testing.assert_allclose(1 - mesh["uv"][0][:, 1], share, atol=1e-6)


@pytest.mark.parametrize("hair", ["ribbons", "cards"])
def test_hair_is_bound_to_the_head_joint(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, hair: str
) -> None:
    """Bones stand at the joints; the hair follows the armature's head with its whole weight."""
    things = seen(blender, written(manager, groom, tmp_path / "hair.glb", lines="none", hair=hair))
    bones, mesh = only(things, "ARMATURE"), only(things, "MESH", "hair")
    assert tuple(bones["bones"]) == tuple(mesh["groups"]) == JOINT_NAMES
    assert bones["parents"] == [None, "root", "neck"]
    np.testing.assert_allclose(bones["heads"], z_up(groom.head.joints), atol=1e-6)
    assert mesh["modifiers"] == ["ARMATURE"]
    assert (mesh["weights"][:, HEAD_JOINT] == 1).all()
    assert (mesh["weights"].sum(axis=1) == 1).all()


def test_the_head_arrives(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """Vertices, faces, uv and scalp are the head's; what grows hair follows the head joint."""
    things = seen(blender, written(manager, groom, tmp_path / "hair.glb", **RIBBONS))
    mesh, head = only(things, "MESH", "head"), groom.head
    np.testing.assert_allclose(mesh["positions"], z_up(head.vertices), atol=1e-7)
    np.testing.assert_array_equal(mesh["corners"].reshape(-1, 3), head.faces)
    np.testing.assert_allclose(mesh["uv"][0], head.uv[mesh["corners"]], atol=1e-6)
    np.testing.assert_allclose(mesh["attributes"]["_SCALP"], head.scalp, atol=1e-6)
    np.testing.assert_allclose(mesh["weights"].sum(axis=1), 1, atol=1e-6)
    assert (mesh["weights"][head.scalp > 0.5, HEAD_JOINT] == 1).all()


def test_lines_are_the_strands(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """Edges along strands, with number, group, guide flag, radius, root uv (v from the top)."""
    things = seen(blender, written(manager, groom, tmp_path / "hair.glb", hair="none"))
    mesh, strands = only(things, "MESH", "guides"), groom.strands
    have, owner = mesh["attributes"], strands.strand_of_point
    assert strands.widths is not None
    assert strands.root_uv is not None
    assert strands.group is not None
    assert strands.guide is not None
    first = strands.segments()[1]
    np.testing.assert_allclose(mesh["positions"], z_up(strands.points), atol=1e-7)
    np.testing.assert_array_equal(
        np.sort(np.sort(mesh["edges"], axis=1), axis=0), np.stack([first, first + 1], axis=1)
    )
    np.testing.assert_array_equal(have["_STRAND_ID"], owner)
    np.testing.assert_array_equal(have["_GROUP"], strands.group[owner])
    np.testing.assert_array_equal(have["_GUIDE"], strands.guide[owner])
    np.testing.assert_allclose(have["_RADIUS"], strands.widths / 2, rtol=1e-6)
    np.testing.assert_allclose(have["_ROOT_U"], strands.root_uv[owner, 0], atol=1e-6)
    np.testing.assert_allclose(1 - have["_ROOT_V"], strands.root_uv[owner, 1], atol=1e-6)
    assert mesh["parent"] == only(things, "ARMATURE")["name"]


def test_a_simulation_plays(
    blender: BlenderSession,
    manager: Manager,
    groom: Groom,
    frames: npt.NDArray[np.float32],
    stored_cache: Path,
    tmp_path: Path,
) -> None:
    """At frame k the ribbons lie on the strands as the cache has them at frame k."""
    path = written(manager, groom, tmp_path / "hair.glb", cache=stored_cache, **RIBBONS)
    mesh = only(seen(blender, path, [0, 1, 2]), "MESH", "hair")
    for wanted, places in zip(frames, mesh["frames"], strict=True):
        middle = places.reshape(-1, 2, 3).mean(axis=1)
        assert off_strands(middle, wanted, groom.strands) < 1e-6


@pytest.mark.parametrize("frames", [(0.05, 2.0), (0.05, 0.2)])
def test_a_long_simulation_plays(
    blender: BlenderSession,
    manager: Manager,
    groom: Groom,
    tmp_path: Path,
    frames: tuple[float, float],
) -> None:
    """Over 120 frames of swaying hair lines and ribbons are within 0.1 mm of the cache.

    Fast waves take a shape for each frame, slow ones fewer.
    """
    groom = groom.select(guide_mask(groom.strands))
    cache = swinging(groom, 120, np.linspace(*frames, 60))
    cache.save(tmp_path / "cache.npz")
    path = written(
        manager,
        groom,
        tmp_path / "hair.glb",
        cache=tmp_path / "cache.npz",
        strips=len(groom.strands),
    )
    things = seen(blender, path, list(range(120)))
    lines, hair = only(things, "MESH", "guides"), only(things, "MESH", "hair")
    for wanted, drawn, places in zip(
        z_up(cache.points), lines["frames"], hair["frames"], strict=True
    ):
        np.testing.assert_allclose(drawn, wanted, atol=1e-4)
        middle = places.reshape(-1, 2, 3).mean(axis=1)
        assert off_strands(middle, wanted, groom.strands) < 1e-4


@pytest.mark.parametrize("animation", ["morph", "skin"])
def test_the_head_nods_with_its_hair(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, animation: str
) -> None:
    """Of a head's motion, baked as shapes or as the skeleton's, skin and hair take part alike."""
    cache = nodding(groom)
    cache.save(tmp_path / "cache.npz")
    options = {"cache": tmp_path / "cache.npz", "animation": animation, **RIBBONS}
    path = written(manager, groom, tmp_path / "hair.glb", **options)
    things = seen(blender, path, [0, 1, 2])
    head, hair = only(things, "MESH", "head"), only(things, "MESH", "hair")
    scalp = groom.head.scalp > 0.5
    skin = z_up(moved(cache.head_from_rest, groom.head.vertices[scalp]))
    np.testing.assert_allclose(head["frames"][:, scalp], skin, atol=2e-6)
    strands = z_up(moved(cache.head_from_rest, groom.strands.points))
    for wanted, places in zip(strands, hair["frames"], strict=True):
        middle = places.reshape(-1, 2, 3).mean(axis=1)
        assert off_strands(middle, wanted, groom.strands) < 2e-6
