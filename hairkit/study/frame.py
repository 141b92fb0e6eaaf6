"""The part of a picture that a study shows: the same metres around every head."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.types.camera import Camera

WIDTH_M, HEIGHT_M = 0.36, 0.48
"""What a picture spans at the head, metres: long hair and shoulders fit in."""
ABOVE = 0.4
"""Share of the height above the head's origin, which lies between the ears."""
WIDTH, HEIGHT = 360, 480
"""Pixels of a picture."""
BACKDROP = 200
"""Grey where the frame leaves a photo."""

_Values = TypeVar("_Values", np.uint8, np.float32)


def frame_camera(camera: Camera) -> Camera:
    """Return the camera whose picture is the frame, from where `camera` stands."""
    scale, corner = _placement(camera)
    return replace(
        camera,
        focal=camera.focal * scale,
        centre=(camera.centre - corner) * scale,
        width=WIDTH,
        height=HEIGHT,
    )


def cut_out(
    values: npt.NDArray[_Values], camera: Camera, outside: float = 0.0
) -> npt.NDArray[_Values]:
    """Return what `frame_camera` sees of pixels (H, W) or (H, W, C) that `camera` took.

    `outside` fills what the frame has beyond them.
    """
    scale, corner = _placement(camera.resized(values.shape[1], values.shape[0]))
    size = (max(1, round(values.shape[1] * scale)), max(1, round(values.shape[0] * scale)))
    small = cv2.resize(values, size, interpolation=cv2.INTER_AREA)
    shift = np.array([[1, 0, -corner[0] * scale], [0, 1, -corner[1] * scale]])
    fill = (outside,) * 4
    return np.asarray(cv2.warpAffine(small, shift, (WIDTH, HEIGHT), borderValue=fill), values.dtype)


def _placement(camera: Camera) -> tuple[float, Float64Array]:
    """Return pixels of the frame per pixel of the camera, and the frame's corner (2,) there."""
    origin = camera.camera_from_head[:3, 3]
    per_metre = camera.focal / (origin[2] if camera.model == "perspective" else 1.0)
    middle = camera.project(np.zeros(3))
    corner = middle - per_metre * np.array([WIDTH_M / 2, ABOVE * HEIGHT_M])
    return HEIGHT / (HEIGHT_M * per_metre), np.asarray(corner, np.float64)
