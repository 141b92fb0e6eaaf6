"""Hair files of other authors, which do not ship with the project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def reference(name: str) -> Path:
    """Return such a file, beside the captures that HAIRKIT_CAPTURES names; skip without it."""
    named = os.environ.get("HAIRKIT_CAPTURES")
    folder = Path(named).parent if named else Path(__file__).parents[2] / "shared"
    path = folder / "reference" / name
    if not path.exists():
        pytest.skip(f"no {path.name} in {path.parent}; HAIRKIT_CAPTURES names the folder beside it")
    return path
