"""`hairkit reconstruct PHOTOS -o OUT`: turn photos of a head into a groom."""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from hairkit.cli.arguments import Add, add_shared, add_stage_settings, check_range
from hairkit.errors import InputError

if TYPE_CHECKING:
    from hairkit.types.capture import Capture
    from hairkit.types.strands import Strands

DESCRIPTION = """\
Example: hairkit reconstruct photos/ -o out/

Turn photos of a head into a groom. PHOTOS is a folder with up to 36 photos taken around the head,
in any order and direction; or the photos themselves: from one, or a few of one side, unseen hair
is continued; or a folder with photos/ and, where present, masks/, strokes/, landmarks.json and
edits.json, matched by name, and a capture.toml; or a video of one turn. OUT gets groom.npz,
scene.json, the recipe's exports, contact_sheet.png, run.json (what was done, and how good it is)
and hairkit.log. After an interruption, run it again: it continues where it stopped.
"""
SMALLEST_EDGE, LARGEST_EDGE = 128, 8192
"""Longer edges in pixels to which photos may be scaled."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    from hairkit.types.parting import PartingWord

    add("photos", nargs="*", metavar="PHOTOS", help="a folder, photos, a video, or a name")
    add("-o", "--out", required=True, metavar="OUT", help="output folder")
    add("--sample", action="store_true", help="use the capture that ships with hairkit")
    add_stage_settings(add)
    add("--head", metavar="FILE", help="your head: OBJ, PLY or GLB with a scalp")
    add("--head-units", default="m", metavar="U", help="units of the head file (default m)")
    scalp = "the scalp: a group of it, a mask picture, or transfer: the default head's"
    add("--head-scalp", metavar="NAME", help=scalp)
    add("--head-up", default="y", metavar="AXIS", help="axis that points up in it (default y)")
    words = get_args(PartingWord)
    add("--parting", choices=words, help="where the parting is (default: as the photos show it)")
    add_shared(add, "--guides", "--seed", "--max-edge")
    add_shared(add, "--plugin")
    add("--no-cache", action="store_true", help="run every stage again")
    add("--drop-work", action="store_true", help="empty OUT/work/ at the end: most of the bytes")
    add("--no-sheet", action="store_true", help="draw no contact sheet")
    add_shared(add, "--quiet", "--steps", "--json")


def run(args: argparse.Namespace) -> int:
    """Reconstruct, and print a summary."""
    from hairkit.io.capture_reader import WORKING_EDGE
    from hairkit.manager import Manager
    from hairkit.pipeline.health import summarise
    from hairkit.pipeline.reconstruct import export_paths, reconstruct
    from hairkit.pipeline.run_record import RECORD, read_record
    from hairkit.pipeline.take_capture import take_with_choices
    from hairkit.progress import progress_for
    from hairkit.types.parting import Parting

    began = time.perf_counter()
    manager = Manager.loaded(args.plugin)
    head = _head(args)
    check_range("--max-edge", args.max_edge, SMALLEST_EDGE, LARGEST_EDGE, "pixels")
    edge = args.max_edge or WORKING_EDGE
    capture, recipe = take_with_choices(_photos(args, edge), args.recipe, manager, args.set, edge)
    if args.parting is not None:
        capture = replace(capture, parting=Parting.named(args.parting))
    quiet = args.quiet or args.json
    with progress_for(sys.stderr, quiet=quiet, steps=args.steps) as shown:
        chosen = _chosen(args)
        groom = reconstruct(capture, args.out, recipe, manager, head=head, progress=shown, **chosen)
    record, exports = read_record(Path(args.out) / RECORD), export_paths(args.out, recipe, manager)
    summary = _summary(Path(args.out), groom.strands) | {
        "exports": {c.file or c.plugin: str(path) for c, path in exports},
        "roots": args.guides,
        "stages": [asdict(stage) for stage in record.stages],
        "health": [asdict(figure) for figure in record.health],
        "seconds": round(time.perf_counter() - began, 3),
    }
    if args.json:
        print(json.dumps(summary, indent=1))
    else:
        print("\n".join([_summary_text(summary), *summarise(record.health)]))
    return 0


def _chosen(args: argparse.Namespace) -> dict[str, Any]:
    """Return what the command line says of the run itself."""
    return {
        "guides": args.guides,
        "seed": args.seed,
        "reuse": not args.no_cache,
        "sheet": not args.no_sheet,
        "keep_work": not args.drop_work,
    }


def _summary(out: Path, strands: Strands) -> dict[str, Any]:
    """Return what is told of the files and the strands of the head's own hair."""
    from hairkit.pipeline.reconstruct import SHEET

    sheet, hair = out / SHEET, strands.select(~strands.planted)
    return {
        "groom": str(out / "groom.npz"),
        "scene": str(out / "scene.json"),
        "contact_sheet": str(sheet) if sheet.exists() else None,
        "strands": len(hair),
        "mean_length_m": round(float(hair.lengths().mean()), 4),
    }


def _photos(args: argparse.Namespace, edge: int) -> Capture | str:
    from hairkit.io.capture_reader import read_files, sample_folder

    if args.sample == bool(args.photos):
        raise InputError("give either photos or --sample")
    if len(args.photos) > 1:
        return read_files([Path(photo) for photo in args.photos], edge)
    return str(sample_folder()) if args.sample else str(args.photos[0])


def _head(args: argparse.Namespace) -> Any:
    if args.head is None:
        return None
    from hairkit.io.head_reader import HeadFile

    return HeadFile(args.head, args.head_units, args.head_scalp, args.head_up)


def _summary_text(summary: dict[str, Any]) -> str:
    files = [summary["groom"], summary["scene"], *summary["exports"].values()]
    files += [summary["contact_sheet"]] if summary["contact_sheet"] else []
    return "\n".join(
        [
            f"{summary['strands']} guides of {summary['roots']} roots,"
            f" mean length {100 * summary['mean_length_m']:.1f} cm, in {summary['seconds']:.1f} s",
            *files,
        ]
    )
