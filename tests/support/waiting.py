"""Waiting for what another process does."""

from __future__ import annotations

import time
from pathlib import Path


def wait_for(folder: Path, pattern: str, seconds: float = 30) -> None:
    """Wait until a file appears."""
    end = time.monotonic() + seconds
    while not list(folder.glob(pattern)):
        assert time.monotonic() < end, f"no {pattern} in {folder}"
        time.sleep(0.01)
