"""Photos around the default head, with what detectors find in them, and the turn of these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from hairkit_plugins.photo_turn import find_turn
from hairkit_plugins.photo_turn.arrangement import wrap

from hairkit import Camera, Capture, View
from hairkit.arrays import Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.head_model.template import default_head
from hairkit.types.face import Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

WIDTH, HEIGHT = 150, 200
SKIN, HAIR = (220, 170, 140), (60, 40, 30)
EIGHT = tuple(45.0 * i for i in range(8))
TWO_FRONTS = (-8.0, 5.0, 45.0, 90.0, 140.0, 180.0, -135.0, -80.0)
WITH_A_GAP = (0.0, 45.0, 90.0, 180.0, 225.0, 270.0, 315.0)
CARELESS = (-12.0, -39.0, -96.0, -144.0, -168.0, 129.0, 91.0, 39.0)


@dataclass(frozen=True)
class Shot:
    """A photo with what detectors find in it."""

    view: View
    face: Face
    person: Person
    azimuth_deg: float


@cache
def shoot(azimuth: float, elevation: float = 0.0) -> Shot:
    """Return a photo of the default head: the face is skin, all behind the ears is hair."""
    head = default_head()
    camera = Camera.on_turn(
        azimuth, elevation_deg=elevation, distance=0.8, target=[0.0, -0.03, 0.0], focal=350.0,
        width=WIDTH, height=HEIGHT,
    )  # fmt: skip
    depth = head_depth(head, camera)
    inside = np.isfinite(depth)
    pixels = np.stack(np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5), axis=-1)
    local = camera.unproject(pixels[inside], depth[inside])
    image = np.full((HEIGHT, WIDTH, 3), 200, np.uint8)
    image[inside] = np.where((local[:, 2] > 0.02)[:, None] & (local[:, 1:2] < 0.08), SKIN, HAIR)
    seed = round(7 * azimuth + elevation) % 1000
    wall = np.random.default_rng(seed).integers(60, 250, (8, 6, 3)).astype(np.uint8)
    room = cv2.resize(wall, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    image[~inside] = room[~inside]
    face = Face.absent()
    yaw = float(wrap(np.array(azimuth)))
    if abs(yaw) < 52 and elevation < 40:
        marks = camera.project(head.vertices[head.landmark_vertices].astype(np.float64))
        face = Face(1.0, marks, np.full(68, 2.0), yaw + 2, elevation - 1, 0.0)
    photo = View("x", 0.0, image, named=False)
    return Shot(photo, face, Person(np.where(inside, 255, 0).astype(np.uint8)), yaw)


def ring(azimuths: Sequence[float]) -> list[Shot]:
    """Return level photos, seen from these azimuths."""
    return [shoot(float(azimuth)) for azimuth in azimuths]


def find(shots: Sequence[Shot], source: Path | None = None) -> Turnaround:
    """Run the plugin on photos in this order, named IMG_0.jpg and so on."""
    views = tuple(
        replace(s.view, name=f"view-{i}", azimuth_deg=360.0 * i / len(shots))
        if not s.view.named
        else s.view
        for i, s in enumerate(shots)
    )
    views = tuple(replace(v, photo_path=Path(f"IMG_{i}.jpg")) for i, v in enumerate(views))
    faces, persons = tuple(s.face for s in shots), tuple(s.person for s in shots)
    return find_turn(Capture(views, source=source), faces, persons)


@cache
def found_in_order(azimuths: tuple[float, ...]) -> Turnaround:
    """Return the turn of level photos that are given in their order."""
    return find(ring(azimuths))


def off(turn: Turnaround, shots: Sequence[Shot]) -> Float64Array:
    """Return by how many degrees each photo's azimuth is wrong."""
    true = np.array([shot.azimuth_deg for shot in shots])
    return np.abs(wrap(turn.azimuth_deg - true))


def named(shots: Sequence[Shot], azimuths: Sequence[float]) -> list[Shot]:
    """Return the photos with views that a user named."""
    return [
        replace(shot, view=replace(shot.view, name=f"n{i}", azimuth_deg=a, named=True))
        for i, (shot, a) in enumerate(zip(shots, azimuths, strict=True))
    ]
