"""Cameras and sparse points of many photos by structure from motion with COLMAP.

Schönberger and Frahm, "Structure-from-motion revisited" (2016), by pycolmap (`pip install
'hairkit[sfm]'`): SIFT on the person alone, matches between neighbours of the turn, cameras and
points added photo by photo, and bundle adjustment. The face's landmarks, intersected by these
cameras, then bring all into the frame and the size of the head, because photos fix neither.

It needs 24 photos or more, or a video: between photos 45 degrees apart hardly any point of hair and
skin is found again, so eight are refused. The points that lie on bare skin stay with the scene:
`nonrigid_icp` bends the head onto them where no scan is given.

* `colmap_child`: the program that runs COLMAP
* `sparse_model`: what it found, as cameras and points
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hairkit import Camera, Capture, Head, Mask, Scene, hookimpl
from hairkit.arrays import BoolArray, Float64Array
from hairkit.cameras.similarity import Similarity, fit_similarity, triangulate
from hairkit.errors import InputError
from hairkit.options import option
from hairkit.types.head import JAW_LANDMARKS, LANDMARKS
from hairkit.types.mask import PERSON

from .sparse_model import Model, solve

FEWEST = 16
"""Photos: between neighbours farther than 22 degrees apart SIFT finds too few points again."""
FARTHER = 2.0
"""Times the usual distance, or part of it, at which no camera of a turn stands."""
LEAST_SEEN = 0.6
"""Share of the scalp that is on the person of each photo, at least."""
JAW_WEIGHT = 0.1
"""Weight of the jaw's landmarks beside the others: detectors trace the outline."""


@dataclass(frozen=True)
class Options:
    """Settings of the reconstruction."""

    features: int = option(4000, low=200, high=20000, doc="Points looked for in a photo.")
    neighbours: int = option(4, low=1, high=20, doc="Photos on either side that are compared.")
    seconds: float = option(1800.0, low=10, high=86400, doc="Time it may take.", unit="s")


@hookimpl
def estimate_scene(
    capture: Capture, masks: tuple[Mask, ...], head: Head, start: Scene | None, options: Options
) -> Scene:
    """Return the cameras that join all photos, and the points on bare skin."""
    names = tuple(view.name for view in capture.views)
    if start is not None:
        return replace(start, head=head)  # mended masks change too little to solve again
    if len(names) < FEWEST:
        raise InputError(
            f"sfm: {len(names)} photos are too few, it needs about 24, every 15 degrees, or a"
            " video; use --set scene=silhouette"
        )
    order = np.argsort([view.azimuth_deg % 360 for view in capture.views], kind="stable")
    model = solve(
        [capture.views[i] for i in order],
        [masks[i] for i in order],
        (options.features, options.neighbours),
        options.seconds,
    ).reordered(order)
    lost = [names[i] for i, camera in enumerate(model.cameras) if camera is None]
    if lost:
        raise InputError(
            f"sfm: {len(lost)} of {len(names)} photos do not join the others ({', '.join(lost[:4])}"
            f"{', ...' if len(lost) > 4 else ''}); take sharper ones, nearer to each other, or use"
            " --set scene=silhouette"
        )
    cameras = [camera for camera in model.cameras if camera is not None]
    place = place_on_head(capture, cameras, head)
    bare = place.apply(model.points[_on_skin(model, masks)])
    moved = tuple(place.moved_camera(camera) for camera in cameras)
    refuse_astray(names, moved, head, masks)
    return Scene(names, moved, head, model.residual_px, np.asarray(bare, np.float32))


def place_on_head(capture: Capture, cameras: Sequence[Camera], head: Head) -> Similarity:
    """Return the similarity that takes the cameras' world to the head, by its landmarks."""
    seen = [i for i, view in enumerate(capture.views) if view.landmarks is not None]
    if len(seen) < 2 or head.landmark_vertices is None:
        raise InputError(
            f"sfm: {len(seen)} photos show landmarks of a face, it needs 2 for the head's size;"
            " run hairkit models install, or give landmarks.json"
        )
    pixels = np.stack([np.asarray(capture.views[i].landmarks) for i in seen])
    points = triangulate([cameras[i] for i in seen], pixels)
    weights = np.where(np.arange(LANDMARKS) < JAW_LANDMARKS, JAW_WEIGHT, 1.0)
    return fit_similarity(points, head.vertices[head.landmark_vertices], weights)


def refuse_astray(
    names: Sequence[str], cameras: Sequence[Camera], head: Head, masks: Sequence[Mask]
) -> None:
    """Raise `InputError` where cameras stand where the head is not on the person of their photo."""
    scalp = head.vertices[head.scalp > 0.5].astype(np.float64)
    middle = scalp.mean(axis=0)
    away = np.array([np.linalg.norm(camera.position - middle) for camera in cameras])
    ratio = away / np.median(away)
    astray = [
        name
        for name, camera, mask, far in zip(names, cameras, masks, ratio, strict=True)
        if not 1 / FARTHER < far < FARTHER or _share_on(mask, camera, scalp) < LEAST_SEEN
    ]
    if astray:
        raise InputError(
            f"sfm: {len(astray)} of {len(names)} cameras are not where their photos can be from"
            f" ({', '.join(astray[:4])}{', ...' if len(astray) > 4 else ''}); hair looks different"
            " from every side; use --set scene=silhouette"
        )


def _share_on(mask: Mask, camera: Camera, points: Float64Array) -> float:
    """Return the share of points (N, 3) that a camera sees on hair or person."""
    height, width = mask.labels.shape
    pixels = camera.project(points) * [width / camera.width, height / camera.height]
    inside = ((pixels >= 0) & (pixels < [width, height])).all(axis=1)
    column, row = pixels[inside].astype(np.int64).T
    return float((mask.labels[row, column] > 0).sum() / len(points))


def _on_skin(model: Model, masks: Sequence[Mask]) -> BoolArray:
    """Return which points (P,) most of the photos that show them have on skin or clothes."""
    seen, skin = np.zeros((2, len(model.points)))
    for point, view, x, y in model.sights:
        labels = masks[int(view)].labels
        row, column = int(y * labels.shape[0]), int(x * labels.shape[1])
        inside = 0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]
        seen[int(point)] += 1
        skin[int(point)] += inside and labels[row, column] == PERSON
    return skin > 0.5 * seen
