"""Rendered photos with what is known of each: labels, where the head is, and landmarks."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float64Array, UInt8Array
from hairkit.io.mesh_text import read_obj
from hairkit.types.camera import Camera
from hairkit.types.scene import read_cameras

EDGE = 760
"""Pixels that the longer side of a render is reduced to."""

_LEAST_TURNED = 0.15
"""Landmarks are seen when the face's direction along the optical axis is less than this."""


@dataclass(frozen=True, eq=False)
class Render:
    """One rendered photo."""

    name: str
    """Capture and photo: `wavy/photos/0_front.jpg`."""
    image: UInt8Array
    """(H, W, 3) RGB."""
    labels: UInt8Array
    """(H, W) 255 hair, 128 the rest of the person, 0 background."""
    head: BoolArray
    """(H, W) where the mesh of the head is, with or without hair in front."""
    landmarks: Float64Array | None
    """(68, 2) iBUG points in pixels, None where the face is not seen."""


def read_renders(folder: Path) -> list[Render]:
    """Return the photos of all captures with truth below a folder.

    A capture of added views (`above/` beside `photos/`) shares its parent's `truth/head.obj`.
    """
    truths = sorted(folder.rglob("truth/truth.json"))
    return [render for truth in truths for render in _read_capture(truth.parents[1], folder)]


def _read_capture(capture: Path, base: Path) -> list[Render]:
    places = (capture / "truth" / "head.obj", capture.parent / "truth" / "head.obj")
    mesh = read_obj(next((path for path in places if path.exists()), places[0]))
    solid = json.loads((capture / "truth" / "truth.json").read_text()).get("landmarks3d")
    marked = capture / "landmarks.json"
    flat = json.loads(marked.read_text())["views"] if marked.exists() else {}
    cameras = read_cameras(capture / "truth" / "truth.json")[1]
    renders = []
    for path, camera in zip(sorted((capture / "photos").iterdir()), cameras, strict=True):
        scale = min(EDGE / max(camera.width, camera.height), 1)
        small = camera.resized(round(camera.width * scale), round(camera.height * scale))
        landmarks = None
        if solid is not None and camera.rotation[2, 2] < _LEAST_TURNED:
            landmarks = small.project(solid)
        elif path.stem in flat:
            landmarks = np.array(flat[path.stem], np.float64) * scale
        photo: Any = cv2.imread(str(path))
        mask: Any = cv2.imread(str(capture / "masks" / f"{path.stem}.png"), cv2.IMREAD_GRAYSCALE)
        size = (small.width, small.height)
        image = np.ascontiguousarray(
            cv2.resize(photo, size, interpolation=cv2.INTER_AREA)[..., ::-1]
        )
        labels: Any = cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST)
        head = _drawn(mesh.vertices, mesh.faces, small)
        renders.append(Render(str(path.relative_to(base)), image, labels, head, landmarks))
    return renders


def _drawn(vertices: Float64Array, faces: Any, camera: Camera) -> BoolArray:
    """Return (H, W) the pixels that triangles cover."""
    canvas = np.zeros((camera.height, camera.width), np.uint8)
    for triangle in np.rint(camera.project(vertices)).astype(np.int32)[faces]:
        cv2.fillConvexPoly(canvas, triangle, 1)
    return canvas > 0
