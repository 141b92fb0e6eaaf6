"""Print errors of fitted cameras and heads against ground truth, and the time they take.

python benchmarks/cameras.py captures/ --plugin silhouette

Masks are those of the capture. Cameras and head are aligned to the true ones as `hairkit evaluate`
does it. Each plugin runs twice; the second run, with compiled kernels, is timed.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
import time
from pathlib import Path
from typing import Any

import numpy as np
from captures_argument import NO_CAPTURES, add_captures
from hairkit_plugins import mask_files, thin_plate

from hairkit import Capture, Head, Mask, Scene
from hairkit.evaluation import Truth, read_truth
from hairkit.evaluation.align import align, camera_errors
from hairkit.head_model.signed_distance import distance_to
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import read_capture
from hairkit.options import make_options

PLUGINS = ("silhouette", "landmarks")


def main() -> None:
    """Run one scene plugin, then `thin_plate`, over every capture that has truth and masks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--plugin", choices=PLUGINS, default="silhouette")
    parser.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE")
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    plugin: Any = importlib.import_module(f"hairkit_plugins.{arguments.plugin}")
    chosen = dict(item.split("=", 1) for item in arguments.set)
    options = make_options(plugin.Options, chosen, arguments.plugin)
    print("| capture | azimuth | worst | rotation | head off | scalp off, bent | face | seconds |")
    print("|---|---|---|---|---|---|---|---|")
    rows = []
    for folder in sorted(path.parent for path in arguments.captures.glob("*/truth")):
        rows.append(_figures(folder, plugin, options))
        print(_row(folder.name, rows[-1]))
    print(_row("mean", np.mean(rows, axis=0)))


def _row(name: str, figures: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    azimuth, worst, rotation, pixels, scalp, face, seconds = figures
    angles = f"{azimuth:.2f} | {worst:.2f} | {rotation:.2f}"
    return (
        f"| {name} | {angles} | {pixels:.1f} px | {scalp:.1f} mm | {face:.1f} mm | {seconds:.2f} |"
    )


def _figures(folder: Path, plugin: Any, options: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    capture, truth = read_capture(folder), read_truth(folder / "truth")
    masks = tuple(mask_files.segment(view) for view in capture.views)
    head = default_head()
    scene = _run(plugin, capture, masks, head, options)
    started = time.perf_counter()
    scene = _run(plugin, capture, masks, head, options)
    seconds = time.perf_counter() - started
    similarity = align(scene.cameras, truth.cameras, head.vertices)
    errors = camera_errors(scene.names, scene.cameras, truth.cameras, similarity, head.vertices)
    azimuth = np.array([abs(error.azimuth_deg) for error in errors])
    rotation = np.mean([error.rotation_deg for error in errors])
    pixels = np.mean([error.reprojection_px for error in errors])
    bent = thin_plate.fit_head(capture, masks, scene, thin_plate.Options()).head
    scalp, face = _head_errors(bent, similarity.apply(bent.vertices), truth)
    return np.array([azimuth.mean(), azimuth.max(), rotation, pixels, scalp, face, seconds])


def _run(plugin: Any, capture: Capture, masks: tuple[Mask, ...], head: Head, options: Any) -> Scene:
    every = {"capture": capture, "masks": masks, "head": head, "start": None, "options": options}
    taken = inspect.signature(plugin.estimate_scene).parameters
    scene: Scene = plugin.estimate_scene(**{name: every[name] for name in taken})
    return scene


def _head_errors(head: Head, moved: Any, truth: Truth) -> tuple[float, float]:
    """Return mean distances of the scalp and of the face to the true head's surface, mm."""
    distance = 1e3 * np.abs(distance_to(truth.head, moved))
    face = (head.vertices[:, 2] > 0.05) & (np.abs(head.vertices[:, 1] + 0.035) < 0.085)
    return float(distance[head.scalp > 0.5].mean()), float(distance[face].mean())


if __name__ == "__main__":
    main()
