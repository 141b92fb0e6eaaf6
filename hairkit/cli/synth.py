"""`hairkit synth STYLE -o DIR`: grow a procedural groom and photograph it, with its truth."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from hairkit.cli.render import parse_size
from hairkit.cli.written import add_json, print_written
from hairkit.errors import InputError
from hairkit.head_model.template import default_head
from hairkit.synth import STYLES, grow, photograph

_DESCRIPTION = """\
Example: hairkit synth wavy -o wavy/

Grow a groom and take photos of it: photos/, masks/, landmarks.json, groom.npz, and truth/ for
`hairkit evaluate`. Then: hairkit reconstruct wavy/ -o out/"""
VIEWS = 8
"""Photos by default."""
STRANDS = 10_000
"""Hairs by default: a tenth of a head's."""


def register(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser("synth", help="make photos", description=_DESCRIPTION)
    parser.add_argument("style", metavar="STYLE", help=", ".join(STYLES))
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder")
    parser.add_argument(
        "--strands", type=int, default=STRANDS, metavar="N", help=f"hairs ({STRANDS})"
    )
    parser.add_argument("--seed", type=int, default=0, help="of hair, cameras and room (0)")
    parser.add_argument("--views", type=int, default=VIEWS, metavar="N", help=f"photos ({VIEWS})")
    parser.add_argument("--size", default="810x1080", metavar="WxH", help="photos (810x1080)")
    parser.add_argument(
        "--jitter", type=float, default=1.0, help="how far cameras leave the nominal turn (1)"
    )
    parser.add_argument("--orthographic", action="store_true", help="parallel rays")
    add_json(parser.add_argument)


def run(args: argparse.Namespace) -> int:
    """Grow, photograph, and print the folder."""
    size = parse_size(args.size)
    if args.seed < 0:
        raise InputError(f"--seed is {args.seed}, expected 0 or more")
    if not 0 <= args.jitter <= 10:
        raise InputError(f"--jitter is {args.jitter}, expected 0 to 10")
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
