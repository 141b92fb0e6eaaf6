"""The table of a batch on a terminal: who is at work, what is done, what failed."""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from typing import Any, Self, TextIO

from hairkit.batches.jobs import FAILED, Result
from hairkit.batches.pool import Watcher
from hairkit.progress import Lines

REDRAWS_HZ = 4
"""Pictures of the table in a second."""


class BatchTable(Watcher):
    """Shows nothing; used as a context manager, as all tables are."""

    def ended(self, result: Result) -> None:
        """A capture is done, or has failed."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None


class ResultLines(BatchTable):
    """Writes one line for each capture that has ended, for logs and pipes."""

    def __init__(self, stream: TextIO) -> None:
        self._lines = Lines(stream)

    def ended(self, result: Result) -> None:
        """Write the line."""
        self._lines.message(line_of(result))


class LiveTable(BatchTable):
    """Draws captures that are at work, and counts the others; used as a context manager."""

    def __init__(self, stream: TextIO, count: int) -> None:
        """Draw on a terminal a batch of so many captures."""
        from rich.console import Console
        from rich.live import Live

        self._count = count
        self._running: dict[str, tuple[float, str]] = {}
        self._states: Counter[str] = Counter()
        self._began = time.monotonic()
        self._guard = threading.Lock()
        self._live = Live(
            console=Console(file=stream),
            refresh_per_second=REDRAWS_HZ,
            get_renderable=self._drawn,
            transient=True,
        )

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def started(self, name: str) -> None:
        """Add a row."""
        with self._guard:
            self._running[name] = (time.monotonic(), "")

    def stage(self, name: str, stage: str) -> None:
        """Show the stage in the row."""
        with self._guard:
            if name in self._running:
                self._running[name] = (self._running[name][0], stage)

    def ended(self, result: Result) -> None:
        """Take the row away; print why where it failed."""
        with self._guard:
            self._running.pop(result.name, None)
            self._states[result.state] += 1
        if result.state == FAILED:
            self._live.console.print(line_of(result), markup=False, highlight=False)

    def _drawn(self) -> Any:
        from rich.table import Table

        with self._guard:
            running, states = dict(self._running), Counter(self._states)
        ended, now = sum(states.values()), time.monotonic()
        table = Table(title=f"{ended} of {self._count} captures", title_justify="left")
        for heading in ("capture", "stage", "seconds"):
            table.add_column(heading)
        for name, (began, stage) in running.items():
            table.add_row(name, stage, f"{now - began:.0f}")
        each = (now - self._began) / ended if ended else 0.0
        left = f", about {each * (self._count - ended):.0f} s left" if ended else ""
        table.caption = ", ".join(f"{n} {state}" for state, n in sorted(states.items())) + left
        return table


def line_of(result: Result) -> str:
    """Return a result in one line."""
    end = f": {result.error}" if result.error else ""
    return f"{result.state:<6} {result.name} {result.seconds:.1f} s{end}"


def table_for(stream: TextIO | None, count: int, *, quiet: bool) -> BatchTable:
    """Return a table for a terminal, lines for anything else, nothing when `quiet`."""
    stream = stream or sys.stderr
    if quiet:
        return BatchTable()
    return LiveTable(stream, count) if stream.isatty() else ResultLines(stream)
