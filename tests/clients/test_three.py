"""glTF in three.js and VRM in three-vrm, both as their authors publish them, run by Node."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from blender_session import PROJECT
from client_groom import moved, nodding, off_strands, swinging, written

from hairkit.grooming.guide_weights import guide_mask
from hairkit.grooming.prepare_export import select_strands
from hairkit.manager import Manager
from hairkit.types.groom import Groom

CLIENTS = PROJECT / ".clients"
PROGRAM = Path(__file__).parent / "in_three" / "frames.mjs"
NEAR = 1e-4
"""Metres between a frame in three.js and the frame of the cache."""


@dataclass(frozen=True)
class Seen:
    """What the program tells."""

    frames: dict[str, npt.NDArray[np.float32]]
    """Each object's vertices (T, V, 3) in the world."""
    vrm: dict[str, Any]


@pytest.fixture(scope="module")
def node() -> str:
    """Node, where three.js and three-vrm are installed for it."""
    found = shutil.which("node")
    if found is None or not (CLIENTS / "node_modules" / "@pixiv" / "three-vrm").exists():
        pytest.skip("no three.js: run `make test-clients`")
    return found


def seen(node: str, path: Path, times: Any) -> Seen:
    """Return what three.js makes of a file."""
    out = path.with_suffix(".f32")
    words = [node, str(PROGRAM), str(CLIENTS), str(path), str(out), *(f"{t:.9g}" for t in times)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    told = json.loads(done.stdout.splitlines()[-1])
    counts = [count for _, count in told["objects"]]
    places = np.fromfile(out, "<f4").reshape(len(times), sum(counts), 3)
    parts = np.split(places, np.cumsum(counts)[:-1], axis=1)
    names = [name for name, _ in told["objects"]]
    return Seen(dict(zip(names, parts, strict=True)), told.get("vrm", {}))


@pytest.mark.parametrize("speeds", [(0.05, 2.0), (0.05, 0.2)])
def test_a_long_simulation_plays(
    node: str, manager: Manager, groom: Groom, tmp_path: Path, speeds: tuple[float, float]
) -> None:
    """Over 120 frames lines and ribbons are within 0.1 mm of the cache; the head turns along."""
    groom = select_strands(groom, guide_mask(groom.strands))
    cache = swinging(groom, 120, np.linspace(*speeds, 60))
    cache.save(tmp_path / "cache.npz")
    options = {"cache": tmp_path / "cache.npz", "strips": len(groom.strands)}
    path = written(manager, groom, tmp_path / "hair.glb", **options)
    frames = seen(node, path, cache.times).frames
    np.testing.assert_allclose(frames["guides"], cache.points, atol=NEAR)
    for wanted, places in zip(cache.points, frames["hair_LOD0"], strict=True):
        middle = places.reshape(-1, 2, 3).mean(axis=1)
        assert off_strands(middle, wanted, groom.strands) < NEAR
    scalp = groom.head.scalp > 0.5
    skin = moved(cache.head_from_rest, groom.head.vertices[scalp])
    np.testing.assert_allclose(frames["head_mesh"][:, np.flatnonzero(scalp)], skin, atol=NEAR)


@pytest.mark.parametrize("animation", ["morph", "skin"])
def test_the_head_nods_with_its_hair(
    node: str, manager: Manager, groom: Groom, tmp_path: Path, animation: str
) -> None:
    """Of a motion of the head, baked or the skeleton's, ribbons take part as the cache has it."""
    cache = nodding(groom)
    cache.save(tmp_path / "cache.npz")
    options = {"cache": tmp_path / "cache.npz", "animation": animation, "lines": "none"}
    path = written(manager, groom, tmp_path / "hair.glb", strips=30, strip_points=12, **options)
    frames = seen(node, path, cache.times).frames["hair_LOD0"]
    for wanted, places in zip(
        moved(cache.head_from_rest, groom.strands.points), frames, strict=True
    ):
        middle = places.reshape(-1, 2, 3).mean(axis=1)
        assert off_strands(middle, wanted, groom.strands) < NEAR


def test_an_avatar_swings_its_hair(
    node: str, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """three-vrm finds a human's bones, springs and colliders; hair lags behind a turned head."""
    path = written(manager, groom, tmp_path / "anna.vrm", cards=40, levels=1, atlas=256, bones=6)
    vrm = seen(node, path, [0.0]).vrm
    assert vrm["version"] == "1"
    assert {"hips", "spine", "head", "leftHand", "rightFoot"} <= set(vrm["bones"])
    assert vrm["colliders"] > 0
    assert vrm["joints"] >= 6
    before, after, rigid = (np.array(vrm[name]) for name in ("before", "after", "rigid"))
    assert np.isfinite(after).all()
    assert np.linalg.norm(rigid - before, axis=1).max() > 0.02
    assert np.linalg.norm(after - rigid, axis=1).max() > 0.002
