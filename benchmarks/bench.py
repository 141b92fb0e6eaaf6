"""Run the benchmarks and keep what they print, and what they took, in a JSON file.

python benchmarks/bench.py -o bench.json [PROGRAM ...]

Of each program: processor and wall seconds, the load of the machine, the tables, and the yardstick:
processor seconds of a fixed piece of work by NumPy right before it, which a busy or slower machine
lengthens as well. `python -m benchmarks.compare old.json new.json` compares two such files.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent
NOT_RUN = {
    "bench", "blender_picture", "captures_argument", "compare", "example_textures",
    "plain_analogies", "random_hair",
}  # fmt: skip
"""Modules of other programs, and programs that work on files of the user's."""
NUMBERS = 1_000_000
"""Numbers that the yardstick sorts."""
Table = dict[str, dict[str, float]]
"""Numbers by row and column."""


def main() -> int:
    """Run, print, keep; 1 where a program failed."""
    args = _arguments()
    known = {path.stem for path in FOLDER.glob("*.py")} - NOT_RUN
    unknown = set(args.programs) - known
    if unknown:
        print(f"no benchmarks named {', '.join(sorted(unknown))}", file=sys.stderr)
        return 2
    programs, failed = {}, []
    for name in sorted(args.programs or known):
        print(f"== {name}", flush=True)
        programs[name] = measured = measure([sys.executable, str(FOLDER / f"{name}.py")])
        if measured["code"]:
            failed.append(name)
        machine = f"{platform.platform()}, {os.cpu_count()} cores, Python {sys.version.split()[0]}"
        args.output.write_text(json.dumps({"machine": machine, "programs": programs}, indent=1))
    print(f"{args.output}: {len(programs)} programs" + "".join(f", {n} failed" for n in failed))
    return int(bool(failed))


def measure(command: Sequence[str]) -> dict[str, object]:
    """Return what a command took and the tables that it printed, which are printed on."""
    unit, load = yardstick(), os.getloadavg()[0]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(done.stdout, flush=True)
    return {
        "code": done.returncode,
        "processor_s": round(spent, 3),
        "wall_s": round(wall, 3),
        "load": round(load, 2),
        "yardstick_s": round(unit, 5),
        "table": read_tables(done.stdout),
    }


def yardstick() -> float:
    """Return processor seconds of sorting and transforming the same numbers, the best of three."""
    numbers, times = np.random.default_rng(0).random(NUMBERS), []
    for _ in range(3):
        began = time.process_time()
        np.fft.rfft(np.sort(numbers))
        times.append(time.process_time() - began)
    return min(times)


def read_tables(text: str) -> Table:
    """Return the numbers of Markdown tables by row and column; a cell counts with its first one.

    Rows are named by their first cell; a name that comes again gets its number.
    """
    found: Table = {}
    heads: list[str] = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line[:1] == "|" else []
        if not cells or set("".join(cells)) <= set("-: "):
            heads = heads if cells else []
        elif not heads:
            heads = cells
        else:
            name, again = cells[0], 2
            while name in found:
                name, again = f"{cells[0]} ({again})", again + 1
            read = {
                h: re.search(r"-?\d[\d,]*\.?\d*", c) for h, c in zip(heads, cells, strict=False)
            }
            found[name] = {
                head: float(number[0].replace(",", ""))
                for head, number in list(read.items())[1:]
                if number
            }
    return found


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("programs", nargs="*", metavar="PROGRAM", help="names; all by default")
    parser.add_argument("-o", "--output", type=Path, default=Path("bench.json"), metavar="FILE")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
