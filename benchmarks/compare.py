"""Compare two files of `benchmarks/bench.py`: what got slower, faster, better or worse.

python -m benchmarks.compare old.json new.json [--above 1.1]

Seconds of whole programs are divided by the yardstick of their own run, so that the ratio of a
machine that is busier or slower than the other is near 1 all the same. Numbers in tables are
compared as they are. Rows within `--above` are left out. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple


class Change(NamedTuple):
    """One number of two runs."""

    place: tuple[str, str, str]
    """Program, row and column."""
    old: float
    new: float
    ratio: float
    """New over old; of seconds in yardsticks."""


def main() -> int:
    """Read, compare, print."""
    args = _arguments()
    try:
        old, new = (json.loads(path.read_text())["programs"] for path in (args.old, args.new))
    except (OSError, ValueError, KeyError, TypeError) as error:
        print(f"not a file of benchmarks/bench.py: {error}", file=sys.stderr)
        return 2
    print("| program | row | number | old | new | ratio |\n|---|---|---|---|---|---|")
    for change in changes(old, new):
        if beyond(change.ratio, args.above):
            words = " | ".join(change.place)
            print(f"| {words} | {change.old:g} | {change.new:g} | {change.ratio:.2f} |")
    for name in sorted(old.keys() ^ new.keys()):
        print(f"\n{name} is only in the {'old' if name in old else 'new'} file")
    return 0


def changes(old: dict[str, Any], new: dict[str, Any]) -> Iterator[Change]:
    """Yield all numbers that both files have: seconds of programs, then those of their tables."""
    for name in sorted(old.keys() & new.keys()):
        a, b = old[name], new[name]
        unit = b["yardstick_s"] / a["yardstick_s"]
        for kind in ("processor_s", "wall_s"):
            yield Change((name, "whole", kind), a[kind], b[kind], _ratio(a[kind] * unit, b[kind]))
        for row in a["table"].keys() & b["table"].keys():
            before, after = a["table"][row], b["table"][row]
            for column in sorted(before.keys() & after.keys()):
                was, now = before[column], after[column]
                yield Change((name, row, column), was, now, _ratio(was, now))


def beyond(ratio: float, limit: float) -> bool:
    """Return whether a ratio is above a limit, or below its inverse; not a number is."""
    return not (ratio > 0 and 1 / limit <= ratio <= limit)


def _ratio(old: float, new: float) -> float:
    if old == new:
        return 1.0
    return new / old if old else math.inf


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--above", type=float, default=1.1, metavar="RATIO")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
