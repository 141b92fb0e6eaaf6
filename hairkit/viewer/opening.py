"""Opens what the user names: a groom, a file that an import plugin reads, a folder of results."""

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
    """The folder that `hairkit reconstruct` wrote, when the groom lies in one."""


def open_path(path: Path, manager: Manager, settings: Mapping[str, object] | None = None) -> Opened:
    """Open a groom.npz, a folder that holds one, or a file that an import plugin reads.

    `settings` are options of that plugin.

    Raises
    ------
    InputError
        There is no such file, nothing that reads it, or no hair in it.
    """
    path = groom_path(path)
    groom = load_groom(manager, path, settings)
    if not len(groom.strands):
        raise InputError(f"{path}: holds no strands, so there is nothing to show")
    results = path.parent if (path.parent / "work").is_dir() else None
    return Opened(groom, path, results)
