"""hairkit's own groom file, `.npz`: lossless, and readable by anything that has NumPy."""

from __future__ import annotations

from pathlib import Path

from hairkit import Groom, hookimpl
from hairkit.groom_file import read_groom, write_groom

SUFFIXES = (".npz",)


@hookimpl
def export_groom(groom: Groom, path: Path) -> bool:
    """Write everything that is on the groom."""
    write_groom(path, groom)
    return True


@hookimpl
def import_groom(path: Path) -> Groom:
    """Read the groom exactly as it was written."""
    return read_groom(path)
