"""Photos in a folder, or a video, at a URL: `s3://bucket/captures/anna`, fetched by fsspec."""

from __future__ import annotations

from hairkit import Capture, hookimpl
from hairkit.io.capture_reader import read_capture
from hairkit.remote import fetch, is_url


@hookimpl
def capture(source: str, max_edge: int) -> Capture | None:
    """Return the capture at a URL, None for a path."""
    return read_capture(fetch(source), max_edge) if is_url(source) else None
