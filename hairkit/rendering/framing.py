"""Cameras that show a whole groom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from hairkit.types.camera import Camera

VERTICAL_ANGLE = np.radians(26.0)
"""Field of view over the picture's height."""
MARGIN = 1.12
"""Room around the points: the picture is this much larger than they need."""


def framing_cameras(
    points: npt.ArrayLike, turn: Sequence[tuple[float, float]], width: int, height: int
) -> list[Camera]:
    """Return a camera for each (azimuth, elevation) in degrees, all as near as shows all.

    Every point (N, 3) lies inside every picture, with a margin.
    """
    cloud = np.asarray(points, np.float64)
    middle = (cloud.min(axis=0) + cloud.max(axis=0)) / 2
    half = np.tan(VERTICAL_ANGLE / 2)
    slopes = np.array([half * width / height, half]) / MARGIN
    cameras = [
        Camera.on_turn(
            azimuth,
            elevation_deg=elevation,
            distance=0.0,
            target=middle,
            focal=height / 2 / float(half),
            width=width,
            height=height,
        )
        for azimuth, elevation in turn
    ]
    distance = 0.0
    for camera in cameras:
        local = camera.to_camera(cloud)
        needed = (np.abs(local[:, :2]) / slopes).max(axis=1) - local[:, 2]
        distance = max(distance, float(needed.max()))
    return [move_back(camera, distance) for camera in cameras]


def move_back(camera: Camera, distance: float) -> Camera:
    """Return the camera moved `distance` metres against its view."""
    matrix = camera.camera_from_head.copy()
    matrix[2, 3] += distance
    return replace(camera, camera_from_head=matrix)
