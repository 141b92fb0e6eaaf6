"""Scripts of actions, run without a window: a TOML file with a list of `[[steps]]`.

size = [640, 360]          # pixels
hairs = 5000
[[steps]]
do = "wind"                # name of an action; the other keys are its values
on = true
speed = 5
[[steps]]
do = "run"
seconds = 1.5
[[steps]]
do = "screenshot"
file = "windy.png"         # relative to --out
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hairkit.errors import HairkitError, InputError
from hairkit.options import make_options, option
from hairkit.storage import read_toml
from hairkit.viewer.actions.actions import check_values, perform
from hairkit.viewer.preview import Preview
from hairkit.viewer.recording import FRAMES_PER_SECOND, Recorder
from hairkit.viewer.session import Session

_WRITES = ("screenshot", "record")
_READS = ("open_file",)


@dataclass(frozen=True)
class Setup:
    """Settings of a script."""

    size: tuple[int, int] = option((1280, 720), low=16, high=8192, doc="Picture size.", unit="px")
    hairs: int = option(10_000, low=0, high=200_000, doc="Strands drawn.")
    seed: int = option(0, low=0, doc="Seed of the interpolated hair.")


@dataclass(frozen=True)
class Script:
    """A script and its settings."""

    path: Path
    setup: Setup
    steps: tuple[tuple[str, dict[str, Any]], ...]
    """Actions and their values."""


def read_script(path: Path) -> Script:
    """Read a script; raises `InputError` or `OptionError` that names the invalid step."""
    document = read_toml(path)
    steps = document.pop("steps", [])
    if not isinstance(steps, list) or not all(isinstance(step, Mapping) for step in steps):
        raise InputError(f"{path}: steps is not a list of tables; start each step with [[steps]]")
    setup = make_options(Setup, document, str(path))
    return Script(path, setup, tuple(_check_step(path, i, dict(s)) for i, s in enumerate(steps, 1)))


def play(preview: Preview, script: Script, out: Path) -> None:
    """Run the steps in order; files are written relative to the folder `out`.

    Existing files of the same name are overwritten.

    Raises
    ------
    InputError
        A step fails; the message gives its number.
    """
    out.mkdir(parents=True, exist_ok=True)
    session = preview.session
    session.overwrite = True
    films: list[Recorder] = []
    try:
        for _ in run_steps(session, script, out):
            if session.recorder is not None and session.recorder not in films:
                films.append(session.recorder)
            _advance_pending(preview)
            if session.screenshots:
                preview.frame(0.0, still=True)
            if session.finished:
                break
    finally:
        if session.recorder is not None:
            session.recorder.close()
        preview.written += [film.path for film in films if film.count]


def run_steps(session: Session, script: Script, out: Path) -> Iterator[None]:
    """Perform one step at each `next`; the caller simulates the time in between."""
    for number, (name, values) in enumerate(script.steps, 1):
        try:
            perform(session, name, _resolve_paths(name, values, out, script.path.parent))
        except HairkitError as error:
            raise InputError(f"{script.path}: step {number}: {error}") from error
        yield


def _advance_pending(preview: Preview) -> None:
    session, frame = preview.session, 1 / FRAMES_PER_SECOND
    while session.pending > 1e-9:
        seconds = min(frame, session.pending)
        session.pending -= seconds
        if session.recorder is not None:
            preview.frame(seconds)
        else:
            session.advance(seconds)


def _check_step(path: Path, number: int, table: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    name = str(table.pop("do", None))
    try:
        check_values(name, table)
    except HairkitError as error:
        raise InputError(f"{path}: step {number}: {error}") from error
    return name, table


def _resolve_paths(name: str, values: dict[str, Any], out: Path, here: Path) -> dict[str, Any]:
    """Return the values with the file name resolved: output from `out`, input from `here`."""
    base = out if name in _WRITES else here if name in _READS else None
    if base is None:
        return values
    return {**values, "file": str(base / str(check_values(name, values)["file"]))}
