"""glTF in three.js and VRM in three-vrm, both as their authors publish them, run by Node."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from client_groom import moved, nodding, off_strands, swinging, written
from three_session import seen

from hairkit.grooming.guide_weights import guide_mask
from hairkit.manager import Manager
from hairkit.types.groom import Groom

NEAR = 1e-4
"""Metres between a frame in three.js and the frame of the cache."""


@pytest.mark.parametrize("speeds", [(0.05, 2.0), (0.05, 0.2)])
def test_a_long_simulation_plays(
    node: str, manager: Manager, groom: Groom, tmp_path: Path, speeds: tuple[float, float]
) -> None:
    """Over 120 frames lines and ribbons are within 0.1 mm of the cache; the head turns along."""
    groom = groom.select(guide_mask(groom.strands))
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
    assert len(vrm["joints"]) >= 6
    before, after, rigid = (np.array(vrm[name]) for name in ("before", "after", "rigid"))
    assert np.isfinite(after).all()
    assert np.linalg.norm(rigid - before, axis=1).max() > 0.02
    assert np.linalg.norm(after - rigid, axis=1).max() > 0.002
