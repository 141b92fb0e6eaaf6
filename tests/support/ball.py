"""A capture of the made-up head as a folder, and the recipe that runs the test plugin on it."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.testing import (
    VIEW_NAMES,
    ball_mask,
    bristle_groom,
    stage_arguments,
    turn_capture,
    turn_scene,
)
from hairkit.types.evidence import Evidence

PLUGIN_FILE = Path(__file__).with_name("ball_plugin.py")
TABLES = (
    *("capture", "segment", "scene", "fit", "orient", "hull", "field", "track", "edit", "export"),
)
LEFT_OUT = ("landmarks", "person", "turn", "refine")
RECIPE = "".join(f"{table} = false\n" for table in LEFT_OUT) + "".join(
    f'[{table}]\nplugin = "ball_plugin"\n' for table in TABLES
)


def write_capture(folder: Path, *, masks: bool = False) -> Path:
    """Write eight photos `0_front.png`, ... into `folder/photos`, and masks beside; return it."""
    (folder / "photos").mkdir(parents=True)
    for index, view in enumerate(turn_capture().views):
        cv2.imwrite(str(folder / "photos" / f"{index}_{view.name}.png"), view.image[..., ::-1])
    if masks:
        (folder / "masks").mkdir()
        for index, (name, camera) in enumerate(zip(VIEW_NAMES, turn_scene().cameras, strict=True)):
            write_grey(folder / "masks" / f"{index}_{name}.png", ball_mask(camera).labels)
    return folder


def ball_evidence(**changes: Any) -> Evidence:
    """Return what field and strands of the made-up head are made from, some of it changed."""
    given = stage_arguments("track")
    return Evidence(**{each.name: given[each.name] for each in fields(Evidence)} | changes)


def write_groom_file(path: Path) -> Path:
    """Write the small groom of `hairkit.testing` and return the path."""
    bristle_groom().save(path)
    return path


def write_grey(path: Path, values: np.ndarray) -> None:
    """Write an array (H, W) or (H, W, C) as PNG."""
    assert cv2.imwrite(str(path), values)
