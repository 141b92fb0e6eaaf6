"""A project: a folder that `hairkit reconstruct` reads, and what the studio knows beside it.

    photos/ 001.jpg ...       cleaned photos, named by the studio
    strokes/001.json          what was drawn on a photo, labelme's shape
    landmarks.json            landmarks that were corrected
    capture.toml              names, order and tones of the photos, where they were given; what was
                              chosen of head, hair and options
    edits.json                strokes of brushes over the hair
    studio.json               the photos in their order: the source of capture.toml's tables
    result/                   what `hairkit reconstruct PROJECT -o PROJECT/result` writes
    .studio/                  pictures for the pages and uploads on their way; may be deleted

Every file is replaced whole, in an order in which the folder can be read after each step.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from hairkit.errors import HairkitError, InputError
from hairkit.io.capture_reader import BESIDE, EDITS, FEWEST, MOST, NAMES
from hairkit.io.capture_toml import (
    HeadEntry,
    ViewEntry,
    head_values,
    read_capture_file,
    write_table,
    write_view_entries,
)
from hairkit.io.strokes import read_strokes
from hairkit.storage import read_text, write_bytes, write_text
from hairkit.studio.photo_files import facts_of, is_photo, natural
from hairkit.types.chosen import Chosen, ChosenHair
from hairkit.types.edits import Edits, read_edits

STATE = "studio.json"
PACKET = "HKS3"
"""Kind of file in which pages get their hair; another one is made anew."""
RESULT = "result"
_BUILT = "studio.json"
_LARGEST_STATE = 2**20
"""Bytes of studio.json; a photo takes about a hundred."""
_LANDMARKS = 68


@dataclass(frozen=True)
class Shot:
    """One photo of a project."""

    id: int
    """Number that pages use; never used again after the photo has gone."""
    file: str
    """Name in the folder of the photos."""
    view: str | None = None
    """Name of the view, of `NAMES`, where whoever took the photo said so."""
    brightness: float = 1.0
    contrast: float = 1.0
    """How the stage `orient` sees the photo."""


class Project:
    """The files of one project; used by one server at a time."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """Open a folder, made where there is none; raises `InputError` if it is something else."""
        self.folder = Path(folder)
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(f"{self.folder}: not a folder; name one for the project")
        bare = self.folder.is_dir() and any(map(is_photo, self.folder.iterdir()))
        self.photo_folder = self.folder if bare else self.folder / "photos"
        self.incoming = self.folder / ".studio" / "incoming"
        """Folder of uploads that are not complete."""
        self.pictures = self.folder / ".studio" / "pictures"
        """Folder of the pictures that pages show."""
        self.result = self.folder / RESULT
        """Folder of the groom and its files."""
        self.groom = self.result / "groom.npz"
        self.draft = self.result / "studio-draft.bin"
        """The packet of a quick groom that the whole one will replace."""
        for made in (self.photo_folder, self.folder / "strokes", self.incoming, self.pictures):
            made.mkdir(parents=True, exist_ok=True)
        self._clean_up()
        self.shots = self._read_shots()
        self._said = self._said_entries()
        known = {shot.id for shot in self._kept()}
        self.shots = [shot if shot.id in known else self._toned(shot) for shot in self.shots]
        if self._kept() not in ([], self.shots):  # files came or went meanwhile
            self._keep(self.shots)
        if shutil.disk_usage(self.folder).free < _LARGEST_STATE:
            raise InputError(f"{self.folder}: no room on this disk; free some")

    def _clean_up(self) -> None:
        """Remove uploads, and files on their way to a name, that a crash cut short."""
        own, result = (self.folder, self.pictures), self.result
        unfinished = [path for folder in own for path in folder.glob(".*.part")]
        for path in (*unfinished, *result.glob(".*"), *self.incoming.iterdir()):
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def shot(self, number: int) -> Shot:
        """Return the photo with a number; raises `InputError` if there is none."""
        for shot in self.shots:
            if shot.id == number:
                return shot
        raise InputError(f"no photo {number} in this project")

    def photo(self, shot: Shot) -> Path:
        """Return the path of a photo."""
        return self.photo_folder / shot.file

    def strokes(self, shot: Shot) -> Path:
        """Return the path of what was drawn on a photo, which need not exist."""
        return self.folder / "strokes" / f"{Path(shot.file).stem}.json"

    def mask(self, shot: Shot) -> Path | None:
        """Return the file of a mask that came with the photo."""
        path = self.folder / "masks" / f"{Path(shot.file).stem}.png"
        return path if path.is_file() else None

    def picture(self, shot: Shot, size: str) -> Path:
        """Return the path of the picture of a photo that pages show: `small` or `large`."""
        return self.pictures / f"{Path(shot.file).stem}-{size}.jpg"

    def seen(self, shot: Shot) -> Path:
        """Return the folder of what previews need of a photo."""
        return self.pictures / f"{Path(shot.file).stem}-seen"

    def next_file(self, suffix: str) -> tuple[int, str]:
        """Return the number and the file name of a new photo; `InputError` when it is full."""
        if len(self.shots) >= MOST:
            raise InputError(f"{MOST} photos are in the project, which is the most; remove one")
        taken = {shot.file for shot in self.shots}
        number = 1 + max([shot.id for shot in self.shots], default=0)
        while f"{number:03d}{suffix}" in taken:
            number += 1
        return number, f"{number:03d}{suffix}"

    def add(self, cleaned: Path, suffix: str, view: str | None = None) -> Shot:
        """Move a cleaned photo into the project, as its last."""
        number, file = self.next_file(suffix)
        shot = Shot(number, file, view if view in NAMES else None)
        write_view_entries(self.folder / "capture.toml", [])
        os.replace(cleaned, self.photo_folder / file)
        self._keep([*self.shots, shot])
        return shot

    def retake(self, number: int, cleaned: Path, suffix: str) -> Shot:
        """Replace a photo by a new one of the same view; what was drawn on it goes."""
        old = self.shot(number)
        self._forget(old)
        write_view_entries(self.folder / "capture.toml", [])
        new = replace(old, file=Path(old.file).with_suffix(suffix).name)
        os.replace(cleaned, self.photo(new))
        if new.file != old.file:
            self.photo(old).unlink(missing_ok=True)
        self._keep([new if shot.id == number else shot for shot in self.shots])
        return new

    def remove(self, number: int) -> None:
        """Remove a photo and all that belongs to it."""
        old = self.shot(number)
        self._forget(old)
        write_view_entries(self.folder / "capture.toml", [])
        self.photo(old).unlink(missing_ok=True)
        self._keep([shot for shot in self.shots if shot.id != number])

    def arrange(self, numbers: Sequence[int]) -> None:
        """Put the photos in another order; the names of views, which would contradict it, go."""
        by_number = {shot.id: shot for shot in self.shots}
        if sorted(numbers) != sorted(by_number):
            raise InputError("the order names other photos than the project has")
        self._said = {
            file: replace(entry, azimuth_deg=None, elevation_deg=None)
            for file, entry in self._said.items()
        }
        self._keep([replace(by_number[number], view=None) for number in numbers])

    def draw(self, number: int, document: dict[str, Any]) -> None:
        """Keep what was drawn on a photo; a file without shapes is removed.

        Raises `InputError` when `document` is not labelme's JSON with labels that are known.
        """
        path = self.strokes(self.shot(number))
        if not document.get("shapes"):
            path.unlink(missing_ok=True)
            return
        trial = self.incoming / f"strokes-{number}.json"
        write_text(trial, json.dumps(document))
        try:
            read_strokes(trial)
            os.replace(trial, path)
        finally:
            trial.unlink(missing_ok=True)

    def tone(self, number: int, brightness: float, contrast: float) -> None:
        """Keep how the stage `orient` sees a photo."""
        toned = replace(self.shot(number), brightness=brightness, contrast=contrast)
        self._keep([toned if shot.id == number else shot for shot in self.shots])

    def outline(self, shot: Shot, key: str) -> dict[str, Any] | None:
        """Return the outline that was kept for a photo, None if it is of another `key`."""
        try:
            kept = json.loads(read_text(self._outline_file(shot)))
            return dict(kept["found"]) if kept["key"] == key else None
        except (ValueError, KeyError, TypeError, HairkitError, OSError):
            return None  # found again

    def keep_outline(self, shot: Shot, key: str, found: dict[str, Any]) -> None:
        """Keep the outline that was found in a photo."""
        text = json.dumps({"key": key, "found": found})
        write_bytes(self._outline_file(shot), text.encode(), durable=False)

    def _outline_file(self, shot: Shot) -> Path:
        return self.pictures / f"{Path(shot.file).stem}-outline.json"

    def _toned(self, shot: Shot) -> Shot:
        """Return a photo as a capture.toml that somebody wrote says it should be seen."""
        said = self._said.get(shot.file, ViewEntry())
        return replace(shot, brightness=said.brightness, contrast=said.contrast)

    def landmarks(self) -> dict[str, Any]:
        """Return the landmarks that were given, by the photo's stem."""
        path = self.folder / "landmarks.json"
        if not path.is_file():
            return {}
        try:
            return dict(json.loads(read_text(path))["views"])
        except (ValueError, KeyError, TypeError):
            return {}

    def mark(self, number: int, points: list[list[float]] | None) -> None:
        """Keep the landmarks (68 points, pixels of the photo) of a photo, or forget them."""
        if points is not None and len(points) != _LANDMARKS:
            raise InputError(f"{len(points)} landmarks, expected {_LANDMARKS}")
        views = self.landmarks()
        stem = Path(self.shot(number).file).stem
        views.pop(stem, None)
        if points is not None:
            views[stem] = [[float(x), float(y)] for x, y in points]
        path = self.folder / "landmarks.json"
        if views:
            write_text(path, json.dumps({"views": views}))
        else:
            path.unlink(missing_ok=True)

    def place_head(self, entry: HeadEntry) -> None:
        """Keep how the fitted head was moved by hand."""
        values = {} if entry == HeadEntry() else head_values(entry)
        write_table(self.folder / "capture.toml", "fitted_head", values)

    @property
    def edits(self) -> Edits:
        """What was drawn over the hair."""
        return read_edits(self.folder / EDITS)

    def edit(self, edits: Edits) -> None:
        """Keep what was drawn over the hair."""
        edits.write(self.folder / EDITS)

    @property
    def chosen(self) -> Chosen:
        """What was chosen instead of measured."""
        return read_capture_file(self.folder / "capture.toml").chosen

    def choose(self, plugin: str, options: dict[str, Any], hair: ChosenHair) -> None:
        """Keep options of a plugin and what was chosen of the hair; both were checked."""
        settings = dict(text.split("=", 1) for text in self.chosen.settings)
        kept = {k: v for k, v in settings.items() if not k.startswith(f"{plugin}.")}
        own = {f"{plugin}.{name}": value for name, value in options.items()}
        write_table(self.folder / "capture.toml", "options", kept | own)
        write_table(self.folder / "capture.toml", "hair", asdict(hair))

    def inputs(self) -> str:
        """Return a text that changes whenever a file does that a reconstruction reads, and when
        pages read their hair otherwise."""
        files = [self.photo(shot) for shot in self.shots]
        files += sorted((self.folder / "strokes").glob("*.json"))
        files += sorted((self.folder / "masks").glob("*.png"))
        files += [self.folder / name for name in BESIDE]
        return json.dumps([PACKET, *(facts_of(file) for file in files if file.is_file())])

    @property
    def built(self) -> str:
        """What `inputs` was when the result was made; empty where there is none."""
        return str(self._built().get("inputs", ""))

    def has_built(self, shot: Shot) -> bool:
        """Return whether the result was made from this photo, among others."""
        return facts_of(self.photo(shot)) in json.loads(self.built or "[]")

    @property
    def made(self) -> dict[str, Any]:
        """What was said of the result when it was made."""
        return dict(self._built().get("made", {}))

    def set_built(self, inputs: str, made: dict[str, Any]) -> None:
        """Say that the result belongs to these inputs, and keep what pages show of it."""
        write_text(self.result / _BUILT, json.dumps({"inputs": inputs, "made": made}))
        self.draft.unlink(missing_ok=True)

    def _built(self) -> dict[str, Any]:
        path = self.result / _BUILT
        if not (path.is_file() and self.groom.is_file()):
            return {}
        try:
            return dict(json.loads(read_text(path)))
        except (ValueError, TypeError):
            return {}

    @property
    def enough(self) -> bool:
        """Whether there are photos enough for a groom."""
        return len(self.shots) >= FEWEST

    def _read_shots(self) -> list[Shot]:
        """Return the photos that are there, in the order that was kept; new ones come last."""
        files = sorted(filter(is_photo, self.photo_folder.iterdir()), key=natural)
        there = {path.name for path in files}
        shots = [shot for shot in self._kept() if shot.file in there]
        known = {shot.file for shot in shots}
        number = max([shot.id for shot in shots], default=0)
        for path in files:
            if path.name not in known:
                number += 1
                view = re.sub(r"^\d+[-_. ]*", "", path.stem).lower().replace("_", "-")
                shots.append(Shot(number, path.name, view if view in NAMES else None))
        return shots

    def _kept(self) -> list[Shot]:
        path = self.folder / STATE
        if not path.is_file():
            return []
        try:
            kept = json.loads(read_text(path, _LARGEST_STATE))["photos"]
            return [Shot(**entry) for entry in kept]
        except (ValueError, KeyError, TypeError, HairkitError):
            return []  # somebody else wrote it; the photos are what counts

    def _keep(self, shots: list[Shot]) -> None:
        """Write the state, then the tables of capture.toml that follow from it."""
        self.shots = shots
        state = {"photos": [asdict(shot) for shot in shots]}
        write_text(self.folder / STATE, json.dumps(state, indent=1) + "\n")
        write_view_entries(self.folder / "capture.toml", self._entries())

    def _said_entries(self) -> dict[str, ViewEntry]:
        """Return what a capture.toml that somebody wrote says of each photo."""
        entries = read_capture_file(self.folder / "capture.toml").views
        files = [shot.file for shot in self.shots]
        return {entry.photo or file: entry for entry, file in zip(entries, files, strict=False)}

    def _entries(self) -> list[ViewEntry]:
        """Return the tables of the views: names where all are known and differ, or the order."""
        views = [shot.view for shot in self.shots]
        named = None not in views and len(set(views)) == len(views)
        shots = self.shots
        if named:
            shots = sorted(shots, key=lambda shot: NAMES.index(shot.view or ""))
        order = [shot.file for shot in shots]
        in_order = order == sorted(order, key=lambda name: natural(Path(name)))
        toned = any((shot.brightness, shot.contrast) != (1, 1) for shot in shots)
        if not (named or toned) and in_order and not set(order) & set(self._said):
            return []
        return [
            replace(
                self._said.get(s.file, ViewEntry()),
                photo=s.file,
                name=s.view if named else None,
                brightness=s.brightness,
                contrast=s.contrast,
            )
            for s in shots
        ]

    def _forget(self, shot: Shot) -> None:
        """Remove what was made from a photo."""
        self.strokes(shot).unlink(missing_ok=True)
        mask = self.mask(shot)
        if mask is not None:
            mask.unlink(missing_ok=True)
        if Path(shot.file).stem in self.landmarks():
            self.mark(shot.id, None)
        for size in ("small", "large"):
            self.picture(shot, size).unlink(missing_ok=True)
        self._outline_file(shot).unlink(missing_ok=True)
        shutil.rmtree(self.seen(shot), ignore_errors=True)
