"""Captures to be done, the settings that all of them share, and what became of each."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hairkit.errors import HairkitError, InputError
from hairkit.options import unknown_name
from hairkit.remote import children, describe, exists, is_url, join, read_bytes, write_text
from hairkit.storage import read_text

if TYPE_CHECKING:  # a worker of Dask knows jobs, and starts without the libraries that do them
    from hairkit.manager import Manager

RESULT = "batch.json"
"""Name of the file beside a groom that says that the capture is done, and how it went."""
DONE, KEPT, FAILED = "done", "kept", "failed"
"""What became of a capture: made now, made before, not made."""
LONGEST_RESULT = 2**24
"""Bytes of a result's file."""


@dataclass(frozen=True)
class Job:
    """One capture."""

    name: str
    """Name of its folder or video, and of its folder in the output."""
    photos: str
    """What the stage `capture` is asked for: a path, a URL, or a name that its plugin knows."""
    out: str
    """Path or URL of its folder in the output."""


@dataclass(frozen=True)
class Settings:
    """How every capture of a batch is reconstructed; all of it can be written as JSON."""

    recipe: str = "default"
    """A shipped recipe, or the path of a `.toml` file."""
    settings: tuple[str, ...] = ()
    """Changes of the recipe, as of `--set`."""
    plugin_files: tuple[str, ...] = ()
    guides: int = 600
    seed: int = 0
    max_edge: int | None = None
    sheet: bool = False
    """Draw the contact sheet of each capture."""
    scores: bool = False
    """Evaluate captures that have a folder `truth`."""
    drop_work: bool = False
    """Empty the folder `work` of each capture once it is done."""

    def __post_init__(self) -> None:
        # a worker may start in another folder
        if self.recipe.endswith(".toml") and not is_url(self.recipe):
            object.__setattr__(self, "recipe", str(Path(self.recipe).absolute()))
        files = tuple(str(Path(file).absolute()) for file in self.plugin_files)
        object.__setattr__(self, "plugin_files", files)
        object.__setattr__(self, "settings", tuple(self.settings))

    def digest(self, manager: Manager) -> str:
        """Return a hex digest of all that a result depends on besides its capture.

        Checks the recipe, too: raises `HairkitError` as `Recipe.check`.
        """
        from hairkit.pipeline.recipe import load_recipe, stage_digest

        recipe = load_recipe(self.recipe).with_set(self.settings)
        recipe.check(manager)
        state = hashlib.sha256(repr((self.guides, self.seed, self.max_edge)).encode())
        state.update(repr((self.sheet, self.scores)).encode())
        for stage in recipe.stages:
            state.update(f"{stage.table} {stage_digest(manager, stage)}\n".encode())
        return state.hexdigest()


@dataclass(frozen=True)
class Result:
    """What became of one capture."""

    name: str
    state: str
    """`done`, `kept` from an earlier batch, or `failed`."""
    out: str
    seconds: float = 0.0
    processor_seconds: float = 0.0
    peak_bytes: int = 0
    """Largest resident memory of the process so far."""
    tries: int = 1
    strands: int = 0
    error: str = ""
    """Why it failed, one line; empty where it did not."""
    thumbnail: str = ""
    """Name of a small picture in its folder; empty where there is none."""
    stages: Mapping[str, float] = field(default_factory=dict)
    """Seconds of each stage that ran."""
    health: tuple[Mapping[str, Any], ...] = ()
    """Figures of the run, as in `run.json`."""
    scores: Mapping[str, float] = field(default_factory=dict)
    digest: str = ""
    """Of settings and capture; equal digests need no second run."""

    def write(self) -> None:
        """Write the result into its folder."""
        text = json.dumps(dataclasses.asdict(self), indent=1)
        write_text(join(self.out, RESULT), text + "\n")

    @property
    def lights(self) -> dict[str, int]:
        """Number of figures of each light."""
        lights = [str(figure["light"]) for figure in self.health]
        return {light: lights.count(light) for light in ("green", "amber", "red")}


def find_jobs(
    captures: str | os.PathLike[str], out: str | os.PathLike[str], only: Sequence[str] = ()
) -> tuple[Job, ...]:
    """Return a job for each capture, sorted by name.

    Captures are the folders and videos in a folder, at a path or a URL, or the lines of a `.txt`
    file. Raises `InputError` where there is none, for a name in `only` that is not there, and for
    an output folder in which captures lie.
    """
    given = str(captures) if is_url(captures) else str(Path(captures).absolute())
    results = str(out) if is_url(out) else str(Path(out).absolute())
    listed = not is_url(given) and given.endswith(".txt")
    found = _listed(Path(given)) if listed else _lying(given)
    if not listed and f"{results.rstrip('/')}/".startswith(f"{given.rstrip('/')}/"):
        raise InputError(f"{out}: lies in the folder of the captures; choose one beside it")
    if not found:
        raise InputError(f"{captures}: holds no capture: a folder of photos or a video for each")
    for name in only:
        if name not in found:
            raise InputError(f"{captures}: {unknown_name('capture', name, [*found])}")
    chosen = {name: source for name, source in found.items() if not only or name in only}
    return tuple(Job(name, source, join(results, name)) for name, source in chosen.items())


def _lying(folder: str) -> dict[str, str]:
    """Return the captures in a folder by their names."""
    if not is_url(folder) and not Path(folder).is_dir():
        raise InputError(f"{folder}: no such folder")
    from hairkit.io.video import SUFFIXES

    return {
        name: join(folder, name)
        for name, is_folder in children(folder)
        if name[0] != "." and (is_folder or Path(name).suffix.lower() in SUFFIXES)
    }


def _listed(path: Path) -> dict[str, str]:
    """Return the captures that a file names, one a line: what the stage `capture` is asked for."""
    lines = [line.strip() for line in read_text(path, LONGEST_RESULT).splitlines()]
    sources = [line for line in lines if line and not line.startswith("#")]
    found: dict[str, str] = {}
    for source in sources:
        name = re.sub(r"[^\w.-]+", "_", source).strip("_.")
        if name in found:
            raise InputError(f"{path}: {source!r} and {found[name]!r} would have one folder {name}")
        found[name] = str(Path(source).absolute()) if Path(source).exists() else source
    return dict(sorted(found.items()))


def part_of(jobs: Sequence[Job], text: str | None) -> tuple[Job, ...]:
    """Return every N-th job from the K-th on: `part_of(jobs, "2/5")`; all without a text.

    >>> part_of([Job(name, "", "") for name in "abcde"], "2/3")[1].name
    'e'
    """
    number, slash, count = ("1/1" if text is None else text).partition("/")
    whole = slash and number.isdecimal() and count.isdecimal()
    if not whole or not 1 <= int(number) <= int(count):
        raise InputError(f"part {text!r}, expected K/N with K from 1 to N: 2/5")
    return tuple(jobs[int(number) - 1 :: int(count)])


def job_digest(job: Job, settings_digest: str) -> str:
    """Return a hex digest of a job: of its settings and of names, sizes and times of its files.

    Of a source that is neither path nor URL only the name is known.
    """
    state = hashlib.sha256(settings_digest.encode())
    if is_url(job.photos):
        files = describe(job.photos)
    else:
        photos = Path(job.photos)
        found = {path.relative_to(photos.parent): path.stat() for path in _files(photos)}
        files = {str(name): f"{at.st_size} {at.st_mtime_ns}" for name, at in found.items()}
        files = files if photos.exists() else {job.photos: ""}
    for name, stamp in files.items():
        state.update(f"\n{name} {stamp}".encode())
    return state.hexdigest()


def finished(job: Job, digest: str) -> Result | None:
    """Return the result of an earlier batch with this digest, None where there is none."""
    try:
        result = read_result(join(job.out, RESULT))
    except HairkitError:
        return None
    if result.digest != digest or not exists(join(job.out, "groom.npz")):
        return None
    return dataclasses.replace(result, name=job.name, out=job.out, state=KEPT)


def read_result(path: str | os.PathLike[str]) -> Result:
    """Return a result that was written; raises `InputError` for anything else."""
    try:
        return result_from(json.loads(read_bytes(path, LONGEST_RESULT)))
    except (ValueError, TypeError, LookupError, RecursionError, AttributeError) as error:
        raise InputError(f"{path}: no result of a batch ({error})") from error


def result_from(document: Mapping[str, Any]) -> Result:
    """Return a result from its JSON."""
    return Result(**{**document, "health": tuple(document["health"])})


def _files(photos: Path) -> Iterable[Path]:
    """Return the files of a capture but for its truth, sorted."""
    if photos.is_file():
        return [photos]
    inside = sorted(path for path in photos.rglob("*") if path.is_file())
    return [path for path in inside if path.relative_to(photos).parts[0] != "truth"]
