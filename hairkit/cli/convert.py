"""`hairkit convert IN OUT`: read hair of any format and write it in any other."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.reader_settings import add_reader_arguments, reader_settings
from hairkit.cli.settings import split_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError
from hairkit.grooming.decimate import decimate
from hairkit.grooming.guide_weights import guide_mask
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import load_groom, plugin_for
from hairkit.types.groom import Groom

DESCRIPTION = """\
Example: hairkit convert a.tfx b.abc --scale 0.0023 --up y

Read a file of one format and write it in another; suffixes choose the formats. What the input lacks
(head, widths, root uv) gets default values, with a message. `hairkit plugins --formats` lists what
each format carries."""

CURLS = 400
"""Strands at most whose curl is measured."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("source", metavar="IN", type=Path, help="file of any format that a plugin imports")
    add("target", metavar="OUT", type=Path, help="file of any format that a plugin exports")
    add_reader_arguments(add)
    guides = "mark N strands of full hair as its guides; with --set writer.strands=guides write"
    add("--guides", type=int, metavar="N", help=f"{guides} these only")
    curl = "measure the strands' waves or coils for the material (HairWorks draws them)"
    add("--measure-curl", action="store_true", help=curl)
    add("--to", metavar="PLUGIN", help="export plugin (default: by suffix)")
    add_shared(add, "--set", "--json")


def run(args: argparse.Namespace) -> int:
    """Convert, and print one line about what was written."""
    start = time.perf_counter()
    manager, source, target = Manager.loaded(args.plugin), args.source, args.target
    if not source.exists():
        raise InputError(f"{source}: no such file")
    reader = args.reader or plugin_for(manager, "import_groom", source)
    writer = args.to or plugin_for(manager, "export_groom", target)
    manager.implementer("import_groom", reader)
    manager.implementer("export_groom", writer)
    settings = split_settings(manager, {"reader": reader, "writer": writer}, args.set)
    reading = reader_settings(manager, reader, args) | settings["reader"]
    options = manager.options(writer, settings["writer"])
    check_target(target, source)
    groom = load_groom(manager, source, reading, reader)
    if args.guides is not None:
        groom = decimate(groom, args.guides)
    if args.measure_curl:
        groom = _with_curl(groom)
    manager.call("export_groom", writer, options, groom=groom, path=target)
    said = _summary(groom, target, time.perf_counter() - start)
    print_written(args, target, lines=[said], strands=len(groom.strands))
    return 0


def _with_curl(groom: Groom) -> Groom:
    """Return the groom with the median radius and pitch of its strands, or a sample of them."""
    from hairkit.helices import measure_curl

    count = min(len(groom.strands), CURLS)
    some = groom.strands.select(np.linspace(0, len(groom.strands) - 1, count).astype(np.int64))
    return replace(groom, material=measure_curl(some).written_to(groom.material))


def _summary(groom: Groom, target: Path, seconds: float) -> str:
    strands = groom.strands
    size = np.ptp(strands.points, axis=0)
    return (
        f"{target}: {len(strands)} strands, {len(strands.points)} points,"
        f" {np.count_nonzero(guide_mask(strands))} guides,"
        f" {' x '.join(f'{length:.3f}' for length in size)} m, in {seconds:.2f} s"
    )
