"""`hairkit validate FILE --for TARGET`: check a hair file against what a program demands of it."""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from typing import Any

from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.reader_settings import add_reader_arguments, reader_settings
from hairkit.cli.settings import split_settings
from hairkit.errors import FormatError, InputError, one_line
from hairkit.grooming.target_rules import TARGETS, check_groom
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import load_groom, plugin_for
from hairkit.types.finding import Finding

DESCRIPTION = """\
Example: hairkit validate hair.abc --for unreal

Check a hair file against every rule that is known of a program: format, unit, axes, numbers of
points, groups, guides, widths, roots. One line a rule: passed, warning or failed. Plugins add rules
of their own by the hook validate_groom. The exit code is 0 where no rule failed, else 4."""

BROKEN = 4
"""Exit code where a rule failed."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("file", metavar="FILE", type=Path, help="file that a plugin imports")
    add("--for", dest="target", required=True, choices=tuple(TARGETS), help=", ".join(TARGETS))
    add_reader_arguments(add)
    add_shared(add, "--set", "--json")


def run(args: argparse.Namespace) -> int:
    """Print one line for each rule."""
    if not args.file.is_file():
        raise InputError(f"{args.file}: no such file")
    found = _findings(args)
    if args.json:
        print(json.dumps([dataclasses.asdict(finding) for finding in found], indent=1))
    else:
        width = max(len(finding.rule) for finding in found)
        for finding in found:
            print(f"{finding.level:8}{finding.rule:{width + 2}}{one_line(finding.text)}")
    return BROKEN if any(finding.level == "failed" for finding in found) else 0


def _findings(args: argparse.Namespace) -> list[Finding]:
    manager = Manager.loaded(args.plugin)
    reader = args.reader or plugin_for(manager, "import_groom", args.file)
    given = split_settings(manager, {"reader": reader}, args.set)["reader"]
    settings = reader_settings(manager, reader, args) | given
    as_target = dict(TARGETS[args.target].reading) if args.file.suffix.lower() == ".abc" else {}
    try:
        groom = load_groom(manager, args.file, as_target | settings, reader)
    except (FormatError, InputError) as error:
        if as_target and _reads(manager, args.file, settings, reader):
            wanted = " ".join(f"--set {name}={value}" for name, value in as_target.items())
            said = f"not in the axes and the unit that {args.target} reads; export with {wanted}"
            return [Finding("unit", "failed", said)]
        return [Finding("reads", "failed", one_line(error))]
    read = Finding("reads", "passed", f"{len(groom.strands)} strands")
    rules = check_groom(groom, args.file, args.target)
    return [read, *rules, *manager.findings(groom, args.file, args.target)]


def _reads(manager: Manager, file: Path, settings: dict[str, Any], reader: str) -> bool:
    try:
        load_groom(manager, file, settings, reader)
    except (FormatError, InputError):
        return False
    return True
