"""`capture.toml`: camera and head settings of a capture. Every entry is optional.

orthographic = false             # true: no perspective
focal_mm_equivalent = 47.8       # 35 mm equivalent, by the diagonal; or focal_px, of the photo
parting = "left"                 # right, middle, none, back; or a line of x and z of the head frame
                                 # in metres: [[0.03, 0.09], [0.03, -0.06]]
[head]                           # the head placed by hand, for the scene plugin `manual`
scale = 1.05
rotation_deg = [0, 5, 0]         # about x, then y, then z
translation_m = [0, 0.01, 0]
[[views]]                        # one for each photo, in the order of the files
name = "front"
photo = "IMG_0412.jpg"
azimuth_deg = 0                  # towards the subject's left
elevation_deg = 0                # from above
focal_px = 1492
brightness = 1.2                 # of the photo as the stage `orient` sees it; contrast likewise
contrast = 1.1
[fitted_head]                    # moves the head that was fitted; entries as in [head]
rotation_deg = [0, 3, 0]
[hair]                           # chosen instead of measured, each
root_colour = "#3a2418"          # sRGB; tip_colour likewise
width_mm = 0.07
curl_radius_mm = 6               # and curl_pitch_mm
[options]                        # of plugins, where neither recipe nor --set says something else
structure_tensor.window_sigma = 16.0
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.errors import DataError, InputError, OptionError
from hairkit.options import make_options, option, unknown_name
from hairkit.storage import read_text, read_toml, toml_value, write_text
from hairkit.types.chosen import Chosen, ChosenHair
from hairkit.types.parting import Parting

_TABLES = ("parting", "head", "views", "fitted_head", "hair", "options")
"""Entries that are more than one value."""
_MAX_BYTES = 2**20


@dataclass(frozen=True)
class Focal:
    """A focal length in one of its two units, or neither."""

    px: float | None = None
    mm_equivalent: float | None = None


@dataclass(frozen=True)
class ViewEntry:
    """One `[[views]]` table."""

    name: str | None = option(None, doc="Name of the view.")
    photo: str | None = option(None, doc="File name of its photo.")
    azimuth_deg: float | None = option(None, low=-360, high=360, doc="Azimuth.", unit="deg")
    elevation_deg: float | None = option(None, low=-90, high=90, doc="Elevation.", unit="deg")
    focal_px: float | None = option(None, low=1, high=1e6, doc="Focal length.", unit="px")
    focal_mm_equivalent: float | None = option(None, low=8, high=2000, doc="Same.", unit="mm")
    brightness: float = option(1.0, low=0.1, high=10, doc="Factor before strands are followed.")
    contrast: float = option(1.0, low=0.1, high=10, doc="The same about middle grey.")

    @property
    def focal(self) -> Focal:
        """The view's focal length."""
        return Focal(self.focal_px, self.focal_mm_equivalent)


@dataclass(frozen=True)
class HeadEntry:
    """The `[head]` table."""

    scale: float = option(1.0, low=0.01, high=100, doc="Size of the head over the model's.")
    rotation_deg: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0), low=-360, high=360, doc="Rotation about x, then y, then z.", unit="deg"
    )
    translation_m: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0), low=-10, high=10, doc="Place of the model's origin.", unit="m"
    )


@dataclass(frozen=True)
class _Top:
    orthographic: bool = option(False, doc="True when the photos have no perspective.")
    focal_px: float | None = option(None, low=1, high=1e6, doc="Focal length.", unit="px")
    focal_mm_equivalent: float | None = option(None, low=8, high=2000, doc="Same.", unit="mm")


@dataclass(frozen=True, eq=False)
class CaptureFile:
    """Content of a `capture.toml`; the defaults apply if there is no file."""

    source: Path
    orthographic: bool = False
    focal: Focal = Focal()
    head_pose: Float64Array | None = None
    """(4, 4) similarity, scene_from_head."""
    views: tuple[ViewEntry, ...] = ()
    parting: Parting | None = None
    """How the crown is combed, or None."""
    chosen: Chosen = field(default_factory=Chosen)
    """What is chosen instead of measured."""


def read_capture_file(path: Path) -> CaptureFile:
    """Read a `capture.toml`; a missing one says nothing. Raises `InputError` or `OptionError`."""
    if not os.path.lexists(path):
        return CaptureFile(path)
    document = read_toml(path, _MAX_BYTES)
    keys = [field.name for field in fields(_Top)] + list(_TABLES)
    for key in document:
        if key not in keys:
            raise InputError(f"{path}: {unknown_name('entry', key, keys)}")
    top = make_options(_Top, {k: v for k, v in document.items() if k not in _TABLES}, str(path))
    return CaptureFile(
        path,
        top.orthographic,
        Focal(top.focal_px, top.focal_mm_equivalent),
        _head_pose(document["head"], f"{path}: [head]") if "head" in document else None,
        _views(document.get("views", []), path),
        _parting(document["parting"], path) if "parting" in document else None,
        _chosen(document, path),
    )


def head_values(entry: HeadEntry) -> dict[str, object]:
    """Return the entries of a table that places a head."""
    return {field.name: getattr(entry, field.name) for field in fields(entry)}


def write_table(path: Path, name: str, values: Mapping[str, object]) -> None:
    """Replace the table `[name]` of a `capture.toml`; all else in it stays.

    Values of None are left out; a table without any goes, and so does an empty file.
    """
    said = [f"{key} = {toml_value(value)}" for key, value in values.items() if value is not None]
    _write_lines(path, _lines_without(path, f"[{name}]"), [f"[{name}]", *said] if said else [])


def write_view_entries(path: Path, entries: Sequence[ViewEntry]) -> None:
    """Replace the `[[views]]` tables of a `capture.toml`; all else in it stays.

    Without entries the tables go, and the file too if nothing else is in it.
    """
    kept = _lines_without(path, "[[views]]")
    tables: list[str] = []
    for entry in entries:
        said = [(f.name, getattr(entry, f.name), f.default) for f in fields(entry)]
        tables += [*([""] if tables else []), "[[views]]"]
        tables += [f"{name} = {toml_value(value)}" for name, value, usual in said if value != usual]
    _write_lines(path, kept, tables)


def _write_lines(path: Path, kept: list[str], added: list[str]) -> None:
    """Write kept and added lines with an empty one between them; without any the file goes."""
    lines = [*kept, *([""] if kept and added else []), *added]
    if lines:
        write_text(path, "\n".join(lines) + "\n")
    else:
        path.unlink(missing_ok=True)


def _lines_without(path: Path, header: str) -> list[str]:
    """Return the lines of a file, none where there is no file, without the tables of a header.

    `[options.gabor]` goes with `[options]`.
    """
    text = read_text(path, _MAX_BYTES) if path.exists() else ""
    kept, inside = [], False
    for line in text.splitlines():
        if line.strip().startswith("["):
            found = line.split("#")[0].strip()
            inside = found == header or found.startswith(f"{header[:-1]}.")
        if not inside:
            kept.append(line)
    while kept and not kept[-1].strip():
        kept.pop()
    return kept


def head_entry(pose: Float64Array) -> HeadEntry:
    """Return the table that places a head, of a similarity (4, 4), to a tenth of a micrometre."""
    scale = float(np.cbrt(np.linalg.det(pose[:3, :3])))
    turn = pose[:3, :3] / scale
    angles = (
        math.atan2(turn[2, 1], turn[2, 2]),
        -math.asin(min(max(float(turn[2, 0]), -1.0), 1.0)),
        math.atan2(turn[1, 0], turn[0, 0]),
    )
    x, y, z = (round(math.degrees(angle), 6) for angle in angles)
    right, up, front = (round(float(value), 7) for value in pose[:3, 3])
    return HeadEntry(round(scale, 7), (x, y, z), (right, up, front))


def _parting(said: Any, path: Path) -> Parting:
    """Return the parting of a word or of a list of points x, z in metres."""
    try:
        if isinstance(said, str):
            return Parting.named(said, path.name)
        return Parting(np.asarray(said, np.float64), source=path.name)
    except (InputError, DataError, TypeError, ValueError) as error:
        raise InputError(f"{path}: parting: {error}") from error


def _views(tables: Any, path: Path) -> tuple[ViewEntry, ...]:
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
        raise InputError(f"{path}: views are no tables; begin each with [[views]]")
    return tuple(
        make_options(ViewEntry, table, f"{path}: view {index}")
        for index, table in enumerate(tables)
    )


def _head_pose(table: Any, where: str) -> Float64Array:
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is no table")
    return head_pose(make_options(HeadEntry, table, where))


def head_pose(entry: HeadEntry) -> Float64Array:
    """Return the similarity (4, 4) of a table that places a head; `head_entry` is its inverse."""
    pose = np.eye(4)
    for axis, angle_deg in enumerate(entry.rotation_deg):
        turn, (i, j) = np.eye(3), ((1, 2), (2, 0), (0, 1))[axis]
        angle = math.radians(angle_deg)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[i, j], turn[j, i] = -math.sin(angle), math.sin(angle)
        pose[:3, :3] = turn @ pose[:3, :3]
    pose[:3, :3] *= entry.scale
    pose[:3, 3] = entry.translation_m
    return pose


def _chosen(document: Mapping[str, Any], path: Path) -> Chosen:
    """Return what the tables say that choose something instead of measuring it."""
    tables = {name: document.get(name, {}) for name in ("fitted_head", "hair", "options")}
    for name, table in tables.items():
        if not isinstance(table, Mapping):
            raise InputError(f"{path}: [{name}] is no table")
    where = f"{path}: [fitted_head]"
    head = _head_pose(tables["fitted_head"], where) if tables["fitted_head"] else None
    try:
        hair = make_options(ChosenHair, tables["hair"], f"{path}: [hair]")
    except OptionError:
        raise  # it names the place already
    except InputError as error:
        raise InputError(f"{path}: [hair]: {error}") from error
    return Chosen(hair, head, _settings(tables["options"], path))


def _settings(table: Mapping[str, Any], path: Path) -> tuple[str, ...]:
    """Return `plugin.option=value` texts of a table of plugins."""
    texts = []
    for plugin, options in table.items():
        if not isinstance(options, Mapping):
            raise InputError(f"{path}: [options]: expected plugin.option = value, not {plugin!r}")
        for name, value in options.items():
            said = ",".join(map(str, value)) if isinstance(value, list) else value
            texts.append(f"{plugin}.{name}={said}")
    return tuple(texts)
