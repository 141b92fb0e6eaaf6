"""What the studio's processes do: decode photos, find masks, build grooms, write files.

Each task takes a request's values and returns what goes back as JSON. They run in a process of
their own (`task_child`), so that a picture that crashes a decoder ends one task and not the server.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.errors import HairkitError, InputError
from hairkit.io.capture_reader import read_capture
from hairkit.io.capture_toml import head_entry, head_pose, read_capture_file
from hairkit.io.photos import MAX_BYTES, read_header, read_photo
from hairkit.io.video import read_video
from hairkit.manager import Manager
from hairkit.options import make_options
from hairkit.pipeline.draft import draft
from hairkit.pipeline.recipe import Choice, Recipe, load_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.storage import read_bytes, write_bytes
from hairkit.studio.clean_photo import clean_photo
from hairkit.studio.feedback import judge_photo, judge_view
from hairkit.types.capture import View
from hairkit.types.chosen import ChosenHair
from hairkit.types.face import Face
from hairkit.types.groom import Groom
from hairkit.types.mask import HAIR, Mask
from hairkit.types.person import Person

SMALL_EDGE, LARGE_EDGE = 360, 1440
"""Long edges in pixels of the pictures that pages show."""
OUTLINE_EDGE = 600
"""Long edge in pixels of photos whose outlines are found while somebody draws."""
OUTLINE_TOLERANCE = 0.6
"""Pixels of that photo by which an outline may be simplified."""
PICTURE_QUALITY, KEPT_QUALITY = 85, 97
"""JPEG qualities of pictures for pages, and of photos that have to be encoded again."""
DRAFT_SETTINGS = ("visual_hull.voxel_size=0.006",)
"""Options of a quick groom: cells of 6 mm, not 3. With 5 mm, or with whole photos instead of those
of `OUTLINE_EDGE`, F 4/40 of the sample's preview (59) changes by a point, and it takes longer."""
VIDEO_EDGE = 1440
"""Long edge in pixels of a video's frames."""

Tell = Callable[[dict[str, Any]], None]


class StoppedError(HairkitError):
    """A build was cancelled."""


def accept_photo(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Check an upload, clean it, and write it with the pictures for pages.

    Takes `incoming`, the upload, and returns `suffix`, `feedback` and the size of the cleaned
    photo, which takes the upload's place; `small` and `large` are files for the pages' pictures.
    """
    incoming = Path(request["incoming"])
    header = read_header(incoming)
    if header.kind == "HEIC":
        image, header = read_photo(incoming)
        encoded = _jpeg(image, KEPT_QUALITY)
        data, suffix = clean_photo(encoded, header.exif), ".jpg"
    else:
        data = clean_photo(read_bytes(incoming, MAX_BYTES), header.exif)
        suffix = ".png" if header.kind == "PNG" else ".jpg"
    write_bytes(incoming, data)
    image, header = read_photo(incoming, LARGE_EDGE)
    _write_pictures(image, request)
    codes = [code.value for code in judge_photo(image)]
    return {"suffix": suffix, "feedback": codes, "width": header.width, "height": header.height}


def look(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Return what is wrong with a small picture of the camera, `incoming`, for an `azimuth`."""
    from hairkit.studio.capture_guides import hair_line  # loads OpenGL

    image, _ = read_photo(request["incoming"], SMALL_EDGE)
    view, azimuth = _find(View("camera", 0.0, image)), float(request["azimuth"])
    codes = [code.value for code in judge_view(view, azimuth, hair_line(azimuth))]
    return {"feedback": codes, "yaw": None if view.face is None else view.face.yaw_deg}


def draw_pictures(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Write the pictures of a `photo` for pages, as `accept_photo` does."""
    image, header = read_photo(request["photo"], LARGE_EDGE)
    _write_pictures(image, request)
    return {"width": header.width, "height": header.height}


def pick_frames(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Write the best frames of a `video` as PNG files into a `folder`; returns their paths."""
    capture = read_video(Path(request["video"]), VIDEO_EDGE)
    paths = []
    for index, view in enumerate(capture.views):
        path = Path(request["folder"]) / f"{request['name']}-{index:02d}.png"
        data = cv2.imencode(".png", view.image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
        write_bytes(path, data.tobytes())
        paths.append(str(path))
    return {"frames": paths}


def find_outline(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Return the hair of a `photo` as closed curves in its pixels, by the recipe's `segment`.

    `strokes` and `mask` are the files that belong to the photo, or None.
    """
    view, plugin, mask = _segmented(request)
    scale = view.photo_size[0] / view.width
    curves, _ = cv2.findContours(
        (mask.labels == HAIR).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    simple = [cv2.approxPolyDP(curve, OUTLINE_TOLERANCE, True)[:, 0] for curve in curves]
    outline = [((c + 0.5) * scale).round(1).ravel().tolist() for c in simple if len(c) > 2]
    face = view.face
    return {
        "outline": outline,
        "plugin": plugin,
        "width": view.photo_size[0],
        "height": view.photo_size[1],
        "share": float((mask.labels == HAIR).mean()),
        "landmarks": None if face is None else (face.landmarks * scale).round(1).tolist(),
        "face": None if face is None else [round(face.presence, 2), round(face.yaw_deg, 1)],
    }


def draw_strands(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Draw the strands that `orient` finds in a `photo` into the PNG file `path`.

    `options` are those of its plugin, `tone` is brightness and contrast; the rest is as for
    `find_outline`.
    """
    from hairkit.studio.strand_picture import draw_strand_lines

    view, _, mask = _segmented(request)
    brightness, contrast = request["tone"]
    view = replace(view, brightness=brightness, contrast=contrast).toned()
    plugin = oriented().plugin
    found = _manager().call("orient", plugin, request["options"], view=view, mask=mask)
    lines = draw_strand_lines(found)
    data = cv2.imencode(".png", lines[..., [2, 1, 0, 3]], [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    write_bytes(request["path"], data.tobytes(), durable=False)
    return {}


def describe_choices(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Return what can be chosen for the project in `folder`, and what is."""
    chosen = read_capture_file(Path(request["folder"]) / "capture.toml").chosen
    stage = oriented(chosen.settings)
    values = asdict(_manager().options(stage.plugin, stage.options))
    infos = [i for i in _manager().info(stage.plugin).options if i.type in (int, float)]
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


def check_choices(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Return plugin, options and hair of a request as they are kept; `HairkitError` if wrong."""
    plugin = oriented().plugin
    options = asdict(_manager().options(plugin, request["options"]))
    hair = make_options(ChosenHair, request["hair"], "hair")
    usual = asdict(_manager().options(plugin, oriented().options))
    changed = {name: value for name, value in options.items() if value != usual[name]}
    return {"plugin": plugin, "options": changed, "hair": asdict(hair)}


def oriented(settings: Sequence[str] = ()) -> Choice:
    """Return the plugin that follows strands, with its options."""
    stage = _recipe().with_set(settings).stage("orient")
    assert stage is not None  # of the recipe `default`
    return stage.choices[0]


def build_groom(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Reconstruct the project in `folder` into its `result`, as `hairkit reconstruct` does."""
    out = Path(request["result"])
    capture = read_capture(request["folder"])
    groom = reconstruct(
        capture,
        out,
        _recipe().with_set(capture.chosen.settings),
        _manager(),
        guides=request["guides"],
        progress=_Told(tell, stopped),
    )
    _hair_packet(groom, request)
    health = read_record(out / RECORD).health
    return {
        "strands": len(groom.strands),
        "length_cm": round(100 * float(groom.strands.lengths().mean()), 1),
        "health": [[figure.light, figure.line()] for figure in health],
        "pose": _matrix(capture.chosen.head).tolist(),
    }


def draft_groom(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Write the `packet` of a quick groom after strokes on the photos `touched`."""

    def check() -> None:
        if stopped():
            raise StoppedError("stopped; another change came")

    capture = read_capture(request["folder"], OUTLINE_EDGE)
    recipe = _recipe().with_set([*capture.chosen.settings, *DRAFT_SETTINGS])
    work = Path(request["folder"]) / "result" / "work"
    touched, guides = request["touched"], request["guides"]
    _hair_packet(draft(capture, work, touched, recipe, _manager(), guides, check), request)
    return {}


def export_groom(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Write the `groom` by the `plugin` to `path`."""
    groom = Groom.load(request["groom"])
    plugin, path = request["plugin"], Path(request["path"])
    _manager().call("export_groom", plugin, _manager().options(plugin, {}), groom=groom, path=path)
    return {}


def list_formats(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Return plugin and file suffix of every format that a groom can be written in."""
    manager = _manager()
    found = [(name, manager.info(name).suffixes) for name in manager.names("export_groom")]
    return {"formats": [[name, suffixes[0]] for name, suffixes in found if suffixes]}


def draw_guides(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
    """Return the outline of the template head for each view of a turn of `count` photos."""
    from hairkit.studio.capture_guides import guides_for  # loads OpenGL

    return {"guides": guides_for(request["count"], request["above"])}


def describe_pose(request: dict[str, Any], tell: Tell, stopped: Callable[[], bool]) -> Any:
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


TASKS: dict[str, Callable[[dict[str, Any], Tell, Callable[[], bool]], Any]] = {
    "accept": accept_photo,
    "look": look,
    "pictures": draw_pictures,
    "frames": pick_frames,
    "outline": find_outline,
    "strands": draw_strands,
    "choices": describe_choices,
    "check": check_choices,
    "build": build_groom,
    "draft": draft_groom,
    "export": export_groom,
    "formats": list_formats,
    "guides": draw_guides,
    "pose": describe_pose,
}


class _Told:
    """Passes progress on, and ends a run that was cancelled at the end of its step."""

    def __init__(self, tell: Tell, stopped: Callable[[], bool]) -> None:
        self._tell = tell
        self._stopped = stopped

    def started(self, stage: str, steps: int) -> None:
        self._say({"event": "started", "stage": stage, "steps": steps})

    def stepped(self, stage: str) -> None:
        self._say({"event": "stepped", "stage": stage})

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        self._say({"event": "finished", "stage": stage, "seconds": seconds, "reused": reused})

    def message(self, text: str) -> None:
        self._say({"event": "message", "text": text})

    def _say(self, event: dict[str, Any]) -> None:
        if self._stopped():
            raise StoppedError("stopped; what is done is kept")
        self._tell(event)


@cache
def _manager() -> Manager:
    return Manager.loaded()


@cache
def _recipe() -> Recipe:
    return load_recipe("default")


def _segmented(request: dict[str, Any]) -> tuple[View, str, Mask]:
    """Return a photo, and plugin and mask by the recipe's `segment`."""
    path = Path(request["photo"])
    seen = _seen(path, path.stat().st_mtime_ns)
    stage = _recipe().stage("segment")
    assert stage is not None  # of the recipe `default`
    files = {
        key: None if request[key] is None else Path(request[key]) for key in ("strokes", "mask")
    }
    view = replace(seen, strokes_path=files["strokes"], mask_path=files["mask"])
    drawn = tuple(None if file is None else read_bytes(file) for file in files.values())
    kept = _MASKS.get(path)
    if kept is None or kept[0] is not seen or kept[1] != drawn:
        choices = [(choice.plugin, choice.options) for choice in stage.choices]
        kept = (seen, drawn, *_manager().call_first("segment", choices, view=view))
        _MASKS[path] = kept
    return view, kept[2], kept[3]


_MASKS: dict[Path, tuple[View, tuple[bytes | None, ...], str, Mask]] = {}
"""Masks and their plugins by the photo's path, with the photo and the files they were made from."""
_VIEWS: dict[Path, tuple[int, View]] = {}
"""Photos with faces and persons found, by path, with the time of the file."""


def _seen(path: Path, changed: int) -> View:
    """Return a photo with what the recipe finds in it before masks are made."""
    kept = _VIEWS.get(path)
    if kept is not None and kept[0] == changed:
        return kept[1]
    image, header = read_photo(path, OUTLINE_EDGE)
    view = View(path.stem, 0.0, image, photo_path=path, photo_size=(header.width, header.height))
    view = _find(view)
    _VIEWS[path] = (changed, view)
    return view


def _find(view: View) -> View:
    """Return the view with face and person, where the recipe finds them."""
    found: dict[str, Any] = {"landmarks": Face.absent(), "person": Person.absent()}
    for table in found:
        stage = _recipe().stage(table)
        if stage is not None:
            choices = [(choice.plugin, choice.options) for choice in stage.choices]
            answer = _manager().find_first(stage.hook, choices, view=view)
            found[table] = answer[1] if answer is not None else found[table]
    return view.with_findings(found["landmarks"], found["person"])


def _hair_packet(groom: Groom, request: dict[str, Any]) -> None:
    from hairkit.studio.hair_packet import write_packet

    write_packet(groom, Path(request["packet"]))


def _write_pictures(image: UInt8Array, request: dict[str, Any]) -> None:
    for name, edge in (("small", SMALL_EDGE), ("large", LARGE_EDGE)):
        if name in request:
            scale = min(1.0, edge / max(image.shape[:2]))
            size = [max(1, round(side * scale)) for side in image.shape[1::-1]]
            shown = cv2.resize(image, size, interpolation=cv2.INTER_AREA) if scale < 1 else image
            data = _jpeg(np.asarray(shown, np.uint8), PICTURE_QUALITY)
            write_bytes(request[name], data, durable=False)


def _jpeg(image: UInt8Array, quality: int) -> bytes:
    done, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise InputError("the picture cannot be encoded")
    return data.tobytes()
