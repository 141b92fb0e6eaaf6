"""The example's scene in Godot 3: a .vrm file, imported as .glb, whose hair swings and is seen."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from blender_session import PROJECT
from client_groom import written
from three_session import seen

from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.synth import grow
from hairkit.types.groom import Groom

EXAMPLE = PROJECT / "examples" / "godot"
CHECK = Path(__file__).parent / "in_godot" / "check.gd"
SETTINGS = """config_version=4
[application]
run/main_scene="res://check.tscn"
[display]
window/size/width=400
window/size/height=400
"""
NEAR = 5e-4
"""Metres between a joint in Godot, which counts in float32, and the same joint in three-vrm."""
BACKGROUND = np.array([0.55, 0.57, 0.6]) * 255
"""The colour behind the head in `hair.tscn`, sRGB."""


@pytest.fixture(scope="module")
def godot() -> str:
    """Godot 3, which Debian has, and the display it needs."""
    found, screen = shutil.which("godot3"), shutil.which("xvfb-run")
    if found is None or screen is None:
        pytest.skip("no Godot 3: run `make test-clients` as root on Debian")
    return found


@pytest.fixture(scope="module")
def hair() -> Groom:
    """Return long hair on the default head."""
    groom = grow("straight", default_head(), 2000, 0)
    return replace(groom, strands=groom.strands.resampled(16))


@pytest.fixture(scope="module")
def avatar(hair: Groom, manager: Manager, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the hair as an avatar."""
    path = tmp_path_factory.mktemp("avatar") / "anna.vrm"
    return written(manager, hair, path, cards=300, levels=1, atlas=512, bones=12)


@pytest.fixture(scope="module")
def project(godot: str, avatar: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project with the example and the avatar, imported and run."""
    folder = tmp_path_factory.mktemp("project")
    for path in [*EXAMPLE.glob("*.gd"), CHECK]:
        shutil.copy(path, folder)
    scene = (EXAMPLE / "hair.tscn").read_text().replace("turn_head.gd", CHECK.name)
    (folder / "check.tscn").write_text(scene)
    (folder / "project.godot").write_text(SETTINGS)
    shutil.copy(avatar, folder / "avatar.glb")
    # Debian's Godot 3.2.3 may crash when its editor ends, after it has imported everything
    run(godot, folder, "-e", "-q")
    assert list((folder / ".import").glob("avatar.glb-*.scn"))
    said = run(godot, folder)
    assert "SCRIPT ERROR" not in said, said
    assert "p_bone" not in said, said
    return folder


def run(godot: str, folder: Path, *words: str) -> str:
    """Return what Godot says when it runs a project."""
    screen = ["xvfb-run", "-a", "-s", "-screen 0 640x640x24"]
    done = subprocess.run(
        [*screen, godot, "--path", str(folder), "--audio-driver", "Dummy", *words],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def told(project: Path) -> dict[str, Any]:
    """Return where Godot's bones are before and after the head turns."""
    answer: dict[str, Any] = json.loads((project / "told.json").read_text())
    return answer


def test_bones_stand_where_the_file_has_them(told: dict[str, Any], hair: Groom) -> None:
    """A skeleton of a human with chains, whose head joint is the groom's, raised to its height."""
    assert told["bones"] == len(told["before"]) > 16 + 12 * 3
    _, neck, head = hair.head.joints
    apart = np.subtract(told["before"]["head"], told["before"]["neck"])
    np.testing.assert_allclose(apart, head - neck, atol=1e-5)


def test_hair_swings_as_in_three_vrm(told: dict[str, Any], node: str, avatar: Path) -> None:
    """After the same turn of the head every joint is where three-vrm, its reference, has it."""
    vrm = seen(node, avatar, [0.0]).vrm
    for moment in ("before", "after"):
        ours = np.array([told[moment][name] for name in vrm["joints"]])
        np.testing.assert_allclose(ours, vrm[moment], atol=NEAR)
    assert np.linalg.norm(np.subtract(vrm["after"], vrm["rigid"]), axis=1).max() > 0.01


def test_the_picture_shows_hair_around_a_face(project: Path) -> None:
    """Hair in the groom's brown stands beside lighter skin; cards are cut out, not plates."""
    picture = cv2.imread(str(project / "seen.png"))[..., ::-1]
    shown = np.abs(picture - BACKGROUND).max(axis=2) > 12
    skin = shown & (picture[..., 0] > 140)
    hair = shown & ~skin
    assert 0.12 < skin.mean() < 0.18
    assert 0.145 < hair.mean() < 0.172
    red, green, blue = picture[hair].mean(axis=0)
    assert 110 > red > green > blue > 40
