"""Opens what the user names: a groom, a file that an import plugin reads, a folder of results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hairkit.cli.export import plugin_for
from hairkit.errors import InputError
from hairkit.groom import Groom
from hairkit.groom_file import read_groom
from hairkit.manager import Manager


@dataclass(frozen=True, eq=False)
class Opened:
    """A groom and where it came from."""

    groom: Groom
    path: Path
    results: Path | None
    """The folder that `hairkit reconstruct` wrote, when the groom lies in one."""


def open_path(path: Path, manager: Manager) -> Opened:
    """Open a groom.npz, a folder that holds one, or a file that an import plugin reads.

    Raises
    ------
    InputError
        There is no such file, or nothing that reads it.
    """
    if path.is_dir():
        if not (path / "groom.npz").is_file():
            raise InputError(f"{path}: no groom.npz in this folder; run hairkit reconstruct first")
        path = path / "groom.npz"
    if not path.exists():
        raise InputError(f"{path}: no such file; expected a groom.npz or an importable file")
    if path.suffix == ".npz":
        groom = read_groom(path)
    else:
        groom = manager.call("import_groom", plugin_for(manager, "import_groom", path), path=path)
    results = path.parent if (path.parent / "work").is_dir() else None
    return Opened(groom, path, results)
