"""`hairkit synth STYLE -o DIR`: grow a procedural groom and photograph it, with its truth."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hairkit.cli.arguments import LARGEST_SEED, Add, add_shared, check_range, parse_size
from hairkit.cli.written import print_written
from hairkit.head_model.template import default_head
from hairkit.synth import STYLES, grow, photograph

DESCRIPTION = """\
Example: hairkit synth wavy -o wavy/

Grow a groom and take photos of it: photos/, masks/, landmarks.json, groom.npz, and truth/ for
`hairkit evaluate`. Then: hairkit reconstruct wavy/ -o out/"""
VIEWS = 8
"""Photos by default."""
STRANDS = 10_000
"""Hairs by default: a tenth of a head's."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("style", metavar="STYLE", help=", ".join(STYLES))
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder")
    add("--strands", type=int, default=STRANDS, metavar="N", help=f"hairs ({STRANDS})")
    add("--seed", type=int, default=0, help="of hair, cameras and room (0)")
    add("--views", type=int, default=VIEWS, metavar="N", help=f"photos ({VIEWS})")
    add("--size", default="810x1080", metavar="WxH", help="photos (810x1080)")
    add("--jitter", type=float, default=1.0, help="how far cameras leave the nominal turn (1)")
    add("--orthographic", action="store_true", help="parallel rays")
    add_shared(add, "--json")


def run(args: argparse.Namespace) -> int:
    """Grow, photograph, and print the folder."""
    size = parse_size(args.size)
    check_range("--seed", args.seed, 0, LARGEST_SEED)
    check_range("--jitter", args.jitter, 0, 10)
    groom = grow(args.style, default_head(), args.strands, args.seed)
    print(f"{args.style}: {len(groom.strands)} strands grown", file=sys.stderr)
    photograph(
        groom,
        args.output,
        seed=args.seed,
        views=args.views,
        size=size,
        jitter=args.jitter,
        orthographic=args.orthographic,
    )
    groom.save(args.output / "groom.npz")
    print_written(args, args.output, strands=len(groom.strands))
    return 0
