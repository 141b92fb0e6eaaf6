"""`hairkit edit GROOM --brush NAME -o FILE`: a groom after strokes of brushes."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.settings import importer_of, split_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.options import describe, make_options
from hairkit.pipeline.open_groom import load_groom, plugin_for
from hairkit.types.edits import Brush, Edit, Edits, read_edits

DESCRIPTION = """\
Example: hairkit edit groom.npz --brush trim --amount 0.03 -o short.npz

Brush all hair of a groom, or do the strokes of an edits.json, or both: strokes first. Brushes and
amounts are listed in docs/touching_up.md; -o takes every format that hairkit exports."""

_OPTIONS = [info for info in describe(Brush) if info.name not in ("radius", "mirror")]
"""All but those of strokes along a path."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("groom", metavar="GROOM", type=Path, help="groom.npz, or a file that a plugin reads")
    for info in _OPTIONS:
        add(f"--{info.name}", metavar="V", help=f"{info.doc} ({info.wanted})")
    add("--strokes", type=Path, metavar="FILE", help="do the strokes of an edits.json")
    add("-o", "--out", type=Path, required=True, metavar="FILE", help="file to write")
    add_shared(add, "--set", "--plugin", "--json")


def run(args: argparse.Namespace) -> int:
    """Brush, write, and print a line about the hair."""
    from hairkit.grooming.brushes import edit_groom

    edits, manager = _edits(args), Manager.loaded(args.plugin)
    exporter = plugin_for(manager, "export_groom", args.out)
    plugins = {"reader": importer_of(manager, args.groom), "writer": exporter}
    settings = split_settings(manager, plugins, args.set)
    options = manager.options(exporter, settings["writer"])
    check_target(args.out)
    made = edit_groom(load_groom(manager, args.groom, settings["reader"]), edits)
    manager.call("export_groom", exporter, options, groom=made, path=args.out)
    length = 100 * float(made.strands.lengths().mean())
    said = f"{args.out}: {len(made.strands)} strands, mean length {length:.1f} cm"
    print_written(args, args.out, lines=[said], strands=len(made.strands))
    return 0


def _edits(args: argparse.Namespace) -> Edits:
    if args.strokes is not None and not args.strokes.is_file():
        raise InputError(f"{args.strokes}: no such file")
    strokes = () if args.strokes is None else read_edits(args.strokes).strokes
    given = {info.name: getattr(args, info.name) for info in _OPTIONS}
    given = {name: value for name, value in given.items() if value is not None}
    if given and args.brush is None:
        raise InputError(f"--{next(iter(given))} is of a brush; give --brush NAME, too")
    if given:
        strokes += (Edit(np.zeros((0, 3), np.float32), make_options(Brush, given, "edit")),)
    if not strokes:
        raise InputError("nothing to do; give --brush NAME or --strokes edits.json")
    return Edits(strokes)
