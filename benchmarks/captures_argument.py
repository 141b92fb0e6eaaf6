"""The argument of the benchmarks that need captures with ground truth."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

NO_CAPTURES = "no captures; name their folder, or set HAIRKIT_CAPTURES"


def add_captures(parser: argparse.ArgumentParser, name: str = "captures") -> None:
    """Add the folder of captures; `$HAIRKIT_CAPTURES`, or None, where it is not given."""
    parser.add_argument(
        name,
        type=Path,
        default=os.environ.get("HAIRKIT_CAPTURES"),
        help="folder of captures with ground truth (default: $HAIRKIT_CAPTURES)",
        **({} if name.startswith("-") else {"nargs": "?"}),
    )
