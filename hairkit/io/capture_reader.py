"""Reading a capture: a folder of photos, with masks, strokes and landmarks where present.

Either the photos lie in the folder itself, or in its `photos/` beside `masks/`, `strokes/` and
`landmarks.json`; these are matched by name. An optional `capture.toml` says more (`capture_file`).
"""

from __future__ import annotations

import difflib
import json
import logging
import os
import re
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array, frozen_array
from hairkit.errors import FormatError, InputError
from hairkit.io.capture_toml import CaptureFile, ViewEntry, read_capture_file
from hairkit.io.photos import PHOTOS_TAKEN, PhotoHeader, read_header, read_photo
from hairkit.io.video import is_video, read_video
from hairkit.options import unknown_name
from hairkit.storage import read_bytes
from hairkit.types.capture import Capture, View, focal_from_equivalent
from hairkit.types.edits import read_edits

TURN = {
    "front": 0.0,
    "front-left": 45.0,
    "left": 90.0,
    "back-left": 135.0,
    "back": 180.0,
    "back-right": 225.0,
    "right": 270.0,
    "front-right": 315.0,
}
"""The nominal turn: view names and azimuths in degrees, in the order in which photos are taken."""

TOP_DEG = 60.0
"""Elevation of the view `top`, which may be added to the turn: from the front, looking down."""
NAMES = (*TURN, "top")
"""Names by which photos tell what they show."""
FEWEST, MOST = 1, 36
"""Numbers of photos: one is continued to where it shows nothing, and more than one every 10 degrees
add nothing."""
EDITS = "edits.json"
"""File of a capture with strokes of brushes, see `hairkit.grooming.brushes`."""
BESIDE = ("landmarks.json", "capture.toml", EDITS)
"""Files of a capture that belong to no single photo."""
WORKING_EDGE = 1440
"""Long edge in pixels that photos are scaled down to."""
_PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".heic", ".heif")
_OTHER_SUFFIXES = (".bmp", ".gif", ".dng", ".avif", ".jxl", ".cr2", ".cr3", ".nef", ".arw")
_LANDMARKS = 68
_log = logging.getLogger(__name__)
_MAX_LANDMARK_BYTES = 2**22
"""68 points of a view are some 2.5 kB of JSON."""


@dataclass(frozen=True)
class _Place:
    """One photo and the view it shows."""

    photo: Path
    name: str
    azimuth_deg: float
    elevation_deg: float = 0.0
    entry: ViewEntry | None = None
    named: bool = True
    """False when only the order of the files tells the view."""


def read_capture(path: str | os.PathLike[str], max_edge: int = WORKING_EDGE) -> Capture:
    """Return the capture in a folder, or that of a video.

    Parameters
    ----------
    path
        The capture's folder, one photo, or a video of a turn, see `read_video`.
        Photos without names of views are an even turn in file order until the stage `turn` finds
        out from where they were taken.
    max_edge
        Photos whose long edge has more pixels are scaled down to it.

    Raises
    ------
    InputError
        There are no photos or more than 36, one cannot be read, or masks, strokes or landmarks do
        not belong to the photos.
    """
    if is_video(Path(path)):
        return read_video(Path(path), max_edge)
    return read_folder(path, max_edge)


def read_folder(path: str | os.PathLike[str], max_edge: int = WORKING_EDGE) -> Capture:
    """Return the capture in a folder, or that of one photo, as `read_capture`."""
    folder = Path(path)
    if folder.is_file():
        return replace(read_files([folder], max_edge), source=folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such file, expected a photo or a folder of photos")
    photo_folder = folder / "photos" if (folder / "photos").is_dir() else folder
    settings = read_capture_file(folder / "capture.toml")
    photos = _photos(photo_folder)
    places = _places(photos, settings, photo_folder)
    headers = [read_header(place.photo) for place in places]
    masks = _beside(folder / "masks", ".png", places)
    for place, header in zip(places, headers, strict=True):
        _check_mask(masks.get(place.photo.stem), header)
    strokes = _beside(photo_folder, ".json", places) | _beside(folder / "strokes", ".json", places)
    landmarks = _landmarks(folder / "landmarks.json", places)

    def view(place: _Place) -> View:
        stem = place.photo.stem
        found = masks.get(stem), strokes.get(stem)
        return _view(place, settings, max_edge, landmarks.get(stem), *found)

    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        views = tuple(pool.map(view, places))
    return Capture(
        views,
        settings.orthographic,
        settings.head_pose,
        folder,
        max_edge,
        settings.parting,
        replace(settings.chosen, edits=read_edits(folder / EDITS)),
    )


def read_files(files: Sequence[Path], max_edge: int = WORKING_EDGE) -> Capture:
    """Return the capture of photos that lie anywhere; raises `InputError` as `read_capture`."""
    missing = next((file for file in files if not file.is_file()), None)
    if missing is not None:
        raise InputError(f"{missing}: no such photo; give photos alone, or one folder")
    if len(files) > MOST:
        raise InputError(f"{files[MOST]}: photo {MOST + 1}, expected {FEWEST} to {MOST}")
    alone = CaptureFile(files[0])
    places = _places(_check_kinds(list(files)), alone, files[0].parent)
    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        views = pool.map(lambda place: _view(place, alone, max_edge, None, None, None), places)
        return Capture(tuple(views), max_edge=max_edge)


def sample_folder() -> Path:
    """Return the folder of the capture that ships with hairkit."""
    return Path(__file__).parents[1] / "sample"


def read_view(path: Path, max_edge: int = WORKING_EDGE) -> View:
    """Return one photo as a view that knows no others, scaled down to a long edge."""
    image, header = read_photo(path, max_edge)
    focal = header.focal_px
    scaled = None if focal is None else focal * float(image.shape[1] / header.width)
    size = (header.width, header.height)
    return View(path.stem, 0.0, image, scaled, photo_path=path, photo_size=size)


def photo_files(folder: Path) -> list[Path]:
    """Return the photos in a folder in natural file order: `2.jpg` before `10.jpg`."""
    names = [entry for entry in folder.iterdir() if not entry.name.startswith(".")]
    pictures = [p for p in names if p.suffix.lower() in _PHOTO_SUFFIXES + _OTHER_SUFFIXES]
    pictures.sort(key=lambda p: [int(s) if s.isdigit() else s for s in _digits(p.name.lower())])
    return _check_kinds(pictures)


def _check_kinds(pictures: list[Path]) -> list[Path]:
    """Return the photos; `InputError` for files of other kinds."""
    for picture in pictures:
        if picture.suffix.lower() not in _PHOTO_SUFFIXES:
            raise InputError(f"{picture}: expected {PHOTOS_TAKEN}; save it as one of these")
    return pictures


def _photos(photo_folder: Path) -> list[Path]:
    """Return the photos of a turn."""
    pictures = photo_files(photo_folder)
    if not FEWEST <= len(pictures) <= MOST:
        raise InputError(
            f"{photo_folder}: {len(pictures)} photos, expected {FEWEST} to {MOST};"
            f" {len(TURN)} from all around the head, 45 degrees apart, are usual"
        )
    return pictures


def _digits(name: str) -> list[str]:
    # odd places hold the numbers, so that lists of any two names can be compared
    return re.split(r"(\d+)", name)


def _places(photos: list[Path], settings: CaptureFile, photo_folder: Path) -> list[_Place]:
    """Say which view every photo shows: by capture.toml, by the file's name, or by file order."""
    if settings.views:
        return _match_views(photos, settings, photo_folder)
    named = [_view_name(photo) for photo in photos]
    if not set(named) & set(NAMES):
        return [_unnamed(photo, index, len(photos)) for index, photo in enumerate(photos)]
    silent = [photo for photo, name in zip(photos, named, strict=True) if _says_nothing(name)]
    if silent:
        _log.warning("%s: its name tells no view, so those of the others do not count", silent[0])
        unnamed = [_unnamed(photo, index, len(photos)) for index, photo in enumerate(photos)]
        return [replace(place, name=f"view-{i + 1}") for i, place in enumerate(unnamed)]
    for photo, name in zip(photos, named, strict=True):
        if name not in NAMES:
            raise InputError(f"{photo}: {unknown_name('view', name, NAMES)}; rename the photo")
        if named.count(name) > 1:
            raise InputError(f"{photo}: there are two photos of the view {name!r}; remove one")
    by_name = dict(zip(named, photos, strict=True))
    return [_Place(by_name[name], name, *_direction(name)) for name in NAMES if name in by_name]


def _says_nothing(name: str) -> bool:
    """Return whether a photo's name, such as a camera's own, is not even a misspelt view."""
    return name not in NAMES and not difflib.get_close_matches(name, NAMES, 1)


def _direction(name: str) -> tuple[float, float]:
    """Return azimuth and elevation of a named view, degrees."""
    return (TURN[name], 0.0) if name in TURN else (0.0, TOP_DEG)


def _unnamed(photo: Path, index: int, count: int, entry: ViewEntry | None = None) -> _Place:
    """Return the place of a photo in an even turn in file order."""
    name = list(TURN)[index] if count == len(TURN) else f"view-{index + 1}"
    azimuth = 360.0 * index / count
    return _Place(photo, name, azimuth, entry=entry, named=False)


def _match_views(photos: list[Path], settings: CaptureFile, photo_folder: Path) -> list[_Place]:
    """Match the views of capture.toml with photos, by file name, by view name, or in order."""
    by_name = {key: p for p in photos for key in (_view_name(p), p.stem, p.name) if key}
    places = []
    if len(settings.views) != len(photos):
        count = len(settings.views)
        raise InputError(f"{settings.source}: {count} views for {len(photos)} photos")
    for index, entry in enumerate(settings.views):
        wanted = entry.photo or entry.name
        photo = by_name.get(wanted or "", None if entry.photo else photos[index])
        if photo is None:
            raise InputError(
                f"{photo_folder / str(wanted)}: no such photo; {settings.source} names it"
            )
        places.append(_said_place(photo, index, entry, settings))
    for thing in ([place.photo.name for place in places], [place.name for place in places]):
        twice = next((item for item in thing if thing.count(item) > 1), None)
        if twice is not None:
            raise InputError(f"{settings.source}: {twice!r} is named for two views")
    return places


def _said_place(photo: Path, index: int, entry: ViewEntry, settings: CaptureFile) -> _Place:
    """Return the place of a photo as a `[[views]]` table says it."""
    usual = _unnamed(photo, index, len(settings.views), entry)
    own = _view_name(photo) if _view_name(photo) in NAMES else None
    if not (entry.name or own) and entry.azimuth_deg is None:
        return replace(usual, elevation_deg=entry.elevation_deg or 0.0)
    name = entry.name or own or usual.name
    if entry.azimuth_deg is None and name not in NAMES:
        reason = unknown_name("view", name, NAMES)
        raise InputError(f"{settings.source}: {reason}; or give its azimuth_deg")
    azimuth, elevation = _direction(name) if name in NAMES else (0.0, 0.0)
    azimuth = azimuth if entry.azimuth_deg is None else entry.azimuth_deg
    elevation = elevation if entry.elevation_deg is None else entry.elevation_deg
    return _Place(photo, name, azimuth, elevation, entry)


def _view_name(photo: Path) -> str:
    """Return the view that a photo's name tells: `0_Front.jpg` shows `front`."""
    return re.sub(r"^\d+[-_. ]*", "", photo.stem).lower().replace("_", "-").replace(" ", "-")


def _beside(folder: Path, suffix: str, places: list[_Place]) -> dict[str, Path]:
    """Return the files of a folder by the stem of the photo that they belong to."""
    found: dict[str, Path] = {}
    by_name = {key: p.photo.stem for p in places for key in (p.name, p.photo.stem)}
    for file in sorted(folder.glob(f"*{suffix}")):
        stem = by_name.get(file.stem, by_name.get(_view_name(file)))
        if stem is None and folder.name in ("masks", "strokes"):
            stems = [place.photo.stem for place in places]
            raise InputError(f"{file}: {unknown_name('photo', file.stem, stems)}; rename the file")
        if stem is not None:
            found[stem] = file
    return found


def _check_mask(mask: Path | None, photo: PhotoHeader) -> None:
    if mask is None:
        return
    header = read_header(mask)
    if (header.width, header.height) != (photo.width, photo.height):
        raise InputError(
            f"{mask}: {header.width} x {header.height} pixels, its photo has"
            f" {photo.width} x {photo.height}; draw the mask on the photo"
        )


def _landmarks(path: Path, places: list[_Place]) -> dict[str, Float64Array]:
    """Return 68 points (68, 2) in pixels of the photo on disk, by the photo's stem."""
    if not os.path.lexists(path):
        return {}
    data = read_bytes(path, _MAX_LANDMARK_BYTES)
    try:
        views = json.loads(data)["views"]
        items: Iterable[tuple[str, Any]] = views.items()
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise FormatError(
            f'{path}: expected JSON {{"views": {{NAME: points}}}} ({error})'
        ) from error
    by_name = {key: p.photo.stem for p in places for key in (p.name, p.photo.stem)}
    found = {}
    for name, points in items:
        if name not in by_name:
            stems = [place.photo.stem for place in places]
            raise InputError(f"{path}: {unknown_name('view', name, stems)}")
        found[by_name[name]] = _points(points, f"{path}: {name}")
    return found


def _points(points: Any, where: str) -> Float64Array:
    try:
        count = len(points)
        if count != _LANDMARKS:
            raise InputError(f"{where}: {count} landmarks, expected the {_LANDMARKS} iBUG points")
        return frozen_array(points, np.float64, (_LANDMARKS, 2), f"{where}: landmarks")
    except (TypeError, ValueError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where}: landmarks are no list of pixel pairs ({error})") from error


def _view(
    place: _Place,
    settings: CaptureFile,
    max_edge: int,
    landmarks: Float64Array | None,
    mask: Path | None,
    strokes: Path | None,
) -> View:
    """Read one photo and bring everything that belongs to it to working size."""
    image, header = read_photo(place.photo, max_edge)
    height, width = image.shape[:2]
    scale = np.array([width / header.width, height / header.height])
    entry = place.entry or ViewEntry()
    focal = _focal(entry, settings, header)
    return View(
        place.name,
        place.azimuth_deg,
        image,
        focal_px=None if focal is None else focal * float(scale[0]),
        landmarks=None if landmarks is None else landmarks * scale,
        mask_path=mask,
        strokes_path=strokes,
        photo_path=place.photo,
        photo_size=(header.width, header.height),
        elevation_deg=place.elevation_deg,
        named=place.named,
        brightness=entry.brightness,
        contrast=entry.contrast,
    )


def _focal(entry: ViewEntry, settings: CaptureFile, header: PhotoHeader) -> float | None:
    """Return pixels of the photo on disk, as the view says, or else the capture, or else EXIF."""
    for said in (entry.focal, settings.focal):
        if said.px is not None:
            return said.px
        if said.mm_equivalent is not None:
            return focal_from_equivalent(said.mm_equivalent, header.width, header.height)
    return header.focal_px
