"""What the checks by other programs share. They are skipped where a program is missing."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from blender_session import PROJECT, VARIABLE, BlenderSession, blender_pythons, z_up
from client_groom import wandering
from rich_groom import rich_groom
from three_session import CLIENTS

from hairkit.simulation.posing import pose_frames
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache

PYTHONS = {python.parents[1].name: python for python in blender_pythons()}
"""By the name of the folder: `bpy` has Blender 4.5, `bpy5` has 5.0."""

ADDON = PROJECT / "examples" / "hairkit-blender"
FIND_TOOL = "import bpy; print(bpy.utils.resource_path('LOCAL'))"
TOOL = "scripts/addons_core/bl_pkg/cli/blender_ext.py"
OPERATORS = ["import_groom", "reconstruct", "simulate"]


@pytest.fixture(scope="session", params=PYTHONS or [""])
def blender(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[BlenderSession]:
    """Each Blender, started once for all checks."""
    if not PYTHONS:
        pytest.skip(f"no Blender: run `make test-clients`, or name its Python in {VARIABLE}")
    folder = tmp_path_factory.mktemp("blender")
    with BlenderSession(PYTHONS[request.param], folder) as session:
        yield session


@pytest.fixture(scope="session")
def addon(blender: BlenderSession, tmp_path_factory: pytest.TempPathFactory) -> BlenderSession:
    """Blender with the add-on: built and validated by Blender's own tool, installed, enabled."""
    python = str(blender.python)
    found = subprocess.run([python, "-c", FIND_TOOL], capture_output=True, text=True, check=True)
    tool = Path(found.stdout.strip().splitlines()[-1]) / TOOL
    package = tmp_path_factory.mktemp("addon") / "hairkit.zip"
    words = ["build", "--source-dir", str(ADDON), "--output-filepath", str(package)]
    subprocess.run([python, str(tool), *words], capture_output=True, check=True)
    subprocess.run([python, str(tool), "validate", str(package)], capture_output=True, check=True)
    state = blender.call("addon.installed", package=package)
    assert state == {"enabled": True, "operators": OPERATORS, "menu": True}
    return blender


@pytest.fixture(scope="session")
def node() -> str:
    """Node, where three.js and three-vrm are installed for it."""
    found = shutil.which("node")
    if found is None or not (CLIENTS / "node_modules" / "@pixiv" / "three-vrm").exists():
        pytest.skip("no three.js: run `make test-clients`")
    return found


@pytest.fixture(scope="session")
def groom() -> Groom:
    """A small groom with everything: see `rich_groom`."""
    return rich_groom()


@pytest.fixture(scope="session")
def cache(groom: Groom) -> PointCache:
    """Frames in which every point takes a way of its own."""
    return wandering(groom)


@pytest.fixture(scope="session")
def stored_cache(cache: PointCache, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The frames as a file, for the option `cache`."""
    path = tmp_path_factory.mktemp("cache") / "cache.npz"
    cache.save(path)
    return path


@pytest.fixture(scope="session")
def frames(groom: Groom, cache: PointCache) -> npt.NDArray[np.float32]:
    """(3, P, 3) where all strands are at frames 0, 1 and 2, in Blender's axes."""
    return z_up(pose_frames(groom, groom.strands, cache))
