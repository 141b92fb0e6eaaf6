"""Hair files of other authors, which do not ship with the project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

VARIABLE = "HAIRKIT_REFERENCE_FILES"
"""Environment variable that names their folder; inside, most formats have a folder each."""


def reference(name: str) -> Path:
    """Return the path of a file below that folder; skip the test where it is not there."""
    folder = os.environ.get(VARIABLE)
    if not folder:
        pytest.skip(f"{VARIABLE} names no folder of files from other programs")
    path = Path(folder) / name
    if not path.exists():
        pytest.skip(f"no {path.name} in {path.parent}")
    return path
