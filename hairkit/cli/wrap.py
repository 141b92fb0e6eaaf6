"""`hairkit wrap GROOM --head OTHER -o FILE`: a groom carried to another head."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.settings import importer_of, split_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError
from hairkit.io.head_reader import UNITS, BareHead, read_bare_head
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import load_groom, plugin_for
from hairkit.types.groom import Groom

DESCRIPTION = """\
Example: hairkit wrap out/groom.npz --head other.glb -o other_hair.abc

Carry a groom to another head of any mesh, found by its shape alone: roots onto its surface, scalp
and roots' texture coordinates with them, strands outside it at their lengths. The hair stays where
that head is in its file. --head takes .obj, .ply, .glb, or a groom's .npz for the head in it; -o
takes every format that hairkit exports.

More examples:
  hairkit wrap hair.apx --head metahuman.obj --units cm -o wrapped.npz
  hairkit wrap out/groom.npz --head other.obj --up z -o wrapped.usda --keep-root-uv
  hairkit wrap out/groom.npz --head other.glb -o hair.abc --source-head source.fbx"""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("groom", metavar="GROOM", type=Path, help="groom.npz, or a file that a plugin reads")
    add("--head", type=Path, required=True, metavar="FILE", help="the other head")
    add("-o", "--out", type=Path, required=True, metavar="FILE", help="file to write")
    add("--units", choices=tuple(UNITS), default="m", help="unit of the head's file (m)")
    add("--up", choices=("y", "z"), default="y", help="up axis of the head's file (y)")
    add("--scalp", metavar="NAME", help="group or mask picture that is the head's scalp")
    add("--keep-root-uv", action="store_true", help="keep the roots' texture coordinates")
    add("--source-head", type=Path, metavar="FILE", help="write the groom's own head too (.fbx)")
    add_shared(add, "--set", "--using", "--plugin", "--json")


def run(args: argparse.Namespace) -> int:
    """Wrap, write, and print one line about the fit."""
    from hairkit.grooming.wrap import wrap_groom
    from hairkit.pipeline.head_alone import write_head

    start = time.perf_counter()
    manager, source = Manager.loaded(args.plugin), args.groom
    exporter = args.using or plugin_for(manager, "export_groom", args.out)
    manager.implementer("export_groom", exporter)
    plugins = {"reader": importer_of(manager, source), "writer": exporter}
    settings = split_settings(manager, plugins, args.set)
    options = manager.options(exporter, settings["writer"])
    for target in (args.out, args.source_head):
        if target is not None:
            check_target(target)
    head = _read(args)
    groom = load_groom(manager, source, settings["reader"])
    wrapped = wrap_groom(groom, head, keep_root_uv=args.keep_root_uv)
    manager.call("export_groom", exporter, options, groom=wrapped, path=args.out)
    if args.source_head is not None:
        write_head(args.source_head, groom.head, manager)
    said = f"{args.out}: {_summary(groom, wrapped)}, in {time.perf_counter() - start:.1f} s"
    heads = [] if args.source_head is None else [args.source_head]
    print_written(args, args.out, *heads, lines=[said], strands=len(wrapped.strands))
    return 0


def _read(args: argparse.Namespace) -> BareHead:
    if not args.head.is_file():
        raise InputError(f"{args.head}: no such file")
    if args.head.suffix.lower() != ".npz":
        return read_bare_head(args.head, args.units, args.scalp, args.up)
    return BareHead.of(Groom.load(args.head).head)


def _summary(groom: Groom, wrapped: Groom) -> str:
    from hairkit.head_model.signed_distance import distance_to

    depth = -1e3 * float(distance_to(wrapped.head, wrapped.strands.points).min())
    change = abs(wrapped.strands.lengths().mean() / groom.strands.lengths().mean() - 1)
    scalp = np.count_nonzero(wrapped.head.scalp > 0.5)
    return (
        f"{len(wrapped.strands)} strands on a head of {len(wrapped.head.vertices)} vertices,"
        f" {scalp} of them scalp; deepest point {max(depth, 0):.2f} mm, lengths changed by"
        f" {change:.2%}"
    )
