"""`hairkit head PHOTOS -o head.glb`: the person's head from photos, without hair."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hairkit.cli.arguments import Add, add_shared, add_stage_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError

DESCRIPTION = """\
Example: hairkit head photos/ -o head.glb

Fit the head to photos and take its skin from them. PHOTOS is what hairkit reconstruct takes. The
ending says the format: .glb and .fbx (skeleton and texture inside), .obj (with .mtl and picture) or
.npz."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("photos", metavar="PHOTOS", help="folder of the photos, or a video")
    add("-o", "--output", type=Path, required=True, metavar="FILE", help="file of the head")
    add_stage_settings(add)
    add_shared(add, "--plugin", "--quiet", "--json")


def run(args: argparse.Namespace) -> int:
    """Fit, write, and print the file's name."""
    from hairkit.manager import Manager
    from hairkit.pipeline.head_alone import ENDINGS, photograph_head, write_head
    from hairkit.pipeline.take_capture import take_with_choices
    from hairkit.progress import progress_for

    if args.output.suffix.lower() not in ENDINGS:
        raise InputError(f"{args.output}: a head is written as {', '.join(ENDINGS)}")
    check_target(args.output)
    manager = Manager.loaded(args.plugin)
    photos, recipe = take_with_choices(args.photos, args.recipe, manager, args.set)
    with progress_for(sys.stderr, quiet=args.quiet or args.json) as shown:
        scene = photograph_head(photos, recipe, manager, progress=shown)
    write_head(args.output, scene.head, manager)
    print_written(args, args.output)
    return 0
