"""`hairkit rerun run.json`: run a reconstruction again from its record."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from hairkit.cli.arguments import Add, add_shared

DESCRIPTION = """\
Example: hairkit rerun out/run.json -o again/

Run a reconstruction again from the run.json beside its groom: the same photos, recipe, options,
head, guides and seed, every stage. Inputs must have the SHA-256 of the record. Says which files
came out the same; exit code 2 where one did not, on the same versions and inputs a fault.
"""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("record", metavar="RUN.JSON", help="record that reconstruct wrote")
    add("-o", "--out", required=True, metavar="OUT", help="output folder")
    add("--force", action="store_true", help="take inputs that have changed as they are now")
    add_shared(add, "--quiet", "--json")


def run(args: argparse.Namespace) -> int:
    """Run again and compare."""
    from hairkit.pipeline.rerun import rerun
    from hairkit.progress import progress_for

    with progress_for(sys.stderr, quiet=args.quiet or args.json) as progress:
        done = rerun(args.record, Path(args.out), force=args.force, progress=progress)
    if args.json:
        print(json.dumps({"same": done.same, "different": done.different}, indent=1))
    else:
        lines = [f"{name}: the same bytes" for name in done.same]
        print("\n".join([*lines, *(f"{name}: other bytes" for name in done.different)]))
    return 2 if done.different else 0
