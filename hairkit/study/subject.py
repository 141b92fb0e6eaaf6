"""What a study asks about: reconstructions with their photos, and stock grooms as distractors.

A picture shows a frame of the same metres around every head.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.evaluation.prediction import Prediction, read_prediction
from hairkit.grooming.densify import densify
from hairkit.head_model.template import default_head
from hairkit.imaging.masked_filters import double_angle
from hairkit.io.capture_reader import WORKING_EDGE
from hairkit.manager import Manager
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.pipeline.take_capture import take_capture
from hairkit.pipeline.work_folder import WORK, LastRun
from hairkit.rendering import draw_views
from hairkit.rendering.measurement import draw_measurements
from hairkit.simulation import run, static_motion
from hairkit.simulation.posing import pose_groom
from hairkit.stages import TURN
from hairkit.synth import STYLES, grow
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.groom import Groom
from hairkit.types.mask import HAIR
from hairkit.types.strands import Strands

HAIRS, POINTS = 20_000, 48
"""Strands drawn of a groom, and points of each."""
COARSE_HAIRS, COARSE_POINTS, COARSE_WIDTH = 4_000, 24, 2.5e-3
"""Strands, points a strand and width in metres of the hair that a program looks at: a pixel of the
frame is a millimetre wide."""
COLOUR_SIDES_DEG, COLOUR_SCALE = (0.0, 90.0, 180.0, 270.0), 1 / 3
"""Sides from which the colour of a groom is looked at, and the scale of the pictures for it."""
SIMULATOR = "rods"
SETTLING_S = 2.0
"""Seconds of simulation before a groom is drawn: it hangs as a game would show it."""
_RATE = 60.0
_STOCK_GUIDES = 1_000
"""Guides of a stock groom: as many as an artist's."""
WIDTH_M, HEIGHT_M = 0.36, 0.48
"""What a picture spans at the head, metres: long hair and shoulders fit in."""
ABOVE = 0.4
"""Share of the height above the head's origin, which lies between the ears."""
WIDTH, HEIGHT = 360, 480
"""Pixels of a picture."""
BACKDROP = 200
"""Grey where the frame leaves a photo."""

_Values = TypeVar("_Values", np.uint8, np.float32)


@dataclass(frozen=True, eq=False)
class Look:
    """What a program compares of the hair in a picture of the frame."""

    hair: Float32Array
    """(H, W) coverage by hair, 0 to 1."""
    direction: Float32Array
    """(H, W, 2) cosine and sine of twice the angle of the hair, times its certainty."""
    colour: Float32Array
    """(3,) mean sRGB of the hair, 0 to 255."""


@dataclass(frozen=True, eq=False)
class Shot:
    """A photo of a subject, and the camera that took it."""

    name: str
    camera: Camera
    picture: UInt8Array
    """(H, W, 3) RGB of the frame."""
    look: Look


@dataclass(frozen=True, eq=False)
class Subject:
    """A groom at rest under gravity, and the photos it was made of; none of a stock groom."""

    name: str
    groom: Groom
    shots: tuple[Shot, ...] = ()

    def shot(self, name: str) -> Shot:
        """Return the photo of a name."""
        return next(shot for shot in self.shots if shot.name == name)

    def draw(self, cameras: Sequence[Camera]) -> list[UInt8Array]:
        """Return the groom on head and bust in frames (H, W, 3) RGB, from where cameras stand."""
        framed, groom = [frame_camera(camera) for camera in cameras], self.groom
        return draw_views(self._hair, groom.head, framed, material=groom.material, bust=True)

    def look(self, camera: Camera) -> Look:
        """Return what a program sees of the groom from where `camera` stands.

        Its colour is that from all sides: it hardly depends on the side, since the light comes
        from the camera.
        """
        framed, head = frame_camera(camera), self.groom.head
        measured = draw_measurements(self._coarse, head, framed, width=COARSE_WIDTH)
        seen = measured.seen.astype(np.float32)
        return Look(seen, double_angle(measured.angle, seen), self._colour)

    @cached_property
    def _hair(self) -> Strands:
        """Full hair; made where the groom is shown."""
        count = max(HAIRS, len(self.groom.strands))
        return densify(self.groom, count).resampled(POINTS)

    @cached_property
    def _coarse(self) -> Strands:
        return densify(self.groom, COARSE_HAIRS).resampled(COARSE_POINTS)

    @cached_property
    def _colour(self) -> Float32Array:
        """The mean sRGB (3,) of the hair, seen from `COLOUR_SIDES_DEG`."""
        hair, head, material = self._coarse, self.groom.head, self.groom.material
        size = (round(COLOUR_SCALE * WIDTH), round(COLOUR_SCALE * HEIGHT))
        turn = [
            Camera.on_turn(deg, focal=HEIGHT, width=WIDTH, height=HEIGHT)
            for deg in COLOUR_SIDES_DEG
        ]
        cameras = [frame_camera(camera).resized(*size) for camera in turn]
        pictures = draw_views(hair, head, cameras, material=material, supersample=1)
        seen = [draw_measurements(hair, head, each, width=COARSE_WIDTH).seen for each in cameras]
        return _mean_colour(np.concatenate(pictures), np.concatenate(seen).astype(np.float32))


def read_subject(
    folder: str | os.PathLike[str],
    manager: Manager,
    *,
    name: str | None = None,
    settling: float = SETTLING_S,
) -> Subject:
    """Read what `hairkit reconstruct` wrote, and the photos that its record names.

    The subject has a name, or that of the folder.
    Raises `InputError` where the photos, the masks or the orientation maps are not there any more.
    """
    base = Path(folder)
    prediction, capture = read_prediction(base), _read_photos(base, manager)
    if prediction.masks is None or prediction.orientations is None:
        raise InputError(f"{base / WORK}: masks and orientation maps are gone; reconstruct again")
    photos = {view.name: view.image for view in capture.views}
    if missing := set(prediction.names) - photos.keys():
        raise InputError(f"{base}: no photo of view {min(missing)!r}; reconstruct again")
    shots = tuple(
        _shot(prediction, view, photos[name]) for view, name in enumerate(prediction.names)
    )
    name = name or base.resolve().name
    return replace(settle(name, prediction.groom, manager, settling), shots=shots)


def make_stock(manager: Manager, *, seed: int = 0) -> tuple[Subject, ...]:
    """Return a groom of each style of `hairkit synth`: hair that nobody photographed."""
    head = default_head()
    return tuple(
        settle(f"stock {style}", grow(style, head, _STOCK_GUIDES, seed), manager, SETTLING_S)
        for style in STYLES
    )


def distinct_names(folders: Sequence[Path]) -> tuple[str, ...]:
    """Return the last parts of the folders' paths, as many as tell the folders apart."""
    paths = [folder.resolve().parts for folder in folders]
    names: tuple[str, ...] = ()
    for depth in range(1, max(len(parts) for parts in paths) + 1):
        names = tuple("/".join(parts[-depth:]) for parts in paths)
        if len({*names}) == len(names):
            break
    return names


def check_names(subjects: Sequence[Subject]) -> None:
    """Raise `InputError` where two subjects have one name."""
    names = [subject.name for subject in subjects]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two subjects are called {name!r}; a study tells them by their names")


def settle(name: str, groom: Groom, manager: Manager, seconds: float) -> Subject:
    """Return the groom as it hangs after `seconds`."""
    if not len(groom.strands):
        raise InputError(f"{name}: its groom holds no strands")
    if seconds > 0:
        simulator = manager.call("make_simulator", SIMULATOR, groom=groom)
        with manager.guard("make_simulator", SIMULATOR):
            cache = run(simulator, static_motion(), 1, _RATE, warm_up=seconds)
        groom = pose_groom(groom, cache, 0)
    return Subject(name, groom)


def _read_photos(folder: Path, manager: Manager) -> Capture:
    """Return the capture of a run, arranged as the run found the turn."""
    record = read_record(folder / RECORD)
    if record.photos is None:
        raise InputError(f"{folder}: its photos were given as objects, not as files")
    edge = record.max_edge or WORKING_EDGE
    capture = take_capture(record.photos, record.as_recipe(), manager, edge)
    last = LastRun(folder / WORK)
    return capture.arranged(last.latest(TURN)) if last.has(TURN) else capture


def _shot(prediction: Prediction, view: int, photo: UInt8Array) -> Shot:
    assert prediction.masks is not None
    assert prediction.orientations is not None
    camera, found = prediction.cameras[view], prediction.orientations[view]
    hair = cut_out((prediction.masks[view].labels == HAIR).astype(np.float32), camera)
    picture = cut_out(photo, camera, BACKDROP)
    direction = cut_out(double_angle(found.angle, found.confidence), camera)
    look = Look(hair, direction, _mean_colour(picture, hair))
    return Shot(prediction.names[view], camera, picture, look)


def _mean_colour(picture: UInt8Array, hair: Float32Array) -> Float32Array:
    if not hair.any():
        return np.zeros(3, np.float32)
    return np.average(picture.reshape(-1, 3), axis=0, weights=hair.ravel()).astype(np.float32)


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
