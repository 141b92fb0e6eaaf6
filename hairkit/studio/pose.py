"""Where the head and the cameras are: the head drawn over every photo, and moved by hand."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.arrays import Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.cameras.similarity import move_head
from hairkit.errors import InputError
from hairkit.options import option
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.storage import read_text
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.head import JAW_LANDMARKS, Head
from hairkit.types.scene import Scene, read_cameras

EDGE = 480
"""Long edge in pixels of the pictures in which the head is drawn for its outline."""


@dataclass(frozen=True)
class Nudge:
    """How a hand moved the head in one photo."""

    photo: str = option("", doc="File name of the photo.")
    shift: tuple[float, float] = option(
        (0.0, 0.0), low=-2, high=2, doc="To the right and down, as shares of width and height."
    )
    turn_deg: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0), low=-180, high=180, unit="deg", doc="About the axes right, down, forward."
    )
    factor: float = option(1.0, low=0.2, high=5, doc="Growth of the head.")


@dataclass(frozen=True, eq=False)
class Placed:
    """A result's scene, and how its head was moved by hand before it was made."""

    scene: Scene
    """Cameras of the full-size photos, in the frame of the head where it is now."""
    photos: tuple[str | None, ...]
    pose: Float64Array
    """(4, 4) similarity from the fitted head to where it is now."""

    @classmethod
    def read(cls, result: Path, built: Float64Array, now: Float64Array) -> Placed:
        """Return the scene of a result that was `built` with one pose, seen with the pose `now`.

        Raises `InputError` without a result.
        """
        if not (result / "scene.json").is_file():
            raise InputError("no cameras yet; they are found when the hair is made")
        names, cameras = read_cameras(result / "scene.json")
        views = json.loads(read_text(result / "scene.json"))["views"]
        scene = Scene(names, cameras, Groom.load(result / "groom.npz").head)
        moved = move_head(scene, np.linalg.inv(built) @ now)
        return cls(moved, tuple(view.get("photo") for view in views), now)

    def nudged(self, nudge: Nudge) -> Float64Array:
        """Return the pose (4, 4) after a hand moved the head; `InputError` for another photo."""
        if nudge.photo not in self.photos:
            raise InputError(f"no camera of the photo {nudge.photo!r} yet")
        camera = self.scene.cameras[self.photos.index(nudge.photo)]
        middle = self.scene.head.vertices.astype(np.float64).mean(axis=0)
        axes = camera.rotation  # rows point right, down and away from the camera
        per_pixel = 1 / _pixels_per_metre(camera, middle)
        pixels = np.array(nudge.shift) * (camera.width, camera.height)
        turn = cv2.Rodrigues(axes.T @ np.radians(nudge.turn_deg))[0]
        change = np.eye(4)
        change[:3, :3] = nudge.factor * turn
        change[:3, 3] = middle - change[:3, :3] @ middle + per_pixel * (pixels @ axes[:2])
        return np.asarray(self.pose @ change, np.float64)


def describe(placed: Placed, result: Path) -> dict[str, Any]:
    """Return for each view its photo's name, the head's outline and its landmarks there.

    Coordinates are shares of the photo's width and height; `per_mm` is pixels of the photo.
    """
    health = [(f.light, f.line()) for f in read_record(result / RECORD).health]
    scene, head = placed.scene, placed.scene.head
    middle = head.vertices.astype(np.float64).mean(axis=0)
    return {
        "views": [
            {
                "photo": photo,
                "name": name,
                "azimuth": round(camera.azimuth_deg, 1),
                "elevation": round(camera.elevation_deg, 1),
                "outline": _outline(camera, head),
                "landmarks": _landmarks(camera, head),
                "middle": _shares(camera, middle[None])[0],
                "per_mm": round(_pixels_per_metre(camera, middle) / 1000, 4),
            }
            for name, camera, photo in zip(scene.names, scene.cameras, placed.photos, strict=True)
        ],
        "moved": not np.array_equal(placed.pose, np.eye(4)),
        "health": [line for line in health if "landmark" in line[1] or "camera" in line[1]],
    }


def _pixels_per_metre(camera: Camera, point: Float64Array) -> float:
    """Return the pixels that a metre across takes at a point (3,)."""
    across = np.stack([point, point + camera.rotation[0]])
    pixels = camera.project(across)
    return float(np.linalg.norm(pixels[1] - pixels[0]))


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
    return _shares(camera, head.vertices[head.landmark_vertices][JAW_LANDMARKS:])


def _shares(camera: Camera, points: Any) -> list[list[float]]:
    shares = camera.project(np.asarray(points, np.float64)) / (camera.width, camera.height)
    return [[round(float(x), 4), round(float(y), 4)] for x, y in shares]
