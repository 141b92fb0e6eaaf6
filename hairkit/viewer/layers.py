"""Results of the pipeline stages as drawable layers: photos, masks, orientation, hull, field.

Each layer is read from the work folder of `hairkit reconstruct` when it is first shown.
"""

from __future__ import annotations

import os
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.errors import HairkitError, InputError
from hairkit.field.isosurface import volume_surface
from hairkit.manager import Manager
from hairkit.pipeline.find_views import frame_photos
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.run_record import RECORD, RunRecord, hash_file, read_record
from hairkit.pipeline.take_capture import take_capture
from hairkit.pipeline.work_folder import WORK, LastRun
from hairkit.rendering.head import Solid
from hairkit.stages import FIELD, FRAMED, HULL, LABELS, ORIENTED, REFINED, TURN, Stage
from hairkit.storage import Stored
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.mask import HAIR, PERSON
from hairkit.types.orientation import OrientationMap
from hairkit.types.volume import VoxelGrid, symmetric_matrices
from hairkit.viewer.draw.lines import Billboard, LineSet

BILLBOARDS = ("photos", "masks", "orientation")
"""Layers of one picture for each camera, drawn as billboards."""
NAMES = ("head", "torso", *BILLBOARDS, "cameras", "hull", "field")
FRUSTUM = 0.35
"""Distance from a camera to its billboard, metres."""
CLAY = (0.30, 0.28, 0.26)
"""Linear RGB of the hull."""
FIELD_LINES = 4000
"""Line segments drawn of an orientation field at most."""
FIELD_LINE_HALF = 1.6
"""Half the length of such a segment, voxels."""
PHOTO_EDGE, COMPARED_EDGE = 640, 1280
"""Long edges of the photos on billboards and of those beside the picture, pixels."""
FRUSTUM_COLOUR = (0.15, 0.35, 0.75, 0.8)
"""Linear RGB and opacity of the view frusta."""
_Found = TypeVar("_Found", bound=Stored)


class Layers:
    """The layers that a folder of results offers."""

    def __init__(self, manager: Manager, results: Path | None, capture: str | None = None) -> None:
        self._manager = manager
        self.last = LastRun(None if results is None else results / WORK)
        record = _find_record(results)
        self._recipe = load_recipe("default") if record is None else record.as_recipe()
        self.capture = _find_capture(record, results) if capture is None else capture
        """What the stage `capture` is asked for, such as the folder of the photos; None if
        unknown."""

    @property
    def available(self) -> tuple[str, ...]:
        """Names of the layers whose data exists."""
        last, cameras = self.last, self.cameras
        have = {
            "photos": self.capture is not None and bool(cameras),
            "masks": any(last.has(LABELS, view) for view in cameras),
            "orientation": any(last.has(ORIENTED, view) for view in cameras),
            "cameras": bool(cameras),
            "hull": last.has(HULL),
            "field": last.has(FIELD),
        }
        return tuple(name for name in NAMES if have.get(name, True))

    def check(self, name: str) -> None:
        """Raise `InputError` if a layer does not exist or its data is missing."""
        if name not in NAMES:
            raise InputError(f"no layer {name!r}; expected one of {', '.join(NAMES)}")
        if name not in self.available:
            cure = (
                "pass the folder of the photos with --capture"
                if name == "photos"
                else "open a folder that hairkit reconstruct wrote"
            )
            raise InputError(f"no data for the layer {name!r}; {cure}")

    def take_capture(self, edge: int) -> Capture:
        """Return the photos, scaled down to a long edge; `InputError` when they are unknown."""
        if self.capture is None:
            raise InputError("the folder of the photos is unknown; pass it with --capture")
        return take_capture(self.capture, self._recipe, self._manager, edge)

    @cached_property
    def cameras(self) -> dict[str, Camera]:
        """Cameras of the photos by view name, head frame, working size; empty without a scene."""
        scene = self._read(self.last.scene)
        return {} if scene is None else dict(zip(scene.names, scene.cameras, strict=True))

    def billboards(self, layer: str) -> dict[str, Billboard]:
        """Return the pictures of a layer, by view name, in front of their cameras."""
        pictures = {"photos": self._photos, "masks": self._masks, "orientation": self._angles}
        found = pictures[layer]()
        return {
            name: Billboard(_picture_corners(self.cameras[name]), image)
            for name, image in found.items()
            if name in self.cameras
        }

    def frusta(self) -> LineSet:
        """Return the view frusta of the cameras as lines."""
        corners = [_picture_corners(camera) for camera in self.cameras.values()]
        eyes = [camera.position for camera in self.cameras.values()]
        paths = []
        for (a, b, c, d), eye in zip(corners, eyes, strict=True):
            paths += [np.array([a, b, d, c, a]), np.array([a, eye, b]), np.array([c, eye, d])]
        return _line_set(paths, FRUSTUM_COLOUR)

    def hull(self) -> Solid | None:
        """Return the surface of the dense part of the hull; None without a hull."""
        hull = self._read(HULL)
        if hull is None:
            return None
        vertices, faces, normals = volume_surface(hull.grid, hull.dense)
        colours = np.tile(np.array(CLAY, np.float32), (len(vertices), 1))
        return Solid(vertices, faces, normals, colours, scatter=0.0)

    def field_lines(self) -> LineSet | None:
        """Return short lines along the field, coloured by direction; None without a field."""
        field, hull = self._read(FIELD), self._read(HULL)
        if field is None or hull is None:
            return None
        cells = np.argwhere(hull.dense & (field.confidence > 0))
        chosen = cells[np.linspace(0, len(cells) - 1, min(FIELD_LINES, len(cells))).astype(int)]
        tensors = field.tensors()[tuple(chosen.T)]
        way = np.linalg.eigh(symmetric_matrices(tensors))[1][:, :, 2]
        middle = field.grid.origin + (chosen + 0.5) * field.grid.spacing
        half = FIELD_LINE_HALF * field.grid.spacing * way
        points = np.stack([middle - half, middle + half], axis=1).reshape(-1, 3)
        colours = np.ones((len(points), 4), np.float32)
        colours[:, :3] = np.repeat(np.abs(way[:, [0, 2, 1]]), 2, axis=0)
        offsets = np.arange(len(chosen) + 1) * 2
        return LineSet(points.astype(np.float32), offsets, colours)

    def confidence(self, rows: Float32Array) -> Float32Array | None:
        """Return the field's confidence (G, m) at rest points (G, m, 3); None without a field."""
        if self._confidence is None:
            return None
        grid, confidence = self._confidence
        return grid.sample(confidence, rows.reshape(-1, 3)).reshape(rows.shape[:2])

    @cached_property
    def _confidence(self) -> tuple[VoxelGrid, Float32Array] | None:
        """Grid and confidence of the field, cached: each frame reads them."""
        field = self._read(FIELD)
        return None if field is None else (field.grid, field.confidence)

    @property
    def has_confidence(self) -> bool:
        """True if the confidence of a field can be shown."""
        return "field" in self.available

    @cached_property
    def photos(self) -> dict[str, UInt8Array]:
        """The photos (H, W, 3) RGB by view name; empty where they are unknown."""
        return self._images(COMPARED_EDGE)

    def _photos(self) -> dict[str, UInt8Array]:
        photos = self._images(PHOTO_EDGE).items()
        return {name: np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2RGBA)) for name, image in photos}

    def _images(self, edge: int) -> dict[str, UInt8Array]:
        if self.capture is None:
            return {}
        capture, framing, turn = self.take_capture(edge), self._read(FRAMED), self._read(TURN)
        if framing is not None and len(framing.frames) == len(capture.views):
            capture = frame_photos(capture, framing)
        if turn is not None and len(turn.names) == len(capture.views):
            capture = capture.arranged(turn)
        return {view.name: view.image for view in capture.views}

    def _masks(self) -> dict[str, UInt8Array]:
        pictures = {}
        refined = self._read(REFINED)
        masks = self._every(LABELS)
        if refined is not None and len(refined.views) == len(self.cameras):
            masks = dict(zip(self.cameras, refined.views, strict=True))
        for name, mask in masks.items():
            image = np.zeros((*mask.labels.shape, 4), np.uint8)
            image[mask.labels == HAIR] = (232, 60, 132, 230)
            image[mask.labels == PERSON] = (70, 130, 235, 150)
            pictures[name] = image
        return pictures

    def _angles(self) -> dict[str, UInt8Array]:
        return {name: _hsv_picture(found) for name, found in self._every(ORIENTED).items()}

    def _every(self, stage: Stage[_Found]) -> dict[str, _Found]:
        found = {view: self._read(stage, view) for view in self.cameras}
        return {view: value for view, value in found.items() if value is not None}

    def _read(self, stage: Stage[_Found], view: str = "") -> _Found | None:
        """Return the stored result of a stage; None if missing or of another version."""
        try:
            return self.last.latest(stage, view)
        except HairkitError:
            return None


def _find_record(results: Path | None) -> RunRecord | None:
    """Return the record of a reconstruction, None where there is none that can be read."""
    if results is None or not (results / RECORD).is_file():
        return None
    try:
        return read_record(results / RECORD)
    except HairkitError:
        return None


def _find_capture(record: RunRecord | None, results: Path | None) -> str | None:
    """Return the photos that a record names, None if they lay on this machine and are gone.

    Of a project that was copied they are those of the copy: around or beside the results.
    """
    photos = None if record is None else record.photos
    if record is None or photos is None or not Path(photos).is_absolute():
        return photos
    above = Path(results or ".").resolve().parent
    for place, first in product((above, above / Path(photos).name), record.inputs[:1]):
        copy = place / os.path.relpath(first.path, photos)
        if copy.is_file() and hash_file(copy).sha256 == first.sha256:
            return str(place)
    return photos if Path(photos).exists() else None


def _hsv_picture(found: OrientationMap) -> UInt8Array:
    """Return a picture (H, W, 4) whose hue is the angle and whose opacity is the confidence."""
    half = np.full(found.angle.shape, 220, np.uint8)
    hue = (found.angle * (180 / np.pi)).astype(np.uint8)
    rgb = cv2.cvtColor(np.stack([hue, half, half], axis=-1), cv2.COLOR_HSV2RGB)
    alpha = (np.sqrt(found.confidence) * 255).astype(np.uint8)
    return np.asarray(np.dstack([rgb, alpha]), np.uint8)


def _picture_corners(camera: Camera) -> Float32Array:
    width, height = camera.width, camera.height
    pixels = np.array([[0, 0], [width, 0], [0, height], [width, height]], np.float64)
    depth = FRUSTUM if camera.model == "perspective" else 0.0
    return camera.unproject(pixels, np.full(4, depth)).astype(np.float32)


def _line_set(paths: list[Float64Array], colour: tuple[float, ...]) -> LineSet:
    offsets = np.concatenate([[0], np.cumsum([len(path) for path in paths])])
    points = np.concatenate([*paths, np.zeros((0, 3))]).astype(np.float32)
    return LineSet(points, offsets, np.tile(np.array(colour, np.float32), (len(points), 1)))
