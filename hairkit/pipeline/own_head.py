"""Landmarks for a head that has none: drawn from three sides, found by the recipe's detector.

The detector that finds faces in photos finds that of the mesh in pictures of it. The landmarks of
the pictures are intersected in space and carried to the nearest vertices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array, Int32Array
from hairkit.cameras.similarity import triangulate
from hairkit.errors import RenderError
from hairkit.manager import Manager
from hairkit.pipeline.recipe import Recipe
from hairkit.stages import FACES
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.face import Face
from hairkit.types.head import Head
from hairkit.types.strands import Strands

SIDES_DEG = (45.0, 0.0, -45.0)
"""Azimuths of the pictures; detectors know faces up to about 50 degrees."""
DISTANCE, MIDDLE = 0.9, (0.0, -0.06, 0.02)
"""Metres from the cameras to the face, and where they look in the head frame."""
WIDTH, HEIGHT, FOCAL = 720, 900, 1800.0
"""Pixels of a picture; a head of usual size fills half of its height."""

FindFace = Callable[[View], Face | None]


def mark_head(head: Head, recipe: Recipe, manager: Manager, tell: Callable[[str], None]) -> Head:
    """Return the head with landmarks if it had none and the recipe's detector finds them.

    `tell` receives one line when they are missing and when they have been found.
    """
    if head.landmark_vertices is not None or not recipe.has(FACES):
        return head
    try:
        marked = find_landmarks(head, lambda view: recipe.ask(manager, FACES, view=view))
    except RenderError as error:
        tell(f"no landmarks for the head: {error}")
        return head
    if marked is None:
        tell("no face was found on the head; put its landmarks into NAME.landmarks.json")
        return head
    tell("the head's landmarks were found in pictures of it")
    return marked


def find_landmarks(head: Head, find: FindFace) -> Head | None:
    """Return the head with the landmarks that a detector finds in pictures of it, or None.

    Parameters
    ----------
    head
        In the head frame (docs/conventions.md), the face towards +Z.
    find
        Finds the face in a view; `find_face` of a plugin, for instance.

    Raises
    ------
    RenderError
        There is no OpenGL.
    """
    cameras = [_camera(azimuth) for azimuth in SIDES_DEG]
    faces = [find(view) for view in _pictures(head, cameras)]
    sure = [(c, f) for c, f in zip(cameras, faces, strict=True) if f is not None and f.sure]
    if len(sure) < 2:
        return None
    seen = np.stack([face.landmarks for _, face in sure])
    weights = np.stack([1 / np.maximum(face.noise_px, 1.0) ** 2 for _, face in sure])
    points = triangulate([camera for camera, _ in sure], seen, weights)
    return replace(head, landmark_vertices=_nearest_vertices(head, points))


def _camera(azimuth_deg: float) -> Camera:
    return Camera.on_turn(
        azimuth_deg, distance=DISTANCE, target=MIDDLE, focal=FOCAL, width=WIDTH, height=HEIGHT
    )


def _pictures(head: Head, cameras: list[Camera]) -> list[View]:
    from hairkit.rendering.picture import draw_views  # loads OpenGL

    bald = Strands(np.zeros((0, 3), np.float32), np.zeros(1, np.int64))
    return [
        View(f"head at {camera.azimuth_deg:.0f}", camera.azimuth_deg, picture)
        for camera, picture in zip(cameras, draw_views(bald, head, cameras), strict=True)
    ]


def _nearest_vertices(head: Head, points: Float64Array) -> Int32Array:
    """Return the vertices of faces that are nearest to points (68, 3)."""
    used = np.unique(head.faces)
    nearest = cKDTree(head.vertices[used]).query(points)[1]
    return np.asarray(used[nearest], np.int32)
