"""What the studio's processes do: decode photos, find masks, build grooms, write files.

Each task takes a request's values and returns what goes back as JSON. They run in a process of
their own (`task_child`), so that a picture that crashes a decoder ends one task and not the server.
"""

from __future__ import annotations

import json
import logging
import zipfile
from collections.abc import Callable
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.api import export_for
from hairkit.arrays import Float32Array, Float64Array, Int32Array, UInt8Array
from hairkit.errors import HairkitError, InputError
from hairkit.grooming import brushes
from hairkit.grooming.brushed_hair import Hair
from hairkit.grooming.brushes import brush_hair
from hairkit.grooming.densify import roots_between
from hairkit.grooming.engine_files import ENGINES
from hairkit.head_model.scalp import roots_at
from hairkit.imaging.picture_file import encode_picture, write_picture
from hairkit.io.capture_reader import EDITS
from hairkit.io.capture_toml import head_entry, head_pose, read_capture_file
from hairkit.io.photos import MAX_BYTES, read_header, read_photo
from hairkit.io.video import read_video
from hairkit.options import make_options
from hairkit.pipeline.draft import draft
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.pipeline.take_capture import take_with_choices
from hairkit.pipeline.work_folder import LastRun, digest_of, stage_file
from hairkit.stages import EDITED, UNEDITED
from hairkit.storage import read_bytes, write_bytes
from hairkit.studio.clean_photo import clean_photo
from hairkit.studio.feedback import judge_photo
from hairkit.studio.photo_tasks import (
    OUTLINE_EDGE,
    Tell,
    check_choices,
    describe_choices,
    draw_strands,
    find_outline,
    follow_strands,
    look,
    manager,
    prepare_photo,
)
from hairkit.types.edits import Edits, read_edits
from hairkit.types.groom import Groom
from hairkit.types.head import Roots

SMALL_EDGE, LARGE_EDGE = 360, 1440
"""Long edges in pixels of the pictures that pages show."""
PICTURE_QUALITY, KEPT_QUALITY = 85, 97
"""JPEG qualities of pictures for pages, and of photos that have to be encoded again."""
DRAFT_SETTINGS = ("visual_hull.voxel_size=0.006",)
"""Options of a quick groom: cells of 6 mm, not 3.5. With 5 mm, or with whole photos instead of
those of `OUTLINE_EDGE`, F 4/40 of the sample's preview (59) changes by a point, and it takes
longer."""
_FOR = "for-"
"""Before the name of an engine among the formats."""
VIDEO_EDGE = 1440
"""Long edge in pixels of a video's frames."""


class StoppedError(HairkitError):
    """A build was cancelled."""


def accept_photo(request: dict[str, Any], tell: Tell) -> Any:
    """Check an upload, clean it, and write it with the pictures for pages.

    Takes `incoming`, the upload, and returns `suffix`, `feedback` and the size of the cleaned
    photo, which takes the upload's place; `small` and `large` are files for the pages' pictures.
    """
    incoming = Path(request["incoming"])
    header = read_header(incoming)
    if header.kind == "HEIC":
        image, header = read_photo(incoming)
        encoded = encode_picture(image, ".jpg", KEPT_QUALITY)
        data, suffix = clean_photo(encoded, header.exif), ".jpg"
    else:
        data = clean_photo(read_bytes(incoming, MAX_BYTES), header.exif)
        suffix = ".png" if header.kind == "PNG" else ".jpg"
    write_bytes(incoming, data)
    image, header = read_photo(incoming, LARGE_EDGE)
    _write_pictures(image, request)
    codes = [code.value for code in judge_photo(image)]
    return {"suffix": suffix, "feedback": codes, "width": header.width, "height": header.height}


def draw_pictures(request: dict[str, Any], tell: Tell) -> Any:
    """Write the pictures of a `photo` for pages, as `accept_photo` does."""
    image, header = read_photo(request["photo"], LARGE_EDGE)
    _write_pictures(image, request)
    return {"width": header.width, "height": header.height}


def pick_frames(request: dict[str, Any], tell: Tell) -> Any:
    """Write the best frames of a `video` as PNG files into a `folder`; returns their paths."""
    capture = read_video(Path(request["video"]), VIDEO_EDGE)
    paths = []
    for index, view in enumerate(capture.views):
        path = Path(request["folder"]) / f"{request['name']}-{index:02d}.png"
        write_picture(path, view.image, 1)
        paths.append(str(path))
    return {"frames": paths}


def build_groom(request: dict[str, Any], tell: Tell) -> Any:
    """Reconstruct the project in `folder` into its `result`, as `hairkit reconstruct` does."""
    out = Path(request["result"])
    capture, chosen = take_with_choices(request["folder"], "default", manager())
    told = _Told(tell, Path(request["stop"]))
    groom = reconstruct(capture, out, chosen, manager(), guides=request["guides"], progress=told)
    _hair_packet(groom, request)
    health, hair = read_record(out / RECORD).health, groom.strands.select(~groom.strands.planted)
    return {
        "strands": len(hair),
        "length_cm": round(100 * float(hair.lengths().mean()), 1),
        "health": [[figure.light, figure.line()] for figure in health],
        "pose": _matrix(capture.chosen.head).tolist(),
        "astray": _edited(Path(request["folder"]), capture.chosen.edits)[1],
    }


def draft_groom(request: dict[str, Any], tell: Tell) -> Any:
    """Write the `packet` of a quick groom after strokes on the photos `touched`.

    These are their names, each with the folder of what is found in it; `anew` is as of `draft`.
    """

    capture, coarse = take_with_choices(
        request["folder"], "default", manager(), DRAFT_SETTINGS, OUTLINE_EDGE
    )
    work = Path(request["folder"]) / "result" / "work"
    drawn = {name: Path(folder) for name, folder in request["touched"].items()}
    told = _Told(tell, Path(request["stop"]))
    guides, anew = request["guides"], request["anew"]
    groom = draft(capture, work, drawn, coarse, manager(), guides, told, anew=anew)
    _hair_packet(groom, request)
    return {}


def edit_groom(request: dict[str, Any], tell: Tell) -> Any:
    """Write the `packet` of the last run's groom with the strokes that lie over it now; returns a
    line about each that went `astray`, as a build does."""
    folder = Path(request["folder"])
    groom, astray = _edited(folder, read_edits(folder / EDITS))
    _hair_packet(groom, request)
    return {"astray": astray}


def show_stroke(request: dict[str, Any], tell: Tell) -> Any:
    """Return the page's guides that a `stroke` under way changes: numbers, points (N, 16, 3), and
    packed colours (N, 16)."""
    from hairkit.rendering.hair import packed_colours

    folder = Path(request["folder"])
    before = _page_hair(folder, _made(folder), json.dumps(read_edits(folder / EDITS).values()))
    hair = before.copy()
    brush_hair(hair, Edits.of([request["stroke"]], "stroke").strokes[0])
    points, colours = hair.over(before)
    changed = (points != before.points) | (colours != before.colours)
    which = np.flatnonzero(changed.any(axis=(1, 2)))
    return {
        "guides": which.tolist(),
        "points": np.round(points[which], 5).tolist(),
        "tints": packed_colours(colours[which]).tolist(),
    }


@lru_cache(maxsize=1)
def _page_hair(folder: Path, made: int, edits: str) -> Hair:
    """Return the page's guides after strokes as JSON."""
    from hairkit.studio.hair_packet import page_guides

    return Hair.of(page_guides(_edited(folder, Edits.of(json.loads(edits), EDITS))[0]))


def _edited(folder: Path, edits: Edits) -> tuple[Groom, list[str]]:
    """Return the groom of the last run after strokes, and a line about each that fits no more."""
    groom, log = _unedited(folder, _made(folder)), logging.getLogger(brushes.__name__)
    told: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        told.append(record.getMessage())
        return True

    log.addFilter(keep)
    try:
        if edits:
            groom = load_recipe("default").ask(manager(), EDITED, groom=groom, edits=edits)
    finally:
        log.removeFilter(keep)
    return groom, told


@lru_cache(maxsize=1)
def _unedited(folder: Path, made: int) -> Groom:
    last = LastRun(folder / "result" / "work")
    if not last.has(UNEDITED):
        raise InputError("strokes are kept, and show once the hair is made again")
    return last.latest(UNEDITED)


def _made(folder: Path) -> int:
    """Return when the last run made its groom, so that what is kept of it is known to be old."""
    file = stage_file(folder / "result" / "work", UNEDITED)
    return file.stat().st_mtime_ns if file.is_file() else 0


def export_groom(request: dict[str, Any], tell: Tell) -> Any:
    """Write the `groom` to `path` in a `format` of `list_formats`: a file, or an engine's."""
    groom, path = Groom.load(request["groom"]), Path(request["path"])
    plugin, _, engine = request["format"].partition(_FOR)
    if not engine:
        manager().call("export_groom", plugin, groom=groom, path=path)
        return {}
    with zipfile.ZipFile(path, "w") as archive:
        for file in export_for(groom, engine, path.with_suffix(""), manager=manager()):
            info = zipfile.ZipInfo(f"{engine}/{file.name}")  # without the time
            archive.writestr(info, read_bytes(file), zipfile.ZIP_DEFLATED, compresslevel=1)
    return {}


def list_formats(request: dict[str, Any], tell: Tell) -> Any:
    """Return name and file suffix of all that a groom can be written as, engines first."""
    found = [(name, manager().info(name).format) for name in manager().names("export_groom")]
    plugins = [[name, format_.suffixes[0]] for name, format_ in found if format_ and format_.there]
    return {"formats": [*([_FOR + engine, f"-{engine}.zip"] for engine in ENGINES), *plugins]}


def draw_guides(request: dict[str, Any], tell: Tell) -> Any:
    """Return the outline of the template head for each view of a turn of `count` photos."""
    from hairkit.studio.capture_guides import guides_for  # loads OpenGL

    return {"guides": guides_for(request["count"], request["above"])}


def describe_pose(request: dict[str, Any], tell: Tell) -> Any:
    """Return the head as every camera sees it, and how well they fit.

    `folder` is the project, `built` the pose (4, 4) of the head with which its result was made.
    With a `nudge` the head is moved first; `entry` tells the new pose.
    """
    from hairkit.studio.pose import Nudge, Placed, describe

    folder, built = Path(request["folder"]), _matrix(request["built"])
    pose = _matrix(read_capture_file(folder / "capture.toml").chosen.head)
    placed = Placed.read(folder / "result", built, pose)
    if "nudge" not in request:
        return describe(placed, folder / "result")
    entry = head_entry(placed.nudged(make_options(Nudge, request["nudge"], "head")))
    moved = Placed.read(folder / "result", built, head_pose(entry))
    return describe(moved, folder / "result") | {"entry": asdict(entry)}


def _matrix(pose: Any) -> Float64Array:
    """Return a pose (4, 4); that of a head which was not moved for None."""
    return np.eye(4) if pose is None else np.asarray(pose, np.float64)


TASKS: dict[str, Callable[[dict[str, Any], Tell], Any]] = {
    "accept": accept_photo,
    "look": look,
    "pictures": draw_pictures,
    "frames": pick_frames,
    "outline": find_outline,
    "follow": follow_strands,
    "prepare": prepare_photo,
    "strands": draw_strands,
    "choices": describe_choices,
    "check": check_choices,
    "build": build_groom,
    "draft": draft_groom,
    "export": export_groom,
    "edit": edit_groom,
    "stroke": show_stroke,
    "formats": list_formats,
    "guides": draw_guides,
    "pose": describe_pose,
}


class _Told:
    """Passes progress on, and ends a run that was cancelled at the end of its step."""

    def __init__(self, tell: Tell, stop: Path) -> None:
        """Take the file whose being there stops the run."""
        self._tell = tell
        self._stop = stop

    def started(self, stage: str, steps: int) -> None:
        self._say({"event": "started", "stage": stage, "steps": steps})

    def stepped(self, stage: str) -> None:
        self._say({"event": "stepped", "stage": stage})

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        self._say({"event": "finished", "stage": stage, "seconds": seconds, "reused": reused})

    def message(self, text: str) -> None:
        self._say({"event": "message", "text": text})

    def _say(self, event: dict[str, Any]) -> None:
        if self._stop.exists():
            raise StoppedError("stopped; what is done is kept")
        self._tell(event)


def _hair_packet(groom: Groom, request: dict[str, Any]) -> None:
    from hairkit.studio.hair_packet import HAIRS, write_packet

    roots = _roots_between(groom, HAIRS - len(groom.strands))
    write_packet(groom, Path(request["packet"]), roots)


_ROOTS: dict[str, tuple[Int32Array, Float32Array]] = {}
"""Faces and weights of the last groom's roots between guides: the previews that follow share them,
and throwing the darts anew is half of a preview's packet."""


def _roots_between(groom: Groom, count: int) -> Roots | None:
    """Return roots between the guides, where so many are wanted."""
    if count <= 0:
        return None
    head, at = groom.head, (groom.root_triangle, groom.root_barycentric)
    key = digest_of(head.faces, head.scalp, head.density, *at, count)
    if key not in _ROOTS:
        found = roots_between(groom, count)
        _ROOTS.clear()
        _ROOTS[key] = (found.triangle, found.barycentric)
    return roots_at(head, *_ROOTS[key])


def _write_pictures(image: UInt8Array, request: dict[str, Any]) -> None:
    for name, edge in (("small", SMALL_EDGE), ("large", LARGE_EDGE)):
        if name in request:
            scale = min(1.0, edge / max(image.shape[:2]))
            size = [max(1, round(side * scale)) for side in image.shape[1::-1]]
            shown = cv2.resize(image, size, interpolation=cv2.INTER_AREA) if scale < 1 else image
            data = encode_picture(np.asarray(shown, np.uint8), ".jpg", PICTURE_QUALITY)
            write_bytes(request[name], data, durable=False)
