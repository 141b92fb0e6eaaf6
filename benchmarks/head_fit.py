"""How far fitted heads are from the true ones: the average head, then each plugin of `fit_head`.

python benchmarks/head_fit.py captures/

Cameras and the head's size and pose are those of the recipe's first stages; each plugin then fits
the head's shape. Heads are aligned with the truth as `hairkit evaluate` does it, by the cameras.
Prints a Markdown table: mean distance of the scalp's and the face's vertices to the true head's
surface in millimetres, and seconds of the processor.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from captures_argument import NO_CAPTURES, add_captures

from hairkit.arrays import Float64Array
from hairkit.evaluation import Truth, read_truth
from hairkit.evaluation.align import align
from hairkit.head_model.signed_distance import distance_to
from hairkit.hookspecs import hookimpl
from hairkit.io.capture_reader import read_capture
from hairkit.manager import Manager
from hairkit.options import make_options
from hairkit.pipeline.head_alone import photograph_head
from hairkit.pipeline.recipe import load_recipe
from hairkit.types.capture import Capture
from hairkit.types.mask import Mask
from hairkit.types.scene import Scene

PLUGINS = ("thin_plate", "blendshapes")
FACE_FRONT, FACE_MIDDLE, FACE_HALF = 0.05, -0.035, 0.085
"""Metres: the face lies farther in front, and no farther above or below its middle."""

EYE = 0.0125
"""Metres from the middle of an eyeball within which nothing is compared."""


class Probe:
    """Takes the place of a plugin that fits heads, and keeps what it is given."""

    def __init__(self) -> None:
        self.given: tuple[Capture, tuple[Mask, ...], Scene] | None = None

    @hookimpl
    def fit_head(self, capture: Capture, masks: tuple[Mask, ...], scene: Scene) -> Scene:
        """Return the scene as it is."""
        self.given = capture, masks, scene
        return scene


def main() -> int:
    """Fit every capture's head in every way and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    captures = parser.parse_args().captures
    if captures is None:
        print(NO_CAPTURES)
        return 0
    print("| capture | average head | " + " | ".join(f"`{name}`" for name in PLUGINS) + " |")
    print("|---" * (len(PLUGINS) + 2) + "|")
    rows = []
    for folder in sorted(path.parent for path in captures.glob("*/truth")):
        rows.append(figures(folder))
        print(row(folder.name, rows[-1]), flush=True)
    print(row("mean", np.mean(rows, axis=0)))
    return 0


def row(name: str, values: Float64Array) -> str:
    """Return a row: scalp / face in mm, and seconds."""
    cells = [f"{scalp:.1f} / {face:.1f} mm, {seconds:.1f} s" for scalp, face, seconds in values]
    return f"| {name} | " + " | ".join(cells) + " |"


def figures(folder: Path) -> Float64Array:
    """Return (1 + P, 3) scalp, face and seconds of the average head and each plugin."""
    capture, scene, masks, truth = average(folder)
    found = [[*errors(scene, truth), 0.0]]
    for name in PLUGINS:
        plugin: Any = importlib.import_module(f"hairkit_plugins.{name}")
        began = time.process_time()
        fitted = plugin.fit_head(capture, masks, scene, make_options(plugin.Options, {}, name))
        found.append([*errors(fitted, truth), time.process_time() - began])
    return np.array(found)


def average(folder: Path) -> tuple[Capture, Scene, tuple[Mask, ...], Truth]:
    """Return views with landmarks, the scene before its head is fitted, masks, and the truth."""
    manager, probe = Manager.loaded([]), Probe()
    manager.register(probe, "head_probe")
    given = read_capture(folder)
    photograph_head(given, load_recipe("default").with_set(["head=head_probe"]), manager)
    assert probe.given is not None
    capture, masks, scene = probe.given
    truth = read_truth(folder / "truth")
    places = [view.photo_path for view in given.views]
    order = [places.index(view.photo_path) for view in capture.views]
    return capture, scene, masks, replace(truth, cameras=tuple(truth.cameras[i] for i in order))


def errors(scene: Scene, truth: Truth) -> tuple[float, float]:
    """Return mean distances of scalp and face from the true head, millimetres."""
    head = scene.head
    similarity = align(scene.cameras, truth.cameras, head.vertices)
    distance = 1e3 * np.abs(distance_to(truth.head, similarity.apply(head.vertices)))
    _, y, z = head.vertices.T
    face = (z > FACE_FRONT) & (np.abs(y - FACE_MIDDLE) < FACE_HALF)
    for centre in () if (centres := head.eye_centres()) is None else centres:
        face &= np.linalg.norm(head.vertices - centre, axis=1) > EYE
    return float(distance[head.scalp > 0.5].mean()), float(distance[face].mean())


if __name__ == "__main__":
    sys.exit(main())
