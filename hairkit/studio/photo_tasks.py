"""Tasks on one photo: its outline, its strands, and what a whole run will need of it.

What is found in a photo is kept in a work folder of its own, from which previews read it, too.
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.imaging.picture_file import write_picture
from hairkit.io.capture_reader import MOST, WORKING_EDGE, read_view
from hairkit.io.capture_toml import read_capture_file
from hairkit.io.framed_photos import on_photo
from hairkit.io.photos import read_photo
from hairkit.manager import Manager
from hairkit.options import make_options
from hairkit.pipeline.recipe import Choice, Recipe, load_recipe
from hairkit.pipeline.single_photo import SeenPhoto, see_photo
from hairkit.stages import FACES, PERSONS
from hairkit.studio.framing import judge_view
from hairkit.types.capture import View
from hairkit.types.chosen import ChosenHair
from hairkit.types.face import turn_points
from hairkit.types.groom import Groom
from hairkit.types.mask import HAIR
from hairkit.types.orientation import OrientationMap

OUTLINE_EDGE = 600
"""Long edge in pixels of photos whose outlines are found while somebody draws."""
CAMERA_EDGE = 360
"""Long edge in pixels of the camera's pictures that are judged."""
OUTLINE_TOLERANCE = 0.6
"""Pixels of that photo by which an outline may be simplified."""

Tell = Callable[[dict[str, Any]], None]
STEP, LENGTH = 8, 6.0
"""Pixels of the picture between lines, and half of a line's length."""
SCALE = 2
"""The picture is so many times as large as the photo that strands were found in."""
SATURATION = 0.55
"""Of the hues: paler ones are seen on dark hair too."""
LEAST_SURE = 0.1
"""Confidence below which no line is drawn; one of 0.5 is drawn opaque."""


def look(request: dict[str, Any], tell: Tell) -> Any:
    """Return what is wrong with a small picture of the camera, `incoming`, for an `azimuth`."""
    from hairkit.studio.capture_guides import guide_at  # loads OpenGL

    image, _ = read_photo(request["incoming"], CAMERA_EDGE)
    view, guide = _find(View("camera", 0.0, image)), guide_at(float(request["azimuth"]), 0.0)
    codes = [code.value for code in judge_view(view, guide)]
    return {"feedback": codes, "yaw": None if view.face is None else view.face.yaw_deg}


def find_outline(request: dict[str, Any], tell: Tell) -> Any:
    """Return the hair of a `photo` as closed curves in its pixels, by the recipe's `segment`.

    `strokes` and `mask` are the files that belong to the photo, or None; `landmarks` those that
    were given, or None; `project` is the project's folder and `seen` that in which what is found
    is kept.
    """
    found = _see(request, strands=False)
    view, labels = found.view, found.mask.labels
    curves, _ = cv2.findContours(
        (labels == HAIR).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    simple = [cv2.approxPolyDP(curve, OUTLINE_TOLERANCE, True)[:, 0] for curve in curves]
    outline = [np.ravel(_on_file(view, c + 0.5)).tolist() for c in simple if len(c) > 2]
    face = view.face
    return {
        "outline": outline,
        "width": view.photo_size[view.quarter_turns % 2],
        "height": view.photo_size[1 - view.quarter_turns % 2],
        "share": float((labels == HAIR).mean()),
        "landmarks": None if face is None else _on_file(view, face.landmarks),
        "face": None if face is None else [round(face.presence, 2), round(face.yaw_deg, 1)],
    }


def _on_file(view: View, points: Float64Array) -> list[Any]:
    """Return pixels (N, 2) of a view as pixels of its file, of a tenth."""
    there = turn_points(view.to_photo(points), -view.quarter_turns, *view.photo_size)
    found: list[Any] = there.round(1).tolist()
    return found


def follow_strands(request: dict[str, Any], tell: Tell) -> Any:
    """Find the strands of a photo whose mask stands; previews take them from `seen`."""
    _see(request, strands=True)
    return {}


def prepare_photo(request: dict[str, Any], tell: Tell) -> Any:
    """Find in a photo of full size what a whole run needs of it, into its folder `ahead`.

    Its strands only where strokes or a mask file decide its mask: others are mended by all views.
    """
    given = request["strokes"] is not None or request["mask"] is not None
    _see(request, strands=given, edge=WORKING_EDGE, folder=request["ahead"])
    return {}


def draw_strands(request: dict[str, Any], tell: Tell) -> Any:
    """Draw the strands that `orient` finds in a `photo` into the PNG file `path`.

    `options` are those of its plugin, `tone` is brightness and contrast; the rest is as for
    `find_outline`.
    """

    seen = _see(request, strands=False)
    found = manager().call(
        "orient", oriented().plugin, request["options"], view=seen.view.toned(), mask=seen.mask
    )
    drawn, view = draw_strand_lines(found), seen.view
    factor = SCALE * max(view.width, view.height) / max(view.photo_size)
    size = round(factor * view.photo_size[0]), round(factor * view.photo_size[1])
    frame = [round(factor * edge) for edge in view.frame]
    whole = np.rot90(on_photo(drawn, frame, size), view.quarter_turns)
    write_picture(request["path"], whole, 1, durable=False)
    return {}


def describe_choices(request: dict[str, Any], tell: Tell) -> Any:
    """Return what can be chosen for the project in `folder`, and what is."""
    chosen = read_capture_file(Path(request["folder"]) / "capture.toml").chosen
    stage = oriented(chosen.settings)
    values = asdict(manager().options(stage.plugin, stage.options))
    infos = [i for i in manager().info(stage.plugin).options if i.type in (int, float)]
    groom = Path(request["folder"]) / "result" / "groom.npz"
    look = Groom.load(groom).material if groom.is_file() else None
    return {
        "plugin": stage.plugin,
        "options": [
            {
                "name": info.name, "doc": info.doc, "unit": info.unit, "low": info.low,
                "high": info.high, "usual": info.default, "value": values[info.name],
                "whole": info.type is int,
            }
            for info in infos
        ],
        "hair": asdict(chosen.hair),
        "found": None if look is None else asdict(ChosenHair.of(look)),
    }  # fmt: skip


def check_choices(request: dict[str, Any], tell: Tell) -> Any:
    """Return plugin, options and hair of a request as they are kept; `HairkitError` if wrong."""
    plugin = oriented().plugin
    options = asdict(manager().options(plugin, request["options"]))
    hair = make_options(ChosenHair, request["hair"], "hair")
    usual = asdict(manager().options(plugin, oriented().options))
    changed = {name: value for name, value in options.items() if value != usual[name]}
    return {"plugin": plugin, "options": changed, "hair": asdict(hair)}


def oriented(settings: Sequence[str] = ()) -> Choice:
    """Return the plugin that follows strands, with its options."""
    stage = recipe().with_set(settings).stage("orient")
    assert stage is not None  # of the recipe `default`
    return stage.choices[0]


@cache
def manager() -> Manager:
    """Return the plugins that are installed."""
    return Manager.loaded()


@cache
def recipe() -> Recipe:
    """Return the recipe of the studio."""
    return load_recipe("default")


def _see(
    request: dict[str, Any], *, strands: bool, edge: int = OUTLINE_EDGE, folder: str | None = None
) -> SeenPhoto:
    """Return what the recipe finds in a photo, as `read_capture` and `reconstruct` would."""
    path = Path(request["photo"])
    read = _read_small if edge == OUTLINE_EDGE else _read
    view = read(path, path.stat().st_mtime_ns, edge)
    strokes, mask = (request[key] and Path(request[key]) for key in ("strokes", "mask"))
    brightness, contrast = request["tone"]
    view = replace(
        view, strokes_path=strokes, mask_path=mask, brightness=brightness, contrast=contrast
    )
    if request["landmarks"] is not None:
        size = np.array(view.photo_size)
        scale = np.array([view.width, view.height]) / size
        view = replace(view, landmarks=np.array(request["landmarks"], np.float64) * scale)
    chosen = read_capture_file(Path(request["project"]) / "capture.toml").chosen
    used = recipe().with_set(chosen.settings)
    return see_photo(view, Path(folder or request["seen"]), used, manager(), strands=strands)


def _read(path: Path, changed: int, edge: int) -> View:
    """Return a photo; `changed` is the time of its file."""
    return read_view(path, edge)


_read_small = lru_cache(MOST)(_read)


def _find(view: View) -> View:
    """Return the view with face and person, where the recipe finds them."""
    face = recipe().ask(manager(), FACES, view=view)
    return view.with_findings(face, recipe().ask(manager(), PERSONS, view=view))


def draw_strand_lines(orientation: OrientationMap) -> UInt8Array:
    """Return (SCALE H, SCALE W, 4) RGBA: lines along strands, their hue by the angle."""
    height, width = orientation.angle.shape
    picture = np.zeros((SCALE * height, SCALE * width, 4), np.uint8)
    rows, columns = np.mgrid[STEP // 2 : height : STEP, STEP // 2 : width : STEP]
    rows, columns = rows.ravel(), columns.ravel()
    sure = orientation.confidence[rows, columns]
    for row, column, share in zip(rows, columns, sure, strict=True):
        if share < LEAST_SURE:
            continue
        angle = float(orientation.angle[row, column])
        along = LENGTH * np.array([np.cos(angle), np.sin(angle)])
        middle = SCALE * np.array([column + 0.5, row + 0.5])
        first, last = (tuple(np.rint(middle + sign * along).astype(int)) for sign in (-1, 1))
        colour = (*_colour(angle), int(255 * min(2 * share, 1)))
        cv2.line(picture, first, last, colour, SCALE, cv2.LINE_AA)
    return picture


def _colour(angle: float) -> tuple[int, int, int]:
    red, green, blue = colorsys.hsv_to_rgb(angle / np.pi % 1, SATURATION, 1.0)
    return int(255 * red), int(255 * green), int(255 * blue)
