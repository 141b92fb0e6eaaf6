"""Scripts of actions, run without a window: `[[steps]]` tables of a TOML file.

size = [640, 360]          # pixels
hairs = 5000
[[steps]]
do = "wind"                # an action of `hairkit.viewer.actions.actions`, the rest are its values
on = true
speed = 5
[[steps]]
do = "run"
seconds = 1.5
[[steps]]
do = "screenshot"
file = "windy.png"         # in the folder of --out
"""

from __future__ import annotations

import time
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hairkit.errors import HairkitError, InputError
from hairkit.options import make_options, option
from hairkit.storage import read_text
from hairkit.viewer.actions.actions import checked_values, perform
from hairkit.viewer.preview import Preview
from hairkit.viewer.recording import FRAMES_PER_SECOND, Recorder
from hairkit.viewer.session import Session

_WRITES = ("screenshot", "record")
_READS = ("open_file",)


@dataclass(frozen=True)
class Setup:
    """What a script says beside its steps."""

    size: tuple[int, int] = option((1280, 720), low=16, high=8192, doc="Picture.", unit="px")
    hairs: int = option(10_000, low=0, high=200_000, doc="Strands drawn.")
    seed: int = option(0, low=0, doc="Of the interpolated hair.")


@dataclass(frozen=True)
class Script:
    """A script that was read."""

    path: Path
    setup: Setup
    steps: tuple[tuple[str, dict[str, Any]], ...]
    """Actions and their values."""


def read_script(path: Path) -> Script:
    """Read a script; raises `InputError` or `OptionError` that names the step at fault."""
    try:
        document = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not a TOML file: {error}") from error
    steps = document.pop("steps", [])
    if not isinstance(steps, list) or not all(isinstance(step, Mapping) for step in steps):
        raise InputError(f"{path}: steps are no tables; begin each with [[steps]]")
    setup = make_options(Setup, document, str(path))
    return Script(path, setup, tuple(_step(path, i, dict(s)) for i, s in enumerate(steps, 1)))


def play(preview: Preview, script: Script, out: Path) -> None:
    """Do the steps one after the other; files go to the folder `out`, names are from there.

    Files take the place of older ones of the same name.

    Raises
    ------
    InputError
        A step cannot be done; the text says which one.
    """
    out.mkdir(parents=True, exist_ok=True)
    session = preview.session
    session.overwrite = True
    films: list[Recorder] = []
    try:
        for _ in performed(session, script, out):
            if session.recorder is not None and session.recorder not in films:
                films.append(session.recorder)
            _let_time_pass(preview)
            _wait_for_rerun(session)
            if session.screenshots:
                preview.frame(0.0, still=True)
            if session.finished:
                break
    finally:
        if session.rerun is not None:
            session.rerun.stop()
        if session.recorder is not None:
            session.recorder.close()
        preview.written += [film.path for film in films if film.count]


def performed(session: Session, script: Script, out: Path) -> Iterator[None]:
    """Do one step at each `next`, and leave it to the caller to let time pass."""
    for number, (name, values) in enumerate(script.steps, 1):
        try:
            perform(session, name, _placed(name, values, out, script.path.parent))
        except HairkitError as error:
            raise InputError(f"{script.path}: step {number}: {error}") from error
        yield


def _let_time_pass(preview: Preview) -> None:
    session, frame = preview.session, 1 / FRAMES_PER_SECOND
    while session.pending > 1e-9:
        seconds = min(frame, session.pending)
        session.pending -= seconds
        if session.recorder is not None:
            preview.frame(seconds)
        else:
            session.advance(seconds)  # nobody sees it


def _wait_for_rerun(session: Session) -> None:
    while session.rerun is not None:
        time.sleep(0.05)
        session.look_after_rerun()


def _step(path: Path, number: int, table: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    name = str(table.pop("do", None))
    try:
        checked_values(name, table)
    except HairkitError as error:
        raise InputError(f"{path}: step {number}: {error}") from error
    return name, table


def _placed(name: str, values: dict[str, Any], out: Path, here: Path) -> dict[str, Any]:
    """Return the values with file names taken from the right folder."""
    base = out if name in _WRITES else here if name in _READS else None
    if base is None:
        return values
    return {**values, "file": str(base / str(checked_values(name, values)["file"]))}
