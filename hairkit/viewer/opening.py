"""Open a groom file, a file that an import plugin reads, or a results folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import groom_path, load_groom
from hairkit.types.groom import Groom


@dataclass(frozen=True, eq=False)
class Opened:
    """A groom and where it came from."""

    groom: Groom
    path: Path
    results: Path | None
    """The folder that `hairkit reconstruct` wrote, if the groom is in one."""


def open_path(path: Path, manager: Manager, settings: Mapping[str, object] | None = None) -> Opened:
    """Open a groom.npz, a folder that holds one, or a file that an import plugin reads.

    `settings` are options of the import plugin.

    Raises
    ------
    InputError
        The file does not exist, no plugin reads it, or it holds no strands.
    """
    path = groom_path(path)
    groom = load_groom(manager, path, settings)
    if not len(groom.strands):
        raise InputError(f"{path}: holds no strands, expected at least one; open another file")
    results = path.parent if (path.parent / "work").is_dir() else None
    return Opened(groom, path, results)
