"""Options of the verbs that read hair of any format: what bare strands do not define."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from hairkit.cli.arguments import Add, add_shared
from hairkit.errors import OptionError

if TYPE_CHECKING:
    from hairkit.manager import Manager

UP = {"y": "y_up_metres", "z": "z_up_metres"}
"""Axis option of the reader for each way up."""


def add_reader_arguments(add: Add) -> None:
    """Add options about the file to read."""
    add("--scale", metavar="M", help="metres per unit of the input file")
    add("--up", choices=tuple(UP), help="up axis of the input file")
    add("--head", metavar="FILE", help="head to put under the strands")
    add("--from", dest="reader", metavar="PLUGIN", help="import plugin (default: by suffix)")
    add_shared(add, "--plugin")


def reader_settings(manager: Manager, reader: str, args: argparse.Namespace) -> dict[str, object]:
    """Return the reader's options for --scale, --up and --head."""
    known = {option.name for option in manager.info(reader).options}
    wanted = {
        "scale": ("--scale", args.scale),
        "axis": ("--up", None if args.up is None else UP[args.up]),
        "head": ("--head", args.head),
    }
    given = {name: word for name, (word, value) in wanted.items() if value is not None}
    missing = [word for name, word in given.items() if name not in known]
    if missing:
        raise OptionError(
            f"{missing[0]}: files of plugin {reader!r} define it themselves; leave it out"
        )
    return {name: wanted[name][1] for name in given}
