"""Open a groom from any file that a plugin reads, or from a folder of results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.types.groom import Groom
from hairkit.types.point_cache import is_cache_file


def load_groom(
    manager: Manager,
    path: Path,
    settings: Mapping[str, object] | None = None,
    plugin: str | None = None,
) -> Groom:
    """Return the groom in a file.

    Parameters
    ----------
    manager
        The plugins.
    path
        A groom.npz, a folder that holds one, or a file of any format that a plugin imports.
    settings
        Options of the import plugin by name.
    plugin
        The import plugin; by default the one of the file's ending.

    Raises
    ------
    InputError
        The file does not exist, or no plugin reads it.
    """
    path = groom_path(path)
    if is_cache_file(path):
        raise InputError(
            f"{path}: a simulation (point cache), not a groom; give the groom that was simulated,"
            f" as in hairkit render GROOM --cache {path.name}"
        )
    if plugin is None and path.suffix == ".npz" and not settings:
        return Groom.load(path)
    name = plugin or plugin_for(manager, "import_groom", path)
    options = manager.options(name, settings or {})
    groom = manager.call("import_groom", name, options, path=path)
    if not isinstance(groom, Groom):  # the manager has checked it; this is for mypy
        raise InputError(f"{path}: {name} returned no groom")
    return groom


def groom_path(path: Path) -> Path:
    """Return the file, or the groom.npz in the folder; raises `InputError` when it is missing."""
    if path.is_dir():
        if not (path / "groom.npz").is_file():
            raise InputError(f"{path}: no groom.npz in this folder; run hairkit reconstruct first")
        return path / "groom.npz"
    if not path.exists():
        raise InputError(f"{path}: no such file")
    return path


def plugin_for(manager: Manager, stage: str, path: Path) -> str:
    """Return the plugin whose longest suffix matches the file's name."""
    fitting = [
        (len(suffix), name)
        for name in manager.names(stage)
        for suffix in manager.info(name).suffixes
        if path.name.lower().endswith(suffix)
    ]
    if not fitting:
        known = sorted({s for name in manager.names(stage) for s in manager.info(name).suffixes})
        what = "reads" if stage == "import_groom" else "writes"
        raise InputError(f"{path}: no plugin {what} this suffix; known: {', '.join(known)}")
    return str(max(fitting)[1])
