"""A capture: the photos taken around a head and what is known about each."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from hairkit.arrays import Float64Array, UInt8Array, frozen_array
from hairkit.errors import DataError
from hairkit.types.chosen import Chosen
from hairkit.types.face import Face, turn_points
from hairkit.types.parting import Parting
from hairkit.types.person import Person
from hairkit.types.preview import PHOTO_HEIGHT, Previewed, row
from hairkit.types.turnaround import Turnaround

FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)
"""Diagonal of the 35 mm film frame, to which equivalent focal lengths refer (CIPA DCG-001)."""


@dataclass(frozen=True, eq=False)
class View:
    """One photo of the turn, upright, at working size."""

    name: str
    """`front`, `front-left`, `left`, `back-left`, `back`, `back-right`, `right`, `front-right`,
    or as `capture.toml` says."""
    azimuth_deg: float
    """Nominal azimuth: 0 in front, positive towards the subject's left."""
    image: UInt8Array
    """(H, W, 3) RGB."""
    focal_px: float | None = None
    """Focal length in pixels of `image`, from EXIF or capture.toml; None when unknown."""
    landmarks: Float64Array | None = None
    """(68, 2) iBUG points in pixels of `image`, NaN-free, or None."""
    mask_path: Path | None = None
    strokes_path: Path | None = None
    photo_path: Path | None = None
    photo_size: tuple[int, int] = (0, 0)
    """(width, height) of the photo on disk, upright: the pixels of masks and strokes."""
    cropped: tuple[int, int, int, int] | None = None
    """Left, top, right and bottom edge of what `image` shows of that photo, in its pixels; None
    where it shows all."""
    head: tuple[float, float] | None = None
    """(x, y) the middle of the head in that photo, its pixels; None where nobody looked."""
    elevation_deg: float = 0.0
    """Nominal elevation: 0 level with the head, positive from above."""
    named: bool = True
    """False when neither the photo's name nor `capture.toml` says which view it shows."""
    quarter_turns: int = 0
    """Clockwise quarter turns from the photo on disk, after EXIF rotation, to `image`."""
    face: Face | None = None
    """What a detector found, in pixels of `image`; None before the stage `landmarks`."""
    person: Person | None = None
    """Where the person is, in pixels of `image`; None where no model was run."""

    brightness: float = 1.0
    contrast: float = 1.0
    """How the photo is shown to the stage `orient`: see `toned`."""

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "image", frozen_array(self.image, np.uint8, (None, None, 3), f"photo {self.name}")
        )
        if self.photo_size == (0, 0):
            object.__setattr__(self, "photo_size", (self.image.shape[1], self.image.shape[0]))
        if self.landmarks is not None:
            object.__setattr__(
                self,
                "landmarks",
                frozen_array(self.landmarks, np.float64, (68, 2), f"landmarks of {self.name}"),
            )

    def __repr__(self) -> str:
        return f"View({self.name!r}, {self.width} x {self.height} px)"

    @property
    def width(self) -> int:
        """Width of `image` in pixels."""
        return int(self.image.shape[1])

    @property
    def height(self) -> int:
        """Height of `image` in pixels."""
        return int(self.image.shape[0])

    @property
    def frame(self) -> tuple[int, int, int, int]:
        """Left, top, right and bottom edge of what `image` shows of the photo, its pixels."""
        return self.cropped or (0, 0, *self.photo_size)

    @property
    def scale(self) -> float:
        """Pixels of the photo on disk along a pixel of `image`."""
        return (self.frame[2] - self.frame[0]) / self.width

    def focal_or(self, equivalent: float) -> float:
        """Return the focal length in pixels, if unknown that of a lens (35 mm equivalent, mm)."""
        return self.focal_px or focal_from_equivalent(equivalent, *self.photo_size) / self.scale

    @property
    def centre(self) -> Float64Array:
        """(2,) the middle of the photo, where the lens's axis meets it, in pixels of `image`."""
        return self.from_photo(np.array(self.photo_size) / 2)

    @property
    def aim(self) -> Float64Array:
        """(2,) the middle of the head in pixels of `image`, that of the picture where unknown."""
        if self.head is None:
            return np.array([self.width / 2, self.height / 2])
        return self.from_photo(np.array(self.head))

    def from_photo(self, points: Float64Array) -> Float64Array:
        """Return pixels (..., 2) of the upright photo on disk as pixels of `image`."""
        left, top, right, bottom = self.frame
        return (points - [left, top]) * [self.width / (right - left), self.height / (bottom - top)]

    def to_photo(self, points: Float64Array) -> Float64Array:
        """Return pixels (..., 2) of `image` as pixels of the upright photo on disk."""
        left, top, right, bottom = self.frame
        return points * [(right - left) / self.width, (bottom - top) / self.height] + [left, top]

    @property
    def photo_name(self) -> str:
        """Return how a user calls the photo: its file's name."""
        return self.photo_path.name if self.photo_path is not None else self.name

    def with_findings(self, face: Face, person: Person) -> Self:
        """Return the view with what was found in it; landmarks that were given are kept."""
        landmarks = self.landmarks
        if landmarks is None and face.sure:
            landmarks = face.landmarks
        return replace(
            self,
            landmarks=landmarks,
            face=face if face.presence > 0 else None,
            person=person if person.alpha.size else None,
        )

    def toned(self) -> Self:
        """Return the view with its brightness and contrast applied, as CSS filters apply them."""
        if (self.brightness, self.contrast) == (1.0, 1.0):
            return self
        levels = np.arange(256) / 255 * self.brightness
        levels = (np.clip(levels, 0, 1) - 1 / 2) * self.contrast + 1 / 2
        table = np.rint(255 * np.clip(levels, 0, 1)).astype(np.uint8)
        return replace(self.plain(), image=table[self.image])

    def plain(self) -> Self:
        """Return the view as all other stages see it."""
        return replace(self, brightness=1.0, contrast=1.0)

    def alone(self) -> Self:
        """Return the view without its place in the turn, as stages of single photos see it."""
        return replace(self, azimuth_deg=0.0, elevation_deg=0.0, named=False)

    def turned(self, quarter_turns: int) -> Self:
        """Return the view after clockwise quarter turns of its photo."""
        turns = quarter_turns % 4
        if turns == 0:
            return self
        width, height = self.width, self.height
        given, head = self.landmarks, self.head
        if head is not None:
            x, y = turn_points(np.array([head]), turns, *self.photo_size)[0].tolist()
            head = (x, y)
        return replace(
            self,
            image=np.rot90(self.image, -turns),
            landmarks=None if given is None else turn_points(given, turns, width, height),
            photo_size=self.photo_size[::-1] if turns % 2 else self.photo_size,
            cropped=self.cropped and _turn_frame(self.cropped, turns, self.photo_size),
            head=head,
            quarter_turns=(self.quarter_turns + turns) % 4,
            face=None if self.face is None else self.face.turned(turns, width, height),
            person=None if self.person is None else self.person.turned(turns),
        )


@dataclass(frozen=True, eq=False)
class Capture(Previewed):
    """The views of one head, in the order of the turn."""

    views: tuple[View, ...]
    orthographic: bool = False
    """True when capture.toml says that the pictures are orthographic."""
    head_pose: Float64Array | None = None
    """(4, 4) similarity that places the head by hand, `scene_from_head`, metres, or None."""
    source: Path | None = None
    """The folder or video that the photos were read from; None when they were made in memory."""
    max_edge: int | None = None
    """Long edge in pixels that larger photos were scaled down to."""
    parting: Parting | None = None
    """How the crown is combed, where the user says it; None leaves it to the photos."""
    chosen: Chosen = field(default_factory=Chosen)
    """What the user chooses instead of what is measured and fitted."""
    asked: str | None = None
    """What the stage `capture` was asked for: an absolute path, or a name that its plugin knows;
    None when no stage was."""

    def __post_init__(self) -> None:
        if not self.views:
            raise DataError("a capture needs at least one view")
        if self.head_pose is not None:
            pose = frozen_array(self.head_pose, np.float64, (4, 4), "head_pose")
            object.__setattr__(self, "head_pose", _similarity(pose))

    def __repr__(self) -> str:
        sizes = " or ".join(sorted({f"{view.width} x {view.height}" for view in self.views}))
        return f"Capture({len(self.views)} views of {sizes} px)"

    def plain(self) -> Self:
        """Return the capture without choices, as stages see it: none of them reads any."""
        views = tuple(view.plain() for view in self.views)
        return replace(self, views=views, chosen=Chosen(), asked=None)

    def arranged(self, turn: Turnaround) -> Self:
        """Return the views in the order, with the names and from where the turn says."""
        views = tuple(
            replace(
                self.views[i],
                name=turn.names[i],
                azimuth_deg=float(turn.azimuth_deg[i]),
                elevation_deg=float(turn.elevation_deg[i]),
                named=True,
            )
            for i in turn.order
        )
        return replace(self, views=views)

    def preview(self) -> UInt8Array | None:
        """Return the photos side by side, (H, W, 3) uint8 RGB."""
        return row([view.image for view in self.views], PHOTO_HEIGHT)


def focal_from_equivalent(focal_mm: float, width: int, height: int) -> float:
    """Return the focal length in pixels of a 35 mm equivalent one: equal diagonal angle of view.

    >>> round(focal_from_equivalent(47.83, 810, 1080))
    1492
    """
    return focal_mm / FILM_DIAGONAL_MM * math.hypot(width, height)


def _turn_frame(
    frame: tuple[int, int, int, int], quarter_turns: int, size: tuple[int, int]
) -> tuple[int, int, int, int]:
    """Return a part of a photo of `size` (width, height) after clockwise quarter turns of it."""
    corners = np.reshape(frame, (2, 2)).astype(np.float64)
    (left, top), (right, bottom) = np.sort(turn_points(corners, quarter_turns, *size), axis=0)
    return int(left), int(top), int(right), int(bottom)


def _similarity(matrix: Float64Array) -> Float64Array:
    """Return a rotation, one scale and a shift as it is; `DataError` for anything else."""
    square = matrix[:3, :3] @ matrix[:3, :3].T
    scale = float(np.trace(square)) / 3
    alike = np.allclose(square, scale * np.eye(3), atol=1e-6 * scale, rtol=0)
    upright = np.linalg.det(matrix[:3, :3]) > 0 and np.array_equal(matrix[3], [0, 0, 0, 1])
    if not (alike and upright):
        raise DataError("head_pose is no similarity, expected rotation, one scale and a shift")
    return matrix
