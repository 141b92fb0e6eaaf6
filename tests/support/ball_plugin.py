"""A plugin for tests that does every stage on the made-up head of `hairkit.testing`."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hairkit import (
    Capture,
    Groom,
    Hull,
    Mask,
    OrientationMap,
    Roots,
    Scene,
    Strands,
    View,
    hookimpl,
)
from hairkit.io.capture_reader import read_folder
from hairkit.io.file_format import FileFormat
from hairkit.options import option
from hairkit.storage import write_bytes
from hairkit.testing import (
    VIEW_NAMES,
    ball_mask,
    combed_field,
    combed_orientation,
    shell_hull,
    turn_scene,
)
from hairkit.types.face import Face
from hairkit.types.mask import Masks
from hairkit.types.person import Person
from hairkit.types.torso_shape import TorsoShape
from hairkit.types.turnaround import Turnaround

FORMAT = FileFormat("Ball", (".ball",))

CALLS: list[str] = []
"""Every stage that was run, `stage` or `stage view`, in this process."""


@dataclass(frozen=True)
class Options:
    """Settings of the test plugin."""

    delay: float = option(0.0, low=0.0, high=60.0, doc="Time that every stage takes.", unit="s")
    length: float = option(0.03, low=0.0, high=1.0, doc="Length of the strands.", unit="m")


def _begin(stage: str, options: Options, view: str = "") -> None:
    CALLS.append(f"{stage} {view}".strip())
    time.sleep(options.delay)


@hookimpl
def capture(source: str, max_edge: int) -> Capture:
    return read_folder(source, max_edge)


@hookimpl
def detect_landmarks(options: Options) -> Face:
    _begin("landmarks", options)
    return Face(0.5, np.zeros((68, 2)), np.ones(68), 0.0, 0.0, 0.0)


@hookimpl
def segment_person(view: View, options: Options) -> Person:
    _begin("person", options, view.name)
    return Person(np.full((view.height, view.width), 128, np.uint8))


@hookimpl
def find_turn(capture: Capture, options: Options) -> Turnaround:
    """The turn as the capture says."""
    _begin("turn", options)
    views = capture.views
    azimuth, zero = np.array([view.azimuth_deg for view in views]), np.zeros(len(views))
    names = tuple(view.name for view in views)
    return Turnaround(np.arange(len(views)), azimuth, zero, names, np.inf, "turn as said")


@hookimpl
def refine_masks(masks: tuple[Mask, ...], options: Options) -> Masks:
    _begin("refine", options)
    return Masks(masks)


@hookimpl
def segment(view: View, options: Options) -> Mask:
    _begin("segment", options, view.name)
    return ball_mask(turn_scene().cameras[VIEW_NAMES.index(view.name)])


@hookimpl
def estimate_scene(options: Options) -> Scene:
    _begin("scene", options)
    return turn_scene()


@hookimpl
def fit_head(scene: Scene, options: Options) -> Scene:
    _begin("fit", options)
    return scene


@hookimpl
def orient(view: View, mask: Mask, options: Options) -> OrientationMap:
    _begin("orient", options, view.name)
    return combed_orientation(mask)


@hookimpl
def build_hull(options: Options) -> Any:
    _begin("hull", options)
    return replace(shell_hull(), torso=TorsoShape(breadth=1.1))


@hookimpl
def solve_field(hull: Hull, options: Options) -> Any:
    _begin("field", options)
    return combed_field(hull.grid)


@hookimpl
def track(roots: Roots, options: Options) -> Strands:
    """Straight strands along the scalp's normals."""
    _begin("track", options)
    along = np.linspace(0.0, options.length, 5, dtype=np.float32)[None, :, None]
    points = roots.positions[:, None] + along * roots.normals[:, None]
    return Strands(points.reshape(-1, 3), np.arange(len(roots) + 1) * 5)


@hookimpl
def edit_groom(groom: Groom, options: Options) -> Groom:
    _begin("edit", options)
    return groom


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    _begin("export", options)
    write_bytes(path, groom.strands.points.tobytes())
    return True
