"""Photos in a folder, with masks, strokes, landmarks and `capture.toml` where they are beside.

Photos that were taken through the pages of the studio lie in such a folder, too.
"""

from __future__ import annotations

from hairkit import Capture, hookimpl
from hairkit.io.capture_reader import read_folder


@hookimpl
def capture(source: str, max_edge: int) -> Capture:
    """Return the capture in a folder; `InputError` says what is wrong with it."""
    return read_folder(source, max_edge)
