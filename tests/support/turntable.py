"""A made-up capture for tests of cameras: a bust seen by cameras that stray from the turn."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit import Camera, Capture, Head, Mask, View
from hairkit.arrays import Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.head_model.template import default_head
from hairkit.types.mask import HAIR, PERSON

WIDTH, HEIGHT = 300, 400
NAMES = (
    "front", "front-left", "left", "back-left", "back", "back-right", "right", "front-right",
)  # fmt: skip


@dataclass(frozen=True)
class Turntable:
    """A capture with what is true about it."""

    capture: Capture
    masks: tuple[Mask, ...]
    cameras: tuple[Camera, ...]
    head: Head


def turntable(
    rng: np.random.Generator,
    *,
    stray: float = 1.0,
    model: str = "perspective",
    noise: float = 0.2,
    distance: float = 0.7,
) -> Turntable:
    """Return the default head photographed eight times; `stray` 0 is the exact turn.

    It is as large in the photos at any distance.
    """
    head = default_head()
    cameras = tuple(_camera(45.0 * i, rng, stray, model, distance) for i in range(8))
    views, masks = [], []
    marks = head.vertices[head.landmark_vertices].astype(np.float64)
    for index, (name, camera) in enumerate(zip(NAMES, cameras, strict=True)):
        seen = np.isfinite(head_depth(head, camera))
        labels = np.where(_grown(seen), 128, 0).astype(np.uint8)
        rows = np.arange(HEIGHT)[:, None]
        top = camera.project([0.0, 0.05, 0.0])[1]
        labels[(labels == 128) & (rows < top)] = 255
        landmarks = None
        if index in (0, 1, 7):
            landmarks = camera.project(marks) + rng.normal(0, noise, (68, 2))
        image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        views.append(View(name, 45.0 * index, image, landmarks=landmarks))
        masks.append(Mask(labels, True))
    return Turntable(Capture(tuple(views)), tuple(masks), cameras, head)


def _camera(
    azimuth: float, rng: np.random.Generator, stray: float, model: str, distance: float
) -> Camera:
    off = stray * rng.uniform(-1, 1, 7)
    perspective = model == "perspective"
    return Camera.on_turn(
        azimuth + 4 * off[0],
        elevation_deg=3 * off[1],
        roll_deg=2 * off[2],
        distance=distance * (1 + 0.05 * off[3] if perspective else 1),
        target=np.array([0.0, -0.06, 0.0]) + 0.006 * off[4:7],
        focal=800.0 * distance if perspective else 800.0,
        width=WIDTH,
        height=HEIGHT,
        model="perspective" if perspective else "orthographic",
    )


def _grown(seen: Float64Array) -> Float64Array:
    return cv2.morphologyEx(seen.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3))) > 0


def bald_masks(masks: tuple[Mask, ...]) -> tuple[Mask, ...]:
    """Return masks with all hair but a pixel in a corner, since no mask is without."""
    bald = []
    for mask in masks:
        labels = np.where(mask.labels == HAIR, PERSON, mask.labels).astype(np.uint8)
        labels[-1, -1] = HAIR
        bald.append(Mask(labels, True))
    return tuple(bald)


def azimuth_errors(found: tuple[Camera, ...], true: tuple[Camera, ...]) -> Float64Array:
    """Return degrees by which cameras are off, after the turn that all have in common."""
    off = np.array([f.azimuth_deg - t.azimuth_deg for f, t in zip(found, true, strict=True)])
    off = (off + 180) % 360 - 180
    return np.abs(off - np.median(off))
