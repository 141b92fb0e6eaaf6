"""How the pipeline tells that it moves on: a small protocol, in bars, in lines or not at all."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Any, Protocol, Self, TextIO


class Progress(Protocol):
    """What the pipeline calls; stages of several steps may overlap, calls come from any thread."""

    def started(self, stage: str, steps: int) -> None:
        """Tell that a stage of so many steps has begun."""

    def stepped(self, stage: str) -> None:
        """Tell that one step of a stage is done."""

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Tell that a stage has ended; `reused` when its result was kept from an earlier run."""

    def message(self, text: str) -> None:
        """Tell the user one line."""


class Silent:
    """Tells nothing."""

    def started(self, stage: str, steps: int) -> None:
        """Tell nothing."""

    def stepped(self, stage: str) -> None:
        """Tell nothing."""

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Tell nothing."""

    def message(self, text: str) -> None:
        """Tell nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None


class Lines(Silent):
    """Writes one line a finished stage, for logs and pipes."""

    def __init__(self, stream: TextIO | None = None) -> None:
        """Write to `stream`, stderr by default."""
        self._stream = stream or sys.stderr

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Write the stage's name and time."""
        self.message(f"{stage:<8} {'kept' if reused else f'{seconds:.2f} s'}")

    def message(self, text: str) -> None:
        """Write the line."""
        print(text, file=self._stream, flush=True)


class Bars:
    """Draws a bar a stage on a terminal; used as a context manager."""

    def __init__(self, stream: TextIO | None = None) -> None:
        """Draw on `stream`, stderr by default."""
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        columns = (
            TextColumn("{task.description:<8}"),
            BarColumn(),
            TextColumn("{task.fields[note]}"),
        )
        console = Console(file=stream or sys.stderr)
        self._rich = RichProgress(*columns, console=console)
        self._tasks: dict[str, Any] = {}

    def __enter__(self) -> Self:
        self._rich.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._rich.stop()

    def started(self, stage: str, steps: int) -> None:
        """Add the stage's bar."""
        self._tasks[stage] = self._rich.add_task(stage, total=steps, note="")

    def stepped(self, stage: str) -> None:
        """Move the stage's bar on."""
        self._rich.advance(self._tasks[stage])

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Fill the stage's bar and write the time beside it."""
        task = self._tasks[stage]
        steps = next(t.total for t in self._rich.tasks if t.id == task)
        self._rich.update(task, completed=steps, note="kept" if reused else f"{seconds:.2f} s")

    def message(self, text: str) -> None:
        """Print the line above the bars."""
        self._rich.console.print(text, markup=False, highlight=False)


def progress_for(stream: TextIO, *, quiet: bool) -> Silent | Lines | Bars:
    """Return bars for a terminal, lines for anything else, nothing when `quiet`."""
    if quiet:
        return Silent()
    return Bars(stream) if stream.isatty() else Lines(stream)


class Recorder:
    """Passes everything on and keeps the times of the stages."""

    def __init__(self, progress: Progress) -> None:
        """Pass everything on to `progress`."""
        self._progress = progress
        self.stages: list[dict[str, object]] = []
        """What has ended: `stage`, `seconds` and whether it was `reused`."""

    def started(self, stage: str, steps: int) -> None:
        """Pass on that a stage has begun."""
        self._progress.started(stage, steps)

    def stepped(self, stage: str) -> None:
        """Pass on that a step is done."""
        self._progress.stepped(stage)

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Keep and pass on that a stage has ended."""
        self.stages.append({"stage": stage, "seconds": round(seconds, 4), "reused": reused})
        self._progress.finished(stage, seconds, reused)

    def message(self, text: str) -> None:
        """Pass one line on."""
        self._progress.message(text)
