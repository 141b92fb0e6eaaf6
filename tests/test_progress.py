"""Progress is told in bars, in lines, or not at all."""

from __future__ import annotations

import io

import pytest

from hairkit.pipeline.run_log import RunLog, StageTime
from hairkit.progress import Bars, Lines, Progress, Silent, Steps, progress_for


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        """Say so."""
        return True


def tell(progress: Progress) -> None:
    """Tell of two stages that overlap, the second kept from an earlier run."""
    progress.started("segment", 2)
    progress.started("scene", 1)
    progress.stepped("segment")
    progress.message("[by the way]")
    progress.finished("scene", 0.0, True)
    progress.stepped("segment")
    progress.finished("segment", 1.234, False)


def test_the_stream_decides_between_bars_and_lines() -> None:
    """A terminal gets bars, a pipe lines, and nobody gets anything with `quiet`."""
    assert isinstance(progress_for(Terminal(), quiet=False), Bars)
    assert isinstance(progress_for(io.StringIO(), quiet=False), Lines)
    assert isinstance(progress_for(Terminal(), quiet=True), Silent)
    assert isinstance(progress_for(Terminal(), quiet=True, steps=True), Steps)


def test_steps_are_lines_too() -> None:
    """One line a step, with how many there are, and one for the end of the stage."""
    stream = io.StringIO()
    with Steps(stream) as progress:
        tell(progress)
    assert stream.getvalue().splitlines() == [
        "segment 1/2",
        "[by the way]",
        "scene    kept",
        "segment 2/2",
        "segment  1.23 s",
    ]


def test_lines_name_every_stage_with_its_time() -> None:
    """One line a stage, when it ends."""
    stream = io.StringIO()
    with Lines(stream) as progress:
        tell(progress)
    assert stream.getvalue() == "[by the way]\nscene    kept\nsegment  1.23 s\n"


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_bars_show_every_stage_with_its_time(stream: io.StringIO) -> None:
    """Stage names, times and messages appear, the messages as they are."""
    with progress_for(Terminal(), quiet=False) as progress:
        tell(progress)
    with Bars(stream) as bars:
        tell(bars)
    for text in ("segment", "1.23 s", "scene", "kept", "[by the way]"):
        assert text in stream.getvalue()


def test_a_runs_log_keeps_the_times_and_passes_all_on() -> None:
    """What is recorded is also told."""
    stream = io.StringIO()
    log = RunLog(Lines(stream))
    tell(log)
    assert log.stages == [StageTime("scene", 0.0, True), StageTime("segment", 1.234, False)]
    assert len(stream.getvalue().splitlines()) == 3
