"""What the checks by Blender share. They are skipped where there is no Blender as a module."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from blender_session import VARIABLE, BlenderSession, blender_python

from hairkit.groom import Groom, HairMaterial
from hairkit.point_cache import PointCache
from hairkit.strands import Strands
from hairkit.testing import bristle_groom


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
    """Three frames at 24 a second in which every point takes a way of its own."""
    rng = np.random.default_rng(11)
    away = np.cumsum(rng.normal(0, 0.004, (3, *groom.strands.points.shape)), axis=0)
    away -= away[0]
    times = np.arange(3) / 24
    return PointCache(groom.strands.points + away, times, np.tile(np.eye(4), (3, 1, 1)))


def rich_groom() -> Groom:
    """Return bent strands of 3 to 9 points, each width another, two groups, guides and hair."""
    rng = np.random.default_rng(5)
    bristles = bristle_groom()
    count = 40
    counts = rng.integers(3, 10, count)
    roots = bristles.strands.roots[:count]
    way = bristles.strands.points.reshape(-1, 5, 3)[:count, 4] - roots
    offsets = np.concatenate([[0], np.cumsum(counts)])
    owner = np.repeat(np.arange(count), counts)
    rank = np.arange(offsets[-1]) - offsets[:-1][owner]
    bend = rng.normal(0, 0.004, (len(owner), 3)) * (rank > 0)[:, None]
    points = roots[owner] + way[owner] * (rank / 4)[:, None] + bend
    strands = Strands(
        points,
        offsets,
        widths=rng.uniform(4e-5, 2e-4, len(owner)),
        root_uv=rng.uniform(0.05, 0.95, (count, 2)),
        group=np.arange(count) % 2,
        guide=np.arange(count) % 4 != 3,
    )
    return replace(
        bristles,
        strands=strands,
        root_triangle=bristles.root_triangle[:count],
        root_barycentric=bristles.root_barycentric[:count],
        material=HairMaterial(
            np.array([0.3, 0.12, 0.05]), np.array([0.6, 0.35, 0.2]), 1e-4, 0.004, 0.03
        ),
    )
