"""Photos of a groom with everything known: a capture for tests, laid out like a real one.

`photos/`, `masks/` and `landmarks.json` are what a method may read; `truth/` is for scoring.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.imaging.picture_file import write_picture
from hairkit.io.capture_reader import FEWEST, MOST, TURN
from hairkit.rendering import (
    Lights,
    Measurements,
    Solid,
    display_width,
    draw_layers,
    draw_measurements,
    draw_views,
    points_at_depth,
)
from hairkit.storage import write_npz, write_text
from hairkit.synth.bust import Bust
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.head import LANDMARKS, Head
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

DISTANCE = 0.756
"""From the camera to the head, metres."""
FOCAL_PER_HEIGHT = 1.38
"""Focal length over the picture's height: a phone held upright, 47 mm equivalent."""
TARGET = (0.0, -0.10, 0.0)
"""Point that the cameras aim at."""
AZIMUTH_JITTER, ELEVATION_JITTER, ROLL_JITTER = 4.0, 3.0, 2.0
"""Degrees at most off the nominal turn."""
DISTANCE_JITTER, TARGET_JITTER = 0.05, 0.006
"""Share of the distance at most; metres, standard deviation."""
LANDMARK_DEG = 50.0
"""Nominal azimuth, either way, up to which a face detector finds landmarks."""
LANDMARK_NOISE = 0.003
"""Standard deviation of a detected landmark, share of the picture's width."""
SENSOR_NOISE = 2.2
"""Standard deviation of a pixel's noise, of 255."""
CLOTHS = ((0.045, 0.075, 0.16), (0.21, 0.03, 0.04), (0.32, 0.31, 0.29), (0.05, 0.13, 0.09))
"""Linear RGB of the clothes."""
KEY_AZIMUTHS, KEY_ELEVATION = (-50, 50), 42.0
"""Direction of the key light, degrees."""
RIM_AZIMUTHS, RIM_ELEVATION = (110, 250), 48.0
"""Direction of the rim light, degrees."""
SKY_COLOUR = (1.1, 1.12, 1.18)
"""Linear RGB of the light from all around: overcast."""
LENS_BLUR = 0.45
"""Standard deviation of the lens' blur, pixels."""
WALL_GREYS, WALL_TINT = (140, 190), 12
"""Brightness of the wall behind and its colours' largest deviation, of 255."""
FURNITURE_PIECES = (5, 10)
"""Number of rectangles that stand for furniture: at least, and fewer than."""
FURNITURE_CORNERS, FURNITURE_SIZES = (-0.2, 0.9), (0.1, 0.6)
"""Their upper left corners and sizes, shares of the picture."""
FURNITURE_GREYS, FURNITURE_TINT = (70, 200), 40
"""Their brightness and colours' largest deviation, of 255."""
WINDOWS, WINDOW_COLOUR = 0.15, np.array([228.0, 234.0, 242.0])
"""Share of the rectangles that are windows, and their RGB."""
ROOM_BLUR = 0.028
"""Standard deviation of the background's blur, share of the picture's width."""
JPEG_QUALITY, PNG_COMPRESSION = 94, 4
"""Of OpenCV's encoders: a phone's, and fast."""
SMALLEST, LARGEST = 64, 8192
"""Pixels along a photo's edge."""


def photograph(
    groom: Groom,
    folder: str | os.PathLike[str],
    *,
    seed: int = 0,
    views: int = len(TURN),
    size: tuple[int, int] = (810, 1080),
    jitter: float = 1.0,
    orthographic: bool = False,
) -> None:
    """Take photos of a groom and write them with masks, landmarks and truth into `folder`.

    Parameters
    ----------
    groom
        Hair and head; hair is photographed as it is, strand by strand.
    folder
        Made where it is missing; its files are replaced.
    seed
        Of the cameras' jitter, the lights, the background and the noise.
    views
        Number of photos, evenly around the head; eight bear the names of their views.
    size
        Width and height of a photo in pixels.
    jitter
        Times the usual deviation of the cameras from the nominal turn; 0 is a perfect turn.
    orthographic
        Parallel rays, as the thesis assumes, instead of a phone's.
    """
    if not all(SMALLEST <= edge <= LARGEST for edge in size):
        raise InputError(f"photos of {size} pixels, expected {SMALLEST} to {LARGEST} a side")
    if not FEWEST <= views <= MOST:
        raise InputError(f"{views} photos, expected {FEWEST} to {MOST}")
    base = Path(folder)
    for name in ("photos", "masks", "truth/orientation"):
        (base / name).mkdir(parents=True, exist_ok=True)
    generator = np.random.default_rng([seed, 7])
    shoot = Shoot.prepare(groom, generator)
    turn = _turn(views)
    cameras = _cameras(list(turn.values()), size, jitter, orthographic, generator)
    stems = [f"{i}_{name}" if views == len(TURN) else name for i, name in enumerate(turn)]
    photos = shoot.photos(cameras, generator)
    bits: type[np.uint8 | np.uint64] = np.uint64 if views > len(TURN) else np.uint8
    seen: npt.NDArray[np.unsignedinteger[Any]] = np.zeros(len(groom.strands.points), bits)
    for index, (stem, camera) in enumerate(zip(stems, cameras, strict=True)):
        write_picture(base / "photos" / f"{stem}.jpg", photos[index], JPEG_QUALITY)
        write_picture(base / "masks" / f"{stem}.png", shoot.labels(camera), PNG_COMPRESSION)
        measured = shoot.measured(camera)
        path = base / "truth" / "orientation" / f"{stem}.png"
        coded = 1 + np.mod(np.rint(measured.angle / np.pi * 255), 255)  # of [0, pi); 0: no hair
        angles = np.where(measured.seen, coded, 0).astype(np.uint8)
        write_picture(path, angles, PNG_COMPRESSION)
        visible = points_at_depth(groom.strands, measured.depth, camera)
        seen |= visible.astype(seen.dtype) << seen.dtype.type(index)
    _write_landmarks(base, groom.head, stems, cameras, generator)
    _write_truth(base / "truth", groom, turn, cameras, seen)


def _turn(views: int) -> dict[str, float]:
    """Return names and nominal azimuths (degrees) of photos evenly around the head."""
    if views == len(TURN):
        return TURN
    return {f"photo-{i + 1:02d}": i * 360.0 / views for i in range(views)}


@dataclass(frozen=True)
class Shoot:
    """Hair, clothes and lights, the same in all photos."""

    groom: Groom
    torso: Solid
    lights: Lights

    @classmethod
    def prepare(cls, groom: Groom, generator: np.random.Generator) -> Shoot:
        """Choose clothes and lights."""
        bust = Bust.under(groom.head)
        cloth = np.array(CLOTHS[generator.integers(len(CLOTHS))], np.float32)
        colours = np.broadcast_to(cloth, bust.vertices.shape).copy()
        torso = Solid(bust.vertices, bust.faces, bust.normals, colours, scatter=0.0)
        key = np.radians([generator.uniform(*KEY_AZIMUTHS), KEY_ELEVATION])
        rim = np.radians([generator.uniform(*RIM_AZIMUTHS), RIM_ELEVATION])
        lights = Lights.studio(_direction(*key), _direction(*rim))
        return cls(groom, torso, replace(lights, sky_colour=SKY_COLOUR))

    def photos(self, cameras: list[Camera], generator: np.random.Generator) -> list[UInt8Array]:
        """Return the photos (H, W, 3) RGB: room, person, sensor noise."""
        rooms = [cluttered_room(camera, generator) for camera in cameras]
        pictures = draw_views(
            self.groom, None, cameras, lights=self.lights, backgrounds=rooms, solids=[self.torso]
        )
        return [_as_sensed(picture, generator) for picture in pictures]

    def labels(self, camera: Camera) -> UInt8Array:
        """Return the true labels (H, W): what covers at least half of a pixel."""
        strands, material = self.groom.strands, self.groom.material
        hair, solid = draw_layers(
            strands, self._solids(), camera, width=display_width(strands, material)
        )
        labels = np.where(hair + solid >= 0.5, PERSON, BACKGROUND)
        return np.where(hair >= 0.5, HAIR, labels).astype(np.uint8)

    def measured(self, camera: Camera) -> Measurements:
        """Return direction and depth of the hair at every pixel, drawn as in the photo."""
        width = display_width(self.groom.strands, self.groom.material)
        return draw_measurements(self.groom.strands, self._solids(), camera, width=width)

    def _solids(self) -> list[Head | Solid]:
        return [self.groom.head, self.torso]


def _cameras(
    azimuths_deg: list[float],
    size: tuple[int, int],
    jitter: float,
    orthographic: bool,
    generator: np.random.Generator,
) -> list[Camera]:
    width, height = size
    focal = FOCAL_PER_HEIGHT * height
    cameras = []
    for azimuth in azimuths_deg:
        turn = jitter * generator.uniform(-1, 1, 4)
        aim = np.array(TARGET) + jitter * TARGET_JITTER * generator.standard_normal(3)
        cameras.append(
            Camera.on_turn(
                azimuth + AZIMUTH_JITTER * turn[0],
                elevation_deg=ELEVATION_JITTER * turn[1],
                roll_deg=ROLL_JITTER * turn[2],
                distance=DISTANCE * (1 + DISTANCE_JITTER * turn[3]),
                target=aim,
                focal=focal / DISTANCE if orthographic else focal,
                width=width,
                height=height,
                model="orthographic" if orthographic else "perspective",
            )
        )
    return cameras


def _direction(azimuth: float, elevation: float) -> Float64Array:
    flat = np.cos(elevation)
    return np.array([np.sin(azimuth) * flat, np.sin(elevation), np.cos(azimuth) * flat])


def _as_sensed(picture: UInt8Array, generator: np.random.Generator) -> UInt8Array:
    """Return a picture (H, W, 3) with a lens' blur and a sensor's noise."""
    soft = cv2.GaussianBlur(picture, (0, 0), LENS_BLUR).astype(np.float32)
    noisy = soft + SENSOR_NOISE * generator.standard_normal(soft.shape, dtype=np.float32)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), np.uint8)


def cluttered_room(camera: Camera, generator: np.random.Generator) -> UInt8Array:
    """Return an out-of-focus background (H, W, 3): a wall, furniture, now and then a window."""
    size = np.array([camera.width, camera.height])
    wall = generator.uniform(*WALL_GREYS) + generator.uniform(-WALL_TINT, WALL_TINT, 3)
    room = np.broadcast_to(wall, (camera.height, camera.width, 3)).astype(np.float32).copy()
    for _ in range(generator.integers(*FURNITURE_PIECES)):
        corner = generator.uniform(*FURNITURE_CORNERS, 2) * size
        other = corner + generator.uniform(*FURNITURE_SIZES, 2) * size
        grey, tint = generator.uniform(*FURNITURE_GREYS), FURNITURE_TINT
        colour = grey + generator.uniform(-tint, tint, 3)
        if generator.random() < WINDOWS:
            colour = WINDOW_COLOUR
        first, second = np.rint(corner).astype(int).tolist(), np.rint(other).astype(int).tolist()
        cv2.rectangle(room, first, second, colour.tolist(), cv2.FILLED)
    blurred = cv2.GaussianBlur(room, (0, 0), camera.width * ROOM_BLUR)
    return np.clip(blurred, 0, 255).astype(np.uint8)


def _write_landmarks(
    base: Path, head: Head, stems: list[str], cameras: list[Camera], generator: np.random.Generator
) -> None:
    """Write what a detector would find: 68 points in the views that show the face."""
    if head.landmark_vertices is None:
        return
    points = head.vertices[head.landmark_vertices]
    views = {}
    for index, (stem, camera) in enumerate(zip(stems, cameras, strict=True)):
        nominal = index * 360.0 / len(stems)
        if min(nominal, 360.0 - nominal) > LANDMARK_DEG:
            continue
        noise = LANDMARK_NOISE * camera.width * generator.standard_normal((LANDMARKS, 2))
        views[stem] = np.round(camera.project(points) + noise, 2).tolist()
    document = {"scheme": "68 points, iBUG/Multi-PIE order", "views": views}
    write_text(base / "landmarks.json", json.dumps(document) + "\n")


def _write_truth(
    folder: Path,
    groom: Groom,
    turn: dict[str, float],
    cameras: list[Camera],
    seen: npt.NDArray[np.unsignedinteger],
) -> None:
    views: list[dict[str, Any]] = []
    for (name, nominal), camera in zip(turn.items(), cameras, strict=True):
        views.append({**camera.to_json(name), "nominal_azimuth": nominal})
    document = {
        "units": "metres",
        "frame": "head: +X subject's left, +Y up, +Z out of the face",
        "image_coordinates": "x right, y down, (0,0) = outer corner of the first pixel",
        "camera_model": "Xc = R X + t; u = fx x/z + cx, or u = scale_px_per_m x + cx",
        "orientation_map": "1..255 = strand angle in [0, pi) from +x towards +y, 0 = no hair",
        "renderer": "hairkit synth",
        "strands": len(groom.strands),
        "mean_length_m": float(groom.strands.lengths().mean()),
        "views": views,
    }
    write_text(folder / "truth.json", json.dumps(document, indent=1) + "\n")
    radius = groom.material.width / 2
    arrays: dict[str, npt.NDArray[Any]] = {
        "points": groom.strands.points,
        "offsets": groom.strands.offsets,
        "visible": seen,
        "radius": np.array([radius, radius], np.float32),
    }
    write_npz(folder / "strands.npz", arrays)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in groom.head.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (groom.head.faces + 1).tolist()]
    head = "\n".join(["# metres, +Y up, +Z out of the face", *lines, ""])
    write_text(folder / "head.obj", head)
