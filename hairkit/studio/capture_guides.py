"""Outlines of the template head for the views of a turn, drawn by hairkit's own rasteriser.

The camera is the one that the solver assumes when nothing else is known: the outline is where a
head will be if whoever takes the photo does as the page says.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import cv2
import numpy as np

from hairkit.arrays import Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import TOP_DEG, TURN
from hairkit.studio.framing import Guide
from hairkit.types.camera import Camera
from hairkit.types.capture import focal_from_equivalent

WIDTH, HEIGHT = 360, 480
"""Pixels of the picture that is drawn; outlines are given in shares of it."""
LENS_MM, DISTANCE = 42.0, 0.7
"""Full-frame focal length and metres to the head, as the plugin `manual` assumes them."""
LOOK_AT = (0.0, -0.02, 0.0)
"""Metres in the head frame in the middle of the picture."""
HAIR_ABOVE = 0.045
"""Thickness of usual hair on the head, metres: its top is the line that hair should not pass."""
FINER, SMOOTH, TOLERANCE = 2, 3.0, 0.9
"""How many times as many pixels an outline is taken from, the Gaussian that smooths it and the
distance by which it is simplified, both in those pixels."""


def guides_for(count: int, above: bool) -> list[dict[str, Any]]:
    """Return name, azimuth, elevation, outline and dashed line of each view of a turn, for pages.

    `outline` are curves [[x, y, x, y, ...], ...], silhouette and face, and `top` the height of the
    line, in shares of width and height of a picture with sides 3 : 4.
    """
    azimuths = [360.0 * index / count for index in range(count)]
    guides = [guide_at(azimuth, 0.0) for azimuth in azimuths]
    return [_for_page(guide) for guide in (*guides, *([guide_at(0.0, TOP_DEG)] * above))]


@cache
def guide_at(azimuth_deg: float, elevation_deg: float) -> Guide:
    """Return what is drawn over the picture of a view of the turn, or of one from above."""
    camera, head = camera_at(azimuth_deg, elevation_deg), default_head()
    inside = np.isfinite(head_depth(head, camera.resized(FINER * WIDTH, FINER * HEIGHT)))
    soft = cv2.GaussianBlur(inside.astype(np.float32), (0, 0), SMOOTH)
    filled = (soft > 1 / 2).astype(np.uint8)
    curves, _ = cv2.findContours(filled, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    smooth = [cv2.approxPolyDP(curve, TOLERANCE, True)[:, 0] for curve in curves]
    closed = [np.array([*curve, curve[0]]) for curve in smooth if len(curve) > 2]
    hair = (head.vertices + HAIR_ABOVE * head.normals())[head.scalp > 0].astype(np.float64)
    assert head.landmark_vertices is not None
    landmarks = camera.project(head.vertices[head.landmark_vertices].astype(np.float64))
    return Guide(
        "top" if elevation_deg else _NAMES.get(azimuth_deg, f"{azimuth_deg:.0f}°"),
        azimuth_deg,
        elevation_deg,
        tuple(_shares((curve + 0.5) / FINER) for curve in closed),
        tuple(_shares(landmarks[order]) for order in _seen_lines(camera)),
        _shares(landmarks),
        float(camera.project(hair)[:, 1].min() / HEIGHT),
    )


def _for_page(guide: Guide) -> dict[str, Any]:
    curves = [*guide.silhouette, *guide.face]
    return {
        "name": guide.name, "azimuth": guide.azimuth, "elevation": guide.elevation,
        "outline": [curve.round(4).ravel().tolist() for curve in curves], "top": guide.line,
    }  # fmt: skip


def camera_at(azimuth_deg: float, elevation_deg: float) -> Camera:
    """Return the camera of a view."""
    return Camera.on_turn(
        azimuth_deg,
        elevation_deg=elevation_deg,
        distance=DISTANCE,
        target=LOOK_AT,
        focal=focal_from_equivalent(LENS_MM, WIDTH, HEIGHT),
        width=WIDTH,
        height=HEIGHT,
    )


def _shares(pixels: Float64Array) -> Float64Array:
    return np.asarray(pixels / (WIDTH, HEIGHT), np.float64)


_NAMES = {azimuth: name for name, azimuth in TURN.items()}
_LINES = ((17, 22), (22, 27), (27, 31), (31, 36), (36, 42), (42, 48), (48, 60))
"""First and last landmark of brows, nose, eyes and mouth (iBUG)."""
_CLOSED = (36, 42, 48)
_FACING = math.cos(math.radians(80))
"""Cosine of the angle between normal and view from which a line of the face is drawn."""


def _seen_lines(camera: Camera) -> list[list[int]]:
    """Return the landmarks of each line of brows, nose, eyes and mouth that the camera sees."""
    head = default_head()
    assert head.landmark_vertices is not None
    points = head.vertices[head.landmark_vertices].astype(np.float64)
    towards = -camera.view_direction(points)
    seen = (head.normals()[head.landmark_vertices] * towards).sum(axis=1) > _FACING
    orders = [[*range(*line), *([line[0]] if line[0] in _CLOSED else [])] for line in _LINES]
    return [order for order in orders if seen[order].all()]
