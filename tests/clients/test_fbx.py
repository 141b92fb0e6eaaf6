"""FBX in Blender's two importers: the head, its skeleton and its skin."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender_session import BlenderSession, only, z_up
from client_groom import written

from hairkit.head_model.skinning import JOINT_NAMES, head_weights
from hairkit.manager import Manager
from hairkit.types.groom import Groom

IMPORTERS = ["import_scene.fbx", "wm.fbx_import"]
AXES = ["y_up_centimetres", "z_up_metres", "unreal"]


@pytest.fixture(params=[(operator, axis) for operator in IMPORTERS for axis in AXES], ids=":".join)
def things(
    request: pytest.FixtureRequest,
    blender: BlenderSession,
    manager: Manager,
    groom: Groom,
    tmp_path: Path,
) -> list[dict[str, Any]]:
    """What an importer makes of a file of some axes and unit, which the file itself says."""
    operator, axis = request.param
    path = written(manager, groom, tmp_path / "head.fbx", axis=axis)
    found: list[dict[str, Any]] = blender.call("contents.imported", path=path, operator=operator)
    return found


def test_the_head_stands_where_it_stood(things: list[dict[str, Any]], groom: Groom) -> None:
    """Vertices (in metres), faces and uv are those of the head, and the scalp is its colour."""
    mesh, head = only(things, "MESH"), groom.head
    np.testing.assert_allclose(mesh["positions"], z_up(head.vertices), atol=1e-6)
    np.testing.assert_array_equal(mesh["corners"].reshape(-1, 3), head.faces)
    np.testing.assert_allclose(mesh["uv"][0], head.uv[mesh["corners"]], atol=1e-6)
    scalp = mesh["attributes"]["scalp"][:, 0]
    np.testing.assert_allclose(scalp, head.scalp[mesh["corners"]], atol=0.01)


def test_bones_and_weights_are_the_skin(things: list[dict[str, Any]], groom: Groom) -> None:
    """Three bones at the joints, each the next one's parent, and every vertex's weights."""
    mesh, bones = only(things, "MESH"), only(things, "ARMATURE")
    assert mesh["modifiers"] == ["ARMATURE"]
    assert tuple(bones["bones"]) == tuple(mesh["groups"]) == JOINT_NAMES
    assert bones["parents"] == [None, "root", "neck"]
    np.testing.assert_allclose(bones["heads"], z_up(groom.head.joints), atol=1e-6)
    np.testing.assert_allclose(mesh["weights"], head_weights(groom.head), atol=1e-6)
