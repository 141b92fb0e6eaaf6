"""Processor and wall seconds of every stage of a reconstruction, first run and warm run.

python benchmarks/stages.py PHOTOS [--warm]

Each run is a process of its own. The first has an empty cache of compiled kernels, the second finds
what the first has compiled; `--warm` makes one run with the kernels of this machine. A stage's
seconds are those since the stage before it ended: stages of single views overlap, so only their sum
counts. `start` holds imports and the reading of photos, `end` the files that are no stage's.
Compilations are counted by Numba's own events. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from hairkit.io.capture_reader import sample_folder
from hairkit.progress import Silent

Seconds = dict[str, list[float]]
"""Processor and wall seconds by stage, in the order in which the stages ended."""


class Meter(Silent):
    """Charges all time since the last stage's end to the stage that ends."""

    def __init__(self, clocks: tuple[Callable[[], float], ...], began: tuple[float, ...]) -> None:
        """Read `clocks`, which showed `began` when the program started."""
        self._clocks = clocks
        self._last = began
        self.seconds: Seconds = {}

    def started(self, stage: str, steps: int) -> None:
        """Charge what was before the first stage to `start`."""
        if not self.seconds:
            self.charge("start")

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Charge a stage."""
        self.charge(stage)

    def charge(self, stage: str) -> None:
        """Add the time since the last call to a stage."""
        now = tuple(clock() for clock in self._clocks)
        spent = [at - before for at, before in zip(now, self._last, strict=True)]
        known = self.seconds.setdefault(stage, [0.0] * len(now))
        self.seconds[stage] = [a + b for a, b in zip(known, spent, strict=True)]
        self._last = now


def main() -> int:
    """Run, print."""
    args = _arguments()
    if args.once:
        print(json.dumps(_measure(args)))
        return 0
    names = ["warm"] if args.warm else ["first", "warm"]
    with tempfile.TemporaryDirectory() as folder:
        cache = {} if args.warm else {"NUMBA_CACHE_DIR": folder}
        runs = {name: _run_in_child(args, cache) for name in names}
    print(table({name: run["seconds"] for name, run in runs.items()}))
    for name, run in runs.items():
        print(f"\n{name}: {run['compilations']} compilations, load {run['load']:.1f}")
    return 0


def table(runs: Mapping[str, Seconds]) -> str:
    """Return the Markdown table of runs by name, the last row their sums."""
    head = " | ".join(f"{name}, processor s | wall s" for name in runs)
    lines = [f"| stage | {head} |", "|" + "---|" * (1 + 2 * len(runs))]
    stages = list(dict.fromkeys(stage for seconds in runs.values() for stage in seconds))
    for stage in stages:
        lines.append(_row(stage, [seconds.get(stage, [0.0, 0.0]) for seconds in runs.values()]))
    sums = [[sum(column) for column in zip(*s.values(), strict=True)] for s in runs.values()]
    return "\n".join([*lines, _row("whole", sums)])


def _row(name: str, values: list[list[float]]) -> str:
    return f"| {name} | {' | '.join(f'{value:.2f}' for pair in values for value in pair)} |"


def _run_in_child(args: argparse.Namespace, cache: Mapping[str, str]) -> dict[str, object]:
    """Return what one run in a new process measured."""
    words = [sys.executable, __file__, str(args.photos), "--once", "--guides", str(args.guides)]
    words += ["--recipe", args.recipe]
    done = subprocess.run(words, env={**os.environ, **cache}, stdout=subprocess.PIPE, check=True)
    result: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    return result


def _measure(args: argparse.Namespace) -> dict[str, object]:
    """Return the seconds of all stages of one reconstruction in this process."""
    wall = time.perf_counter() - time.process_time()  # about when Python started
    meter = Meter((time.process_time, time.perf_counter), (0.0, wall))
    from numba.core import event

    from hairkit.pipeline.reconstruct import reconstruct

    with event.install_recorder("numba:compile") as compiled, tempfile.TemporaryDirectory() as out:
        reconstruct(args.photos, out, args.recipe, guides=args.guides, progress=meter)
        meter.charge("end")
    made = sum(1 for _, each in compiled.buffer if each.is_start)
    return {"seconds": meter.seconds, "compilations": made, "load": os.getloadavg()[0]}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("photos", nargs="?", type=Path, default=sample_folder(), metavar="PHOTOS")
    add("--warm", action="store_true", help="one run, with the kernels that are compiled already")
    add("--guides", type=int, default=600, metavar="N")
    add("--recipe", default="default", metavar="R")
    add("--once", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
