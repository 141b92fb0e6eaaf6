"""Files of photos: which they are, their order, and what tells that one changed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

_SUFFIXES = (".jpg", ".jpeg", ".png", ".heic", ".heif")


def is_photo(path: Path) -> bool:
    """Return whether a file is a photo of a project."""
    return path.suffix.lower() in _SUFFIXES and not path.name.startswith(".") and path.is_file()


def natural(path: Path) -> list[Any]:
    """Return a key by which `2.jpg` is before `10.jpg`."""
    pieces = re.split(r"(\d+)", path.name.lower())
    return [int(piece) if piece.isdigit() else piece for piece in pieces]


def facts_of(file: Path) -> list[Any]:
    """Return name, size and time of a file: a JSON list that changes when the file does."""
    facts = file.stat()
    return [file.name, facts.st_size, facts.st_mtime_ns]
