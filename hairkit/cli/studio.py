"""`hairkit studio PROJECT`: photos, masks and moving hair in a browser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hairkit.cli.arguments import Add, add_shared, check_range

DESCRIPTION = """\
Example: hairkit studio my-head/

Take photos with a webcam or a phone, correct masks by a few strokes and watch the hair move, in a
browser. PROJECT is a folder, made where there is none, that `hairkit reconstruct` reads as well.
Everything stays on this machine; only this machine can open the pages. With --lan a phone in the
same network can too: scan the code. Ctrl-C ends it; nothing is lost.
"""
LEAST_PORT, MOST_PORT = 1024, 65535


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("project", nargs="?", default="my-head", metavar="PROJECT", help="folder (my-head)")
    add("--lan", action="store_true", help="let phones in this network in, over HTTPS")
    add("--port", type=int, metavar="N", help="port to listen on (8420, or a free one)")
    add_shared(add, "--guides")
    add("--no-browser", action="store_true", help="open no browser, only print the link")


def run(args: argparse.Namespace) -> int:
    """Serve the project until Ctrl-C."""
    from hairkit.pipeline.reconstruct import MAX_GUIDES

    check_range("--port", args.port, LEAST_PORT, MOST_PORT)
    check_range("--guides", args.guides, 1, MAX_GUIDES)
    from hairkit.studio.app import Settings, serve

    settings = Settings(args.port, args.lan, not args.no_browser, args.guides)
    serve(Path(args.project), settings, lambda line: print(line, file=sys.stderr, flush=True))
    return 0
