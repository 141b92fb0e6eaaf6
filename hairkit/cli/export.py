"""`hairkit export GROOM -o FILE`: write a groom in an engine's format."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from hairkit.errors import InputError, OptionError

_DESCRIPTION = """\
Example: hairkit export out/groom.npz -o hair.apx

Write a groom in the format that the file's ending names. `hairkit plugins export_groom` lists the
formats."""


def register(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "export", help="write a groom in an engine's format", description=_DESCRIPTION
    )
    add = parser.add_argument
    add("groom", metavar="GROOM", help="groom.npz, or a file that an import plugin reads")
    add("-o", "--out", required=True, metavar="FILE", help="file to write")
    add("--set", action="append", default=[], metavar="X=V", help="option=V of the export plugin")
    add("--using", metavar="NAME", help="export plugin; by default the one of the file's ending")
    add("--plugin", action="append", default=[], metavar="FILE", help="load a plugin file too")


def run(args: argparse.Namespace) -> int:
    """Export, and print the file's name."""
    from hairkit.groom_file import read_groom
    from hairkit.manager import Manager

    manager = Manager.loaded(args.plugin)
    source, target = Path(args.groom), Path(args.out)
    exporter = args.using or plugin_for(manager, "export_groom", target)
    options = manager.options(exporter, _settings(exporter, args.set))
    if not target.parent.is_dir():
        raise InputError(f"{target.parent}: no such folder; make it first")
    if source.suffix == ".npz" or not source.exists():
        groom = read_groom(source)
    else:
        groom = manager.call(
            "import_groom", plugin_for(manager, "import_groom", source), path=source
        )
    manager.call("export_groom", exporter, options, groom=groom, path=target)
    print(target)
    return 0


def plugin_for(manager: Any, stage: str, path: Path) -> str:
    """Return the plugin of the longest ending that fits the file's name."""
    fitting = [
        (len(suffix), name)
        for name in manager.names(stage)
        for suffix in manager.info(name).suffixes
        if path.name.lower().endswith(suffix)
    ]
    if not fitting:
        known = sorted({s for name in manager.names(stage) for s in manager.info(name).suffixes})
        raise InputError(f"{path}: no plugin for files of this name; known: {', '.join(known)}")
    return str(max(fitting)[1])


def _settings(exporter: str, assignments: list[str]) -> dict[str, object]:
    """Take `option=value` and `plugin.option=value` texts apart."""
    values: dict[str, object] = {}
    for text in assignments:
        target, equals, value = (part.strip() for part in text.partition("="))
        name = target.removeprefix(f"{exporter}.")
        if not equals or not name:
            raise OptionError(f"--set {text}: expected option=value of {exporter}")
        values[name] = value
    return values
