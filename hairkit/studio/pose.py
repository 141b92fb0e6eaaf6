"""Where the head and the cameras are: the head drawn over every photo, and how well it fits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.cameras.depth_raster import head_depth
from hairkit.errors import InputError
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.storage import read_text
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.head import JAW_LANDMARKS, Head
from hairkit.types.scene import read_cameras

EDGE = 480
"""Long edge in pixels of the pictures in which the head is drawn for its outline."""


def describe(result: Path) -> dict[str, Any]:
    """Return for each view its photo's name, the head's outline and its landmarks there.

    Coordinates are shares of the photo's width and height. Raises `InputError` without a result.
    """
    if not (result / "scene.json").is_file():
        raise InputError("no cameras yet; they are found when the hair is made")
    names, cameras = read_cameras(result / "scene.json")
    photos = [view.get("photo") for view in json.loads(read_text(result / "scene.json"))["views"]]
    head = Groom.load(result / "groom.npz").head
    health = [(f.light, f.line()) for f in read_record(result / RECORD).health]
    return {
        "views": [
            {
                "photo": photo,
                "name": name,
                "azimuth": round(camera.azimuth_deg, 1),
                "elevation": round(camera.elevation_deg, 1),
                "outline": _outline(camera, head),
                "landmarks": _landmarks(camera, head),
            }
            for name, camera, photo in zip(names, cameras, photos, strict=True)
        ],
        "health": [line for line in health if "landmark" in line[1] or "camera" in line[1]],
    }


def _outline(camera: Camera, head: Head) -> list[list[float]]:
    scale = EDGE / max(camera.width, camera.height)
    small = camera.resized(round(camera.width * scale), round(camera.height * scale))
    inside = np.isfinite(head_depth(head, small)).astype(np.uint8)
    curves, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    size = (small.width, small.height)
    return [
        [round(float(v), 4) for v in ((curve[:, 0] + 0.5) / size).ravel()]
        for curve in curves
        if len(curve) > 2
    ]


def _landmarks(camera: Camera, head: Head) -> list[list[float]]:
    """Return the inner landmarks of the fitted head, as shares of the picture."""
    if head.landmark_vertices is None:
        return []
    points = head.vertices[head.landmark_vertices].astype(np.float64)[JAW_LANDMARKS:]
    shares = camera.project(points) / (camera.width, camera.height)
    return [[round(float(x), 4), round(float(y), 4)] for x, y in shares]
