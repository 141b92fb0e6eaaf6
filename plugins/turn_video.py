"""A video of one turn around the head: its sharpest frames, at even steps of the turn."""

from __future__ import annotations

from pathlib import Path

from hairkit import Capture, hookimpl
from hairkit.io.video import is_video, read_video


@hookimpl
def capture(source: str, max_edge: int) -> Capture | None:
    """Return frames of a video, None for anything else."""
    path = Path(source)
    return read_video(path, max_edge) if is_video(path) else None
