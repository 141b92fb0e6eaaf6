"""`hairkit new-plugin STAGE NAME`: write a working plugin package to start from."""

from __future__ import annotations

import argparse

from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.scaffold import new_plugin
from hairkit.cli.scaffold_sketches import SKETCHES
from hairkit.cli.written import print_written
from hairkit.stages import OF_HOOK, OF_TABLE

DESCRIPTION = """\
Example: hairkit new-plugin orient my_method

Write a working plugin package with its entry point, its options and its test. Nothing that
exists is overwritten."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    others = [hook for hook in SKETCHES if hook not in OF_HOOK or not OF_HOOK[hook].in_runs]
    stages = f"a stage of the recipe ({', '.join(OF_TABLE)}) or a hook ({', '.join(others)})"
    add("stage", metavar="STAGE", help=stages)
    add("name", metavar="NAME", help="the plugin's name: lower_case_words")
    add("-o", "--output", metavar="FOLDER", help="default: hairkit-NAME")
    add_shared(add, "--json")


def run(args: argparse.Namespace) -> int:
    """Write the package and print how to install and test it."""
    folder = new_plugin(args.stage, args.name, args.output)
    lines = [f"wrote {folder}", f"install it: pip install -e {folder}"]
    print_written(args, folder, lines=[*lines, f"test it:    python -m pytest {folder}"])
    return 0
