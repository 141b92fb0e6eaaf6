"""The Blender add-on, installed in Blender as a user installs it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from blender_session import BlenderSession, only, z_up
from client_groom import read_back, written

from hairkit.io.capture_reader import sample_folder
from hairkit.manager import Manager
from hairkit.types.groom import Groom


@pytest.fixture(scope="module")
def stored(groom: Groom, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small groom as hairkit's own file."""
    path = tmp_path_factory.mktemp("groom") / "anna.npz"
    groom.save(path)
    return path


def test_hair_arrives_point_by_point(addon: BlenderSession, stored: Path, groom: Groom) -> None:
    """Positions, half the widths, groups, guide flags and root uv are those of the groom."""
    hair = only(addon.call("addon.imported", path=stored), "CURVES")
    strands, attributes = groom.strands, hair["attributes"]
    assert strands.widths is not None
    np.testing.assert_array_equal(hair["offsets"], strands.offsets)
    np.testing.assert_allclose(hair["positions"], z_up(strands.points), atol=1e-7)
    np.testing.assert_allclose(attributes["radius"], strands.widths / 2, rtol=1e-6)
    for name in ("group", "guide", "root_uv"):
        np.testing.assert_array_equal(attributes[name], getattr(strands, name))


def test_hair_is_in_the_captured_colour(addon: BlenderSession, stored: Path, groom: Groom) -> None:
    """The material's two colours are those of root and tip; points have their own."""
    hair = only(addon.call("addon.imported", path=stored), "CURVES")
    wanted = [groom.material.root_colour, groom.material.tip_colour]
    np.testing.assert_allclose(hair["ends"][0], wanted, atol=1e-6)
    own = groom.strands.colours
    np.testing.assert_allclose(hair["attributes"]["colour"][:, :3], own, atol=1e-6)
    assert (hair["attributes"]["colour"][:, 3] == 1).all()


def test_the_head_comes_along(addon: BlenderSession, stored: Path, groom: Groom) -> None:
    """The hair's parent is the head: same vertices, faces, uv and scalp."""
    things = addon.call("addon.imported", path=stored)
    hair, head = only(things, "CURVES"), only(things, "MESH")
    assert hair["parent"] == hair["surface"] == head["name"]
    np.testing.assert_allclose(head["positions"], z_up(groom.head.vertices), atol=1e-7)
    np.testing.assert_array_equal(head["corners"].reshape(-1, 3), groom.head.faces)
    np.testing.assert_array_equal(head["uv"][0], groom.head.uv[head["corners"]])
    assert head["groups"] == ["scalp"]
    np.testing.assert_allclose(head["weights"][:, 0], groom.head.scalp, atol=1e-6)


def test_hair_follows_the_skin(addon: BlenderSession, stored: Path) -> None:
    """When a shape key moves the head's surface, every strand moves with it."""
    shift = [0.1, 0.0, 0.05]
    seen = addon.call("addon.followed", path=stored, shift=shift)
    moved = seen["after"] - seen["before"]
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape), atol=2e-6)


@pytest.mark.parametrize(
    ("python", "says"),
    [
        ("", "hairkit's Python is not known; set it in"),
        ("/nowhere/at/all", "hairkit's Python is not at /nowhere/at/all; set it in"),
        ("BLENDER", "hairkit is not installed in the chosen Python; set another in"),
    ],
)
def test_without_hairkit_one_line_says_what_to_do(
    addon: BlenderSession, tmp_path: Path, python: str, says: str
) -> None:
    """A Python that is not set, not there or without hairkit is one line with the cure."""
    chosen = str(addon.python) if python == "BLENDER" else python
    for words in (
        {"operator": "import_groom", "filepath": tmp_path / "x.apx"},
        {"operator": "reconstruct", "directory": tmp_path},
    ):
        line = addon.call("addon.refusal", python=chosen, **words)
        assert "\n" not in line
        assert line.startswith(f"Error: {says}")


def test_a_file_that_is_no_groom_is_one_line(addon: BlenderSession, tmp_path: Path) -> None:
    """Missing and foreign files are named, and nothing is added."""
    (tmp_path / "noise.npz").write_bytes(b"noise")
    for path in (tmp_path / "noise.npz", tmp_path / "missing.npz"):
        line = addon.call("addon.refusal", operator="import_groom", filepath=path)
        assert line.startswith(f"Error: {path}: not a groom of hairkit")
        assert "\n" not in line
        assert addon.call("contents.objects") == []


def test_what_hairkit_refuses_is_passed_on(addon: BlenderSession, tmp_path: Path) -> None:
    """The one line of a failing command is the one line that Blender shows."""
    line = addon.call(
        "addon.refusal", operator="reconstruct", python=sys.executable, directory=tmp_path / "no"
    )
    assert line.startswith("Error: hairkit: ")
    assert "\n" not in line


@pytest.mark.parametrize("ending", [".abc", ".apx", ".usdc"])
def test_any_file_that_hairkit_reads_is_imported(
    addon: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, ending: str
) -> None:
    """What arrives from another format is what hairkit reads from it, at the same places."""
    path = written(manager, groom, tmp_path / f"hair{ending}")
    things = addon.call("addon.imported", path=path, python=sys.executable)
    wanted = read_back(manager, path).strands.points
    np.testing.assert_allclose(only(things, "CURVES")["positions"], z_up(wanted), atol=1e-7)


def test_a_file_that_says_no_unit_is_told_it(
    addon: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """Axis and unit that the user gives bring a bare file to its place."""
    path = written(manager, groom, tmp_path / "hair.obj", axis="z_up_centimetres")
    told = {"up": "z", "scale": 0.01}
    things = addon.call("addon.imported", path=path, python=sys.executable, **told)
    found = only(things, "CURVES")["positions"]
    np.testing.assert_allclose(found, z_up(groom.strands.points), atol=1e-6)


def test_hair_is_interpolated_on_demand(addon: BlenderSession, stored: Path) -> None:
    """With a number of hairs there are so many, and all of them have a radius."""
    things = addon.call("addon.imported", path=stored, python=sys.executable, hairs=300)
    hair = only(things, "CURVES")
    assert len(hair["offsets"]) == 301
    assert (hair["attributes"]["radius"] > 0).all()


def test_a_folder_of_photos_becomes_hair(addon: BlenderSession, tmp_path: Path) -> None:
    """The command reconstructs the sample capture, and what arrives is the groom it wrote."""
    things = addon.call(
        "addon.reconstructed",
        folder=sample_folder(),
        out=tmp_path / "out",
        python=sys.executable,
        guides=60,
    )
    hair, made = only(things, "CURVES"), Groom.load(tmp_path / "out" / "groom.npz")
    np.testing.assert_allclose(hair["positions"], z_up(made.strands.points), atol=1e-7)


def test_it_leaves_nothing_behind(addon: BlenderSession) -> None:
    """Disabled, its commands and menus are gone; enabled again, they are back."""
    before = addon.call("addon.menus")
    assert before == {"bar": ["_in_menu_bar"], "file": ["_in_file_menu"]}
    assert addon.call("addon.disabled") == {"operators": [], "menu": False}
    assert addon.call("addon.menus") == before
