"""What verbs that write files print: the files' names, or with `--json` one JSON document."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hairkit.errors import InputError


def print_written(
    args: argparse.Namespace, *files: str | os.PathLike[str], lines: Sequence[str] = (), **more: Any
) -> None:
    """Print the names of files, one a line; with `--json` as `files`, beside further figures.

    `lines` are printed in the place of the names, where the verb says more about its files.
    """
    names = [os.fspath(file) for file in files]
    if args.json:
        print(json.dumps({"files": names, **more}, indent=1))
    else:
        print("\n".join(lines or names))


def check_target(path: Path, source: Path | None = None) -> None:
    """Raise `InputError` if a file cannot be written there, or is the one that will be read."""
    if not path.parent.is_dir():
        raise InputError(f"{path.parent}: no such folder; make it first")
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file")
    if source is not None and path.exists() and source.exists() and path.samefile(source):
        raise InputError(f"{path}: is the input file; choose another output")
