"""What the checks by Blender share. They are skipped where there is no Blender as a module."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from blender_session import VARIABLE, BlenderSession, blender_python, z_up
from client_groom import wandering
from rich_groom import rich_groom

from hairkit.grooming.guide_weights import follow
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache


@pytest.fixture(scope="session")
def blender(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BlenderSession]:
    """Blender, started once for all checks."""
    python = blender_python()
    if python is None:
        pytest.skip(f"no Blender: run `make test-clients`, or name its Python in {VARIABLE}")
    with BlenderSession(python, tmp_path_factory.mktemp("blender")) as session:
        yield session


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
    return z_up(follow(groom.strands, cache.points))
