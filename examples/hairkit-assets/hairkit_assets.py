"""Captures from a studio's asset database: `asset:NAME` is a row of the table `captures`."""

import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from hairkit import Capture, hookimpl
from hairkit.errors import InputError
from hairkit.io.capture_reader import read_folder
from hairkit.options import option


@dataclass(frozen=True)
class Options:
    """Where the studio keeps its assets."""

    database: Path = option(Path("/studio/assets.db"), doc="SQLite: captures(name, folder).")


@hookimpl
def capture(source: str, max_edge: int, options: Options) -> Capture | None:
    """Return the photos of an asset, None for what is none."""
    if not source.startswith("asset:"):
        return None
    with closing(sqlite3.connect(options.database)) as database:
        rows = database.execute("SELECT folder FROM captures WHERE name = ?", [source[6:]])
        for (folder,) in rows:
            return read_folder(folder, max_edge)
    raise InputError(f"{options.database}: no {source}; add it to the table captures")
