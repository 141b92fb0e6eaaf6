"""`hairkit export GROOM -o FILE`: write a groom in an engine's format."""

from __future__ import annotations

import argparse
from pathlib import Path

from hairkit.api import export_for
from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.settings import importer_of, split_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError
from hairkit.grooming.engine_files import ENGINES
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import load_groom, plugin_for

DESCRIPTION = """\
Example: hairkit export out/groom.npz -o hair.apx

Write a groom in the format of the file's suffix, or with --for all files that an engine takes, as
its page in the documentation says: `hairkit export out/groom.npz --for unreal -o unreal/`. `hairkit
plugins --formats` lists what each format carries; `hairkit convert` has more options for the input
file."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("groom", metavar="GROOM", type=Path, help="groom.npz, or a file that a plugin reads")
    add("-o", "--out", required=True, metavar="FILE", help="file to write, with --for a folder")
    add("--for", dest="engine", choices=tuple(ENGINES), help=f"engine: {', '.join(ENGINES)}")
    add_shared(add, "--set", "--using", "--plugin", "--json")


def run(args: argparse.Namespace) -> int:
    """Export, and print the file's name."""
    manager = Manager.loaded(args.plugin)
    source, target = args.groom, Path(args.out)
    if args.engine is not None:
        return _run_for_engine(args, manager)
    exporter = args.using or plugin_for(manager, "export_groom", target)
    manager.implementer("export_groom", exporter)
    plugins = {"reader": importer_of(manager, source), "writer": exporter}
    settings = split_settings(manager, plugins, args.set)
    options = manager.options(exporter, settings["writer"])
    check_target(target, source)
    groom = load_groom(manager, source, settings["reader"])
    manager.call("export_groom", exporter, options, groom=groom, path=target)
    print_written(args, target)
    return 0


def _run_for_engine(args: argparse.Namespace, manager: Manager) -> int:
    """Export all files of an engine, and print their names."""
    if args.using is not None:
        raise InputError(f"--for {args.engine} chooses the plugins; leave --using out")
    reader = importer_of(manager, args.groom)
    settings = split_settings(manager, {"reader": reader}, args.set)["reader"]
    if Path(args.out).is_dir():
        for file in ENGINES[args.engine]:
            check_target(Path(args.out, file.name), args.groom)
    groom = load_groom(manager, args.groom, settings)
    print_written(args, *export_for(groom, args.engine, args.out, manager=manager))
    return 0
