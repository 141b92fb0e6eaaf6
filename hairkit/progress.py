"""Progress reporting: a protocol with rich, plain-text and silent implementations."""

from __future__ import annotations

import sys
import threading
from typing import Any, Protocol, Self, TextIO


class Progress(Protocol):
    """Receives progress; stages may overlap, and calls may come from any thread."""

    def started(self, stage: str, steps: int) -> None:
        """Report that a stage with this number of steps has started."""

    def stepped(self, stage: str) -> None:
        """Report that one step of a stage is done."""

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Report that a stage has ended; `reused` if its result came from an earlier run."""

    def message(self, text: str) -> None:
        """Show one line to the user."""


class Silent:
    """Reports nothing."""

    def started(self, stage: str, steps: int) -> None:
        """Do nothing."""

    def stepped(self, stage: str) -> None:
        """Do nothing."""

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Do nothing."""

    def message(self, text: str) -> None:
        """Do nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None


class Lines(Silent):
    """Writes one line for each finished stage, for logs and pipes."""

    def __init__(self, stream: TextIO | None = None) -> None:
        """Write to `stream`, stderr by default."""
        self._stream = stream or sys.stderr

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Write the stage's name and time."""
        self.message(f"{stage:<8} {'kept' if reused else f'{seconds:.2f} s'}")

    def message(self, text: str) -> None:
        """Write the line."""
        print(text, file=self._stream, flush=True)


class Steps(Lines):
    """Writes one line for each step too, `simulate 3/120`, for programs that show progress."""

    def __init__(self, stream: TextIO | None = None) -> None:
        """Write to `stream`, stderr by default."""
        super().__init__(stream)
        self._done: dict[str, tuple[int, int]] = {}
        self._lock = threading.Lock()

    def started(self, stage: str, steps: int) -> None:
        """Remember how many steps the stage has."""
        self._done[stage] = (0, steps)

    def stepped(self, stage: str) -> None:
        """Write which step is done."""
        with self._lock:
            done, steps = self._done[stage]
            self._done[stage] = (done + 1, steps)
            self.message(f"{stage} {done + 1}/{steps}")


class Bars:
    """Draws one bar per stage on a terminal; used as a context manager."""

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

    def __exit__(self, *_: object) -> None:
        self._rich.stop()

    def started(self, stage: str, steps: int) -> None:
        """Add the stage's bar."""
        self._tasks[stage] = self._rich.add_task(stage, total=steps, note="")

    def stepped(self, stage: str) -> None:
        """Advance the stage's bar."""
        self._rich.advance(self._tasks[stage])

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Fill the stage's bar and show the time beside it."""
        task = self._tasks[stage]
        steps = next(t.total for t in self._rich.tasks if t.id == task)
        self._rich.update(task, completed=steps, note="kept" if reused else f"{seconds:.2f} s")

    def message(self, text: str) -> None:
        """Print the line above the bars."""
        self._rich.console.print(text, markup=False, highlight=False)


def progress_for(stream: TextIO, *, quiet: bool, steps: bool = False) -> Silent | Lines | Bars:
    """Return bars for a terminal, lines for anything else, nothing when `quiet`.

    With `steps` there is a line for each step, whatever the stream is.
    """
    if steps:
        return Steps(stream)
    if quiet:
        return Silent()
    return Bars(stream) if stream.isatty() else Lines(stream)
