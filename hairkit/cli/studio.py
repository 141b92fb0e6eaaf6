"""`hairkit studio PROJECT`: photos, masks and moving hair in a browser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

_DESCRIPTION = """\
Example: hairkit studio my-head/

Take photos with a webcam or a phone, correct masks by a few strokes and watch the hair move, in a
browser. PROJECT is a folder, made where there is none, that `hairkit reconstruct` reads as well.
Everything stays on this machine; only this machine can open the pages. With --lan a phone in the
same network can too: scan the code. Ctrl-C ends it; nothing is lost.
"""
LEAST_PORT, MOST_PORT = 1024, 65535
GUIDES = 600
"""Roots by default, as of `hairkit reconstruct`."""


def register(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "studio", help="from a camera to moving hair, in a browser", description=_DESCRIPTION
    )
    add = parser.add_argument
    add("project", nargs="?", default="my-head", metavar="PROJECT", help="folder (my-head)")
    add("--lan", action="store_true", help="let phones in this network in, over HTTPS")
    add("--port", type=int, metavar="N", help="port to listen on (8420, or a free one)")
    add(
        "--guides",
        type=int,
        default=GUIDES,
        metavar="N",
        help="number of guide hairs (default 600)",
    )
    add("--no-browser", action="store_true", help="open no browser, only print the link")


def run(args: argparse.Namespace) -> int:
    """Serve the project until Ctrl-C."""
    from hairkit.errors import InputError
    from hairkit.pipeline.reconstruct import MAX_GUIDES

    if args.port is not None and not LEAST_PORT <= args.port <= MOST_PORT:
        raise InputError(f"--port is {args.port}, expected {LEAST_PORT} to {MOST_PORT}")
    if not 1 <= args.guides <= MAX_GUIDES:
        raise InputError(f"--guides is {args.guides}, expected 1 to {MAX_GUIDES}")
    from hairkit.studio.app import Settings, serve

    settings = Settings(args.port, args.lan, not args.no_browser, args.guides)
    serve(Path(args.project), settings, lambda line: print(line, file=sys.stderr, flush=True))
    return 0
