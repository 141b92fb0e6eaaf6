"""A small capture with truth, made for the test: bristles on a ball, seen by eight cameras."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from hairkit.testing import ball_mask, bristle_groom, turn_scene
from hairkit.types.groom import Groom
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.scene import Scene


@pytest.fixture
def truth_folder(tmp_path: Path) -> Path:
    """The truth of the capture: its strands are the bristles, seen on the side of the cameras."""
    folder = tmp_path / "capture" / "truth"
    for place in (folder / "orientation", folder.parent / "masks"):
        place.mkdir(parents=True)
    groom, scene = bristle_groom(), turn_scene()
    views = [c.to_json(name) for name, c in zip(scene.names, scene.cameras, strict=True)]
    (folder / "truth.json").write_text(json.dumps({"views": views}))
    strands = groom.strands
    seen = np.ones(len(strands.points), np.uint8)
    np.savez(folder / "strands.npz", points=strands.points, offsets=strands.offsets, visible=seen)
    lines = [f"v {x} {y} {z}" for x, y, z in groom.head.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in groom.head.faces + 1]
    (folder / "head.obj").write_text("\n".join(lines))
    for index, (name, camera) in enumerate(zip(scene.names, scene.cameras, strict=True)):
        mask = ball_mask(camera)
        upright = np.where(mask.hair, 128, 0).astype(np.uint8)
        cv2.imwrite(str(folder / "orientation" / f"{index}_{name}.png"), upright)
        cv2.imwrite(str(folder.parent / "masks" / f"{index}_{name}.png"), mask.labels)
    return folder


@pytest.fixture
def out_folder(tmp_path: Path) -> Path:
    """What a reconstruction that found everything would leave."""
    folder = tmp_path / "out"
    write_out(folder, bristle_groom(), turn_scene())
    return folder


def write_out(folder: Path, groom: Groom, scene: Scene) -> None:
    """Write a groom, its scene and the stages that scoring reads."""
    (folder / "work").mkdir(parents=True)
    groom.save(folder / "groom.npz")
    scene.write_json(folder / "scene.json")
    for name, camera in zip(scene.names, scene.cameras, strict=True):
        mask = ball_mask(camera)
        upright = wrap_angle(np.full(mask.labels.shape, np.pi / 2))
        found = OrientationMap(upright, mask.hair.astype(np.float32))
        found.save(folder / "work" / f"orient-{name}.npz")
        mask.save(folder / "work" / f"segment-{name}.npz")
