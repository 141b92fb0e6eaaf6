"""How far fitted heads are from the true ones: the average head, then each plugin of `fit_head`.

python benchmarks/head_fit.py captures/

Cameras and the head's size and pose are those of the recipe's first stages; each plugin then fits
the head's shape. Prints two Markdown tables of the mean distance of the scalp's and the face's
vertices to the true head's surface, in millimetres: one with heads aligned as `hairkit evaluate`
does it, by the cameras, and seconds of the processor; and one with each head moved, turned and
scaled onto the true one, so that its shape alone counts. The last column there is the best that
hairkit's shapes can do: their mixture that is nearest to the true surface itself.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from captures_argument import NO_CAPTURES, add_captures
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float64Array
from hairkit.cameras.similarity import fit_similarity
from hairkit.evaluation import Truth, read_truth
from hairkit.evaluation.align import align
from hairkit.head_model.identity import identity_modes
from hairkit.head_model.signed_distance import distance_to
from hairkit.hookspecs import hookimpl
from hairkit.io.capture_reader import read_capture
from hairkit.manager import Manager
from hairkit.options import make_options
from hairkit.pipeline.head_alone import photograph_head
from hairkit.pipeline.recipe import load_recipe
from hairkit.types.capture import Capture
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.scene import Scene

PLUGINS = ("thin_plate", "blendshapes")
FACE_FRONT, FACE_MIDDLE, FACE_HALF = 0.05, -0.035, 0.085
"""Metres: the face lies farther in front, and no farther above or below its middle."""

EYE = 0.0125
"""Metres from the middle of an eyeball within which nothing is compared."""
SPREAD, ROUNDS = 60_000, 40
"""Points spread over the true head, 2 mm apart, and rounds of closest points."""
MIXINGS, STEP = 6, 4
"""Rounds that look for the nearest mixture, and every how manieth vertex they use."""
MISS, INDEPENDENT = 0.001, 400
"""Metres by which mixtures miss a face, and how many of its points miss by themselves: with these
the shapes' spread still counts."""


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
    titles = ["average head", *(f"`{name}`" for name in PLUGINS)]
    head_row(titles)
    rows, shapes = [], {}
    for folder in sorted(path.parent for path in captures.glob("*/truth")):
        by_cameras, shapes[folder.name] = figures(folder)
        rows.append(by_cameras)
        print(row(folder.name, by_cameras), flush=True)
    print(row("mean", np.mean(rows, axis=0)), end="\n\n")
    head_row([*titles, "nearest mixture of shapes"])
    for name, values in [*shapes.items(), ("mean", np.mean([*shapes.values()], axis=0))]:
        print(row(name, values))
    return 0


def head_row(titles: Sequence[str]) -> None:
    """Print the first lines of a table."""
    print("| capture | " + " | ".join(titles) + " |")
    print("|---" * (len(titles) + 1) + "|")


def row(name: str, values: Float64Array) -> str:
    """Return a row: scalp / face in mm, and seconds where they are told."""
    cells = [
        f"{scalp:.1f} / {face:.1f} mm" + "".join(f", {time_s:.1f} s" for time_s in seconds)
        for scalp, face, *seconds in values
    ]
    return f"| {name} | " + " | ".join(cells) + " |"


def figures(folder: Path) -> tuple[Float64Array, Float64Array]:
    """Return scalp, face and seconds (1 + P, 3), aligned by cameras, and scalp and face (2 + P, 2)
    of shapes alone: of the average head, each plugin's, and the nearest mixture."""
    capture, scene, masks, truth = average(folder)
    scenes, seconds = [scene], [0.0]
    for name in PLUGINS:
        plugin: Any = importlib.import_module(f"hairkit_plugins.{name}")
        began = time.process_time()
        scenes.append(
            plugin.fit_head(capture, masks, scene, make_options(plugin.Options, {}, name))
        )
        seconds.append(time.process_time() - began)
    points, normals = surface_points(truth.head)
    by_cameras = [align(s.cameras, truth.cameras, s.head.vertices) for s in scenes]
    found = [
        [*distances(s.head, place.apply(s.head.vertices), truth), taken]
        for s, place, taken in zip(scenes, by_cameras, seconds, strict=True)
    ]
    heads = [
        settle(s.head.vertices, s.head, place.apply, points)
        for s, place in zip(scenes, by_cameras, strict=True)
    ]
    heads.append(nearest_mixture(scene.head, by_cameras[0].apply, points, normals))
    return np.array(found), np.array([distances(scene.head, head, truth) for head in heads])


def average(folder: Path) -> tuple[Capture, Scene, tuple[Mask, ...], Truth]:
    """Return views with landmarks, the scene before its head is fitted, masks, and the truth."""
    manager, probe = Manager.loaded([]), Probe()
    manager.register(probe, "head_probe")
    given = read_capture(folder)
    photograph_head(given, load_recipe("default").with_set(["fit=head_probe"]), manager)
    assert probe.given is not None
    capture, masks, scene = probe.given
    truth = read_truth(folder / "truth")
    places = [view.photo_path for view in given.views]
    order = [places.index(view.photo_path) for view in capture.views]
    return capture, scene, masks, replace(truth, cameras=tuple(truth.cameras[i] for i in order))


def distances(head: Head, vertices: Any, truth: Truth) -> tuple[float, float]:
    """Return mean distances of scalp and face from the true head, millimetres."""
    distance = 1e3 * np.abs(distance_to(truth.head, np.asarray(vertices, np.float32)))
    scalp, face = parts(head)
    return float(distance[scalp].mean()), float(distance[face].mean())


def parts(head: Head) -> tuple[BoolArray, BoolArray]:
    """Return which vertices are compared: the scalp's, and the face's without the eyes."""
    _, y, z = head.vertices.T
    face = (z > FACE_FRONT) & (np.abs(y - FACE_MIDDLE) < FACE_HALF)
    for centre in () if (centres := head.eye_centres()) is None else centres:
        face &= np.linalg.norm(head.vertices - centre, axis=1) > EYE
    return head.scalp > 0.5, face


def surface_points(head: Head) -> tuple[Float64Array, Float64Array]:
    """Return points (N, 3) spread over a head's faces, and their normals."""
    corners = head.vertices[head.faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    generator = np.random.default_rng(0)
    face = generator.choice(len(area), SPREAD, p=area / area.sum())
    weights = generator.dirichlet(np.ones(3), SPREAD)
    return np.einsum("nk,nkd->nd", weights, corners[face]), normals[face] / area[face, None]


def settle(
    vertices: Any, head: Head, start: Callable[[Any], Any], points: Float64Array
) -> Float64Array:
    """Return vertices after the similarity of closest points: scalp and face count alike."""
    scalp, face = parts(head)
    chosen = scalp | face
    weights = np.where(face, 1 / face.sum(), 1 / scalp.sum())[chosen]
    tree, source = cKDTree(points), np.asarray(vertices, np.float64)
    moved = np.asarray(start(source), np.float64)
    for _ in range(ROUNDS):
        near = points[tree.query(moved[chosen])[1]]
        moved = fit_similarity(source[chosen], near, weights).apply(source)
    return moved


def nearest_mixture(
    head: Head, start: Callable[[Any], Any], points: Float64Array, normals: Float64Array
) -> Float64Array:
    """Return the vertices of the mixture of shapes that is nearest to a surface, placed on it."""
    modes = identity_modes().astype(np.float64)
    chosen = np.flatnonzero(np.logical_or(*parts(head)))[::STEP]
    tree, source = cKDTree(points), head.vertices.astype(np.float64)
    shaped = source
    moved = settle(source, head, start, points)
    for _ in range(MIXINGS):
        place = fit_similarity(shaped, moved)
        near = tree.query(moved[chosen])[1]
        slopes = np.einsum(
            "knd,nd->nk", place.scale * modes[:, chosen] @ place.rotation.T, normals[near]
        )
        missing = ((points[near] - place.apply(source)[chosen]) * normals[near]).sum(axis=1)
        noise = MISS * np.sqrt(len(chosen) / INDEPENDENT)
        normal = slopes.T @ slopes / noise**2 + np.eye(len(modes))
        weights = np.linalg.solve(normal, slopes.T @ missing / noise**2)
        shaped = source + np.tensordot(weights, modes, axes=1)
        moved = settle(shaped, head, place.apply, points)
    return moved


if __name__ == "__main__":
    sys.exit(main())
