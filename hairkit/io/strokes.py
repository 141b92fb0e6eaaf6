"""Strokes that a user draws on a photo to show where the hair is, read from labelme's JSON."""

from __future__ import annotations

import itertools
import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float64Array, frozen_array
from hairkit.errors import FormatError, InputError
from hairkit.options import unknown_name
from hairkit.storage import read_bytes
from hairkit.types.capture import View
from hairkit.types.face import turn_points

StrokeLabel = Literal["foreground", "background", "person", "parting"]

_BOX = "rectangle"
_LEAST_POINTS = {"linestrip": 2, "line": 2, "polygon": 3, "rectangle": 2, "circle": 2, "point": 1}
_AREAS = ("polygon", "rectangle", "circle")
_MAX_BYTES = 64 * 2**20
_MAX_SAMPLES = 10_000
_ASPECT_TOLERANCE = 2
"""Pixels by which photo and drawn-on picture may differ in height for their width: rounding."""
_FAR = 30_000
"""Coordinates beyond this are drawn here: OpenCV counts them in 16 bits and a fraction."""


@dataclass(frozen=True, eq=False)
class Stroke:
    """One stroke: a line, or an area with everything in it."""

    label: StrokeLabel
    """`foreground` is hair, `background` is not, `person` is the person but not hair; `parting` is
    the line from which the hair is combed."""
    area: bool
    """True for a closed outline whose inside counts too."""
    points: Float64Array
    """(N, 2) pixels (x, y); one point is a dot."""
    radius: float | None = None
    """Of an edge brush, pixels: it paints up to the strongest edge within; None for a pen."""

    def sampled(self, step: float = 2.0) -> Float64Array:
        """Return points (M, 2) at most `step` pixels apart on the stroke; an area is closed."""
        path = np.concatenate([self.points, self.points[: int(self.area)]])
        pieces = [path[:1]]
        for start, end in itertools.pairwise(path):
            count = min(int(np.ceil(np.linalg.norm(end - start) / step)), _MAX_SAMPLES)
            pieces.append(start + (end - start) * np.linspace(0, 1, count + 1)[1:, None])
        return np.concatenate(pieces)


@dataclass(frozen=True, eq=False)
class Strokes:
    """All strokes of one photo."""

    strokes: tuple[Stroke, ...]
    """In the order drawn."""
    rectangle: Float64Array | None = None
    """(2, 2) corners (left, top), (right, bottom) in pixels of what holds all hair, or None."""
    size: tuple[int, int] | None = None
    """(width, height) of the photo they were drawn on, where the file says so."""
    corrects: bool = False
    """True for strokes that correct the automatic mask, false for those that stand alone: the flag
    `corrects` of the file."""

    def labelled(self, label: StrokeLabel) -> tuple[Stroke, ...]:
        """Return the strokes of one label, in the order drawn."""
        return tuple(stroke for stroke in self.strokes if stroke.label == label)

    @property
    def only_parting(self) -> bool:
        """True when the strokes show the parting and say nothing about where hair is."""
        labels = {stroke.label for stroke in self.strokes}
        return labels == {"parting"} and self.rectangle is None

    def scaled(self, x: float, y: float) -> Strokes:
        """Return the strokes for the photo scaled by `x` across and by `y` down."""
        factor = np.array([x, y])
        mean = float(np.sqrt(x * y))
        strokes = tuple(
            replace(
                s, points=s.points * factor, radius=None if s.radius is None else mean * s.radius
            )
            for s in self.strokes
        )
        rectangle = None if self.rectangle is None else self.rectangle * factor
        return Strokes(strokes, rectangle, None, self.corrects)

    def moved(self, right: float, down: float) -> Strokes:
        """Return the strokes so many pixels farther right and down."""
        way = np.array([right, down])
        strokes = tuple(replace(s, points=s.points + way) for s in self.strokes)
        rectangle = None if self.rectangle is None else self.rectangle + way
        return Strokes(strokes, rectangle, None, self.corrects)

    def turned(self, quarter_turns: int, width: int, height: int) -> Strokes:
        """Return the strokes for the photo of `width` x `height` after clockwise quarter turns."""

        def turn(points: Float64Array) -> Float64Array:
            return turn_points(points, quarter_turns, width, height)

        strokes = tuple(replace(s, points=turn(s.points)) for s in self.strokes)
        corners = None if self.rectangle is None else np.sort(turn(self.rectangle), axis=0)
        size = (height, width) if quarter_turns % 2 else (width, height)
        return Strokes(strokes, corners, size, self.corrects)


def read_strokes(path: str | os.PathLike[str]) -> Strokes:
    """Read labelme-shaped JSON.

    Raises
    ------
    FormatError
        The file is no JSON in labelme's shape.
    InputError
        A label or shape type is unknown, or a shape has too few points.
    """
    document = _document(Path(path))
    entries = document.get("shapes")
    if not isinstance(entries, list):
        raise FormatError(f"{path}: holds no list 'shapes', expected strokes in labelme's JSON")
    strokes, rectangle = [], None
    for index, entry in enumerate(entries):
        label, kind, points = _shape(entry, f"{path}: shape {index}")
        if label == _BOX:
            rectangle = np.stack([points.min(axis=0), points.max(axis=0)])
        else:
            radius = _radius(entry, f"{path}: shape {index}")
            strokes.append(Stroke(label, kind in _AREAS, points, radius))
    width, height = document.get("imageWidth"), document.get("imageHeight")
    size = (width, height) if isinstance(width, int) and isinstance(height, int) else None
    flags = document.get("flags")
    corrects = isinstance(flags, dict) and flags.get("corrects") is True
    return Strokes(tuple(strokes), rectangle, size, corrects)


def read_view_strokes(view: View, width: int, height: int) -> Strokes | None:
    """Return the strokes of a view in pixels of its photo at `width` x `height`; None without any.

    Raises `InputError` or `FormatError` as `read_strokes`, and when they were drawn on a photo of
    another shape.
    """
    if view.strokes_path is None:
        return None
    strokes = read_strokes(view.strokes_path)
    on_disk = view.photo_size[::-1] if view.quarter_turns % 2 else view.photo_size
    strokes = strokes.turned(view.quarter_turns, *(strokes.size or on_disk))
    drawn_on = strokes.size or view.photo_size
    difference = abs(drawn_on[0] * view.photo_size[1] - drawn_on[1] * view.photo_size[0])
    if difference > _ASPECT_TOLERANCE * max(view.photo_size):
        raise InputError(
            f"{view.strokes_path}: drawn on a photo of {drawn_on[0]} x {drawn_on[1]} pixels, "
            f"expected {view.photo_size[0]} x {view.photo_size[1]}; draw on this photo"
        )
    left, top, right, bottom = view.frame
    on_photo = strokes.scaled(view.photo_size[0] / drawn_on[0], view.photo_size[1] / drawn_on[1])
    return on_photo.moved(-left, -top).scaled(width / (right - left), height / (bottom - top))


LINE_WIDTH = 9.0
"""Pixels that drawn lines are wide in a photo 1080 px high."""


def rasterise(stroke: Stroke, width: int, height: int, thickness: float) -> BoolArray:
    """Return the pixels (height, width) under a stroke: an area, or a line `thickness` px wide."""
    canvas = np.zeros((height, width), np.uint8)
    # pixel centres lie at +0.5 here and at whole numbers in OpenCV
    points = np.rint(np.clip(stroke.points, -_FAR, _FAR) - 0.5).astype(np.int32)
    if stroke.area:
        cv2.fillPoly(canvas, [points], 1)
    else:
        cv2.polylines(canvas, [points], False, 1, max(1, round(thickness)))
    return canvas.astype(np.bool_)


def _document(path: Path) -> dict[str, Any]:
    data = read_bytes(path, _MAX_BYTES)
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: no strokes could be read ({error})") from error
    if not isinstance(document, dict):
        raise FormatError(f"{path}: holds no JSON object, expected strokes in labelme's JSON")
    return document


def _shape(entry: Any, where: str) -> tuple[Any, str, Float64Array]:
    """Return label, shape type and the outline (N, 2) of one labelme shape."""
    if not isinstance(entry, dict):
        raise FormatError(f"{where} is no JSON object")
    label, kind = str(entry.get("label")), str(entry.get("shape_type"))
    if label not in (*get_args(StrokeLabel), _BOX):
        known = (*get_args(StrokeLabel), _BOX)
        raise InputError(f"{where}: {unknown_name('label', label, known)}")
    if kind not in _LEAST_POINTS:
        raise InputError(f"{where}: {unknown_name('shape_type', kind, _LEAST_POINTS)}")
    try:
        points = frozen_array(entry["points"], np.float64, (None, 2), "points")
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{where}: points are no list of pixel pairs ({error})") from error
    if len(points) < _LEAST_POINTS[kind]:
        raise InputError(f"{where}: {len(points)} points, a {kind} needs {_LEAST_POINTS[kind]}")
    return label, kind, _outline(kind, points)


def _radius(entry: dict[str, Any], where: str) -> float | None:
    """Return the `radius` of an edge brush, an entry beside labelme's own."""
    radius = entry.get("radius")
    if radius is None:
        return None
    if isinstance(radius, bool) or not isinstance(radius, (int, float)) or not 0 < radius < _FAR:
        raise InputError(f"{where}: radius is {radius!r}, expected pixels above 0")
    return float(radius)


def _outline(kind: str, points: Float64Array) -> Float64Array:
    """Return a rectangle or circle as a polygon, any other shape unchanged."""
    if kind == "rectangle":
        (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
        return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    if kind == "circle":  # labelme: the centre and a point on the circle
        turn = np.linspace(0, 2 * np.pi, 32, endpoint=False)
        radius = np.linalg.norm(points[1] - points[0])
        return np.asarray(points[0] + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))
    return points
