"""Faces by MediaPipe's networks: a detector, a mesh of 468 points, and our table of 68 of them.

Bazarevsky et al., "BlazeFace" (2019), finds the face, Kartynnik et al., "Real-time facial surface
geometry from monocular video on mobile GPUs" (2019), lays a mesh over it. Then our own:

1. The photo is looked at in four orientations; a photo that lies on its side is noticed.
2. The mesh is found again in shifted, zoomed and mirrored crops. Its median is kept.
3. Each iBUG landmark is a fixed weighted sum of mesh points (`landmark_table.csv`), fitted to
   rendered heads whose landmarks are known; so is the noise of each landmark.
4. The mesh, turned on to an average head, gives the head's yaw, pitch and roll.

It needs three networks: `hairkit models install`. Without them it finds no face and says nothing.
`benchmarks/face_landmarks.py` makes the table and measures it.

* `crops`: square crops at any angle, and the mesh in them
* `detector`: where a face is, in four orientations
* `landmark_table`: 468 mesh points to 68 landmarks, and their noise
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from hairkit import View, hookimpl
from hairkit.arrays import Float64Array, UInt8Array
from hairkit.cameras.similarity import fit_similarity
from hairkit.head_model.template import default_head
from hairkit.nets.model_folder import missing_models
from hairkit.nets.net_process import NetProcess, shared_nets
from hairkit.options import option
from hairkit.types.face import Face
from hairkit.types.head import JAW_LANDMARKS

from .crops import Crop, crop_around, find_mesh, refine_crop, wobble
from .detector import FULL_RANGE, SHORT_RANGE, Detection, detect
from .landmark_table import MESH, noise_of, pick_landmarks

MODELS = (SHORT_RANGE, FULL_RANGE, MESH)
_UPRIGHT_DEG = 45.0
"""A face rolled by more in a turned photo belongs to another quarter turn."""
OVERSHOOT = 0.0023
"""Share of the yaw that the mesh turns too far, for each degree of yaw: near faces are turned
towards perspective cameras, which the network does not know. Measured by
`benchmarks/face_landmarks.py` on rendered heads."""


@dataclass(frozen=True)
class Options:
    """Settings of the face mesh."""

    score: float = option(
        0.3, low=0.05, high=0.95, doc="The detector's score from which a face is looked at."
    )
    crops: int = option(
        3, low=1, high=8, doc="Shifted and zoomed crops; each is looked at mirrored, too."
    )
    turned: bool = option(True, doc="Look for faces in photos that lie on their side.")


@hookimpl
def detect_landmarks(view: View, options: Options) -> Face | None:
    """Return the face in a photo, `Face.absent()` when there is none, None without networks."""
    if missing_models(MODELS):
        return None
    return find_face(view.image, options, shared_nets())


def find_face(image: UInt8Array, options: Options, nets: NetProcess) -> Face:
    """Return the surest face of a photo (H, W, 3), RGB, or `Face.absent()`."""
    turns = range(4) if options.turned else range(1)
    best, best_score = None, 0.0
    for found in detect(image, turns, options.score, nets):
        if found.score <= best_score:
            break  # the rest scores less, however sure the mesh is
        mesh, presence = find_mesh(image, [found.crop()], nets)
        around = crop_around(mesh[0])
        turned = np.exp(1j * (around.angle + found.quarter_turns * np.pi / 2))
        upright = abs(np.angle(turned, deg=True)) < _UPRIGHT_DEG
        if upright and found.score * presence[0] > best_score:
            best, best_score = (found, around), float(found.score * presence[0])
    if best is None:
        return Face.absent()
    found, around = best
    return _settle(image, found, refine_crop(image, around, nets), options, nets)


def _settle(
    image: UInt8Array, found: Detection, around: Crop, options: Options, nets: NetProcess
) -> Face:
    """Return the median of the landmarks over several crops, and how sure each is."""
    crops = wobble(around, options.crops)
    meshes, presence = find_mesh(image, crops, nets)
    landmarks = pick_landmarks(meshes, np.array([crop.mirrored for crop in crops]))
    middle = np.median(landmarks, axis=0)
    yaw, pitch, roll = measure_angles(_upright(middle, found.quarter_turns))
    spread = np.sqrt(np.square(landmarks - middle)[..., :2].mean(axis=(0, 2)))
    noise = np.hypot(spread, noise_of(yaw, around.size))
    return Face(
        float(np.median(presence)), middle[:, :2], noise, yaw, pitch, roll, found.quarter_turns
    )


def _upright(points: Float64Array, quarter_turns: int) -> Float64Array:
    """Return points (N, 3) of the photo as they lie after clockwise quarter turns of it."""
    x, y, z = points.T
    for _ in range(quarter_turns):
        x, y = -y, x
    return np.stack([x, y, z], axis=1)


def measure_angles(points: Float64Array) -> tuple[float, float, float]:
    """Return yaw, pitch and roll in degrees of landmarks (68, 3) in an upright photo.

    Yaw is the camera's azimuth (positive on the subject's left), pitch its elevation; a positive
    roll is clockwise in the photo. The landmarks without the jaw are turned on to those of the
    default head; x is right, y down, z away from the camera.
    """
    seen = fit_similarity(_average(), points[JAW_LANDMARKS:]).rotation
    towards, up = -seen[2], seen[:, 1]
    yaw = np.degrees(np.arctan2(towards[0], towards[2]))
    pitch = np.degrees(np.arcsin(np.clip(towards[1], -1, 1)))
    roll = np.degrees(np.arctan2(up[0], -up[1]))
    return float(yaw * (1 - OVERSHOOT * abs(yaw))), float(pitch), float(roll)


@cache
def _average() -> Float64Array:
    """Return the landmarks of the default head without the jaw, (51, 3) metres."""
    head = default_head()
    marked = np.asarray(head.landmark_vertices)
    return np.asarray(head.vertices[marked[JAW_LANDMARKS:]], np.float64)
