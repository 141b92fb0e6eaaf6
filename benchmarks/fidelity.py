"""Accuracy of reconstructions: run recipes on captures with ground truth and print one table.

python benchmarks/fidelity.py --captures captures/ --recipes default thesis

Each capture is reconstructed by the command line in a process of its own, whose wall time and peak
memory are measured, with as many guides as there are strands to compare, and then evaluated. The
table is Markdown. Captures without ground truth are skipped.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from captures_argument import add_captures

from hairkit.errors import HairkitError
from hairkit.evaluation import Evaluation, Truth, evaluate, mask_iou, read_prediction, read_truth
from hairkit.evaluation.report import write_report
from hairkit.evaluation.scorecard import Figure, figures
from hairkit.io.capture_reader import read_capture
from hairkit.manager import Manager
from hairkit.types.mask import HAIR

MASKS = "hair mask IoU"
_COMMAND = """\
import sys
from hairkit.cli import main
code = main()
if code == 0:
    print(open("/proc/self/status").read().partition("VmHWM:")[2].split()[0], file=sys.stderr)
sys.exit(code)
"""
"""Prints the process's peak of memory, KiB, last. `wait4` would count what this one had when it
started the process; that is what Linux takes over."""


@dataclass(frozen=True)
class Run:
    """One reconstruction and what it took."""

    strands: int
    roots: int
    seconds: float
    peak_gb: float


def main() -> int:
    """Reconstruct, evaluate and print; the exit code is 1 when a reconstruction failed."""
    args = _arguments()
    names = args.names or (_with_truth(args.captures) if args.captures else [])
    if not names:
        print("no captures with ground truth; name their folder: --captures DIR")
        return 0
    with tempfile.TemporaryDirectory(prefix="hairkit-fidelity-") as temporary:
        out = args.out or Path(temporary)
        columns, failures = _measure_all(args, names, out)
    if columns:
        print(_table(columns, args.recipes, names))
    for failure in failures:
        print(failure, file=sys.stderr)
    return 1 if failures else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add_captures(parser, "--captures")
    add("--names", nargs="+", metavar="NAME", help="captures (default: all with ground truth)")
    add("--recipes", nargs="+", default=["default", "thesis"], metavar="R")
    add("--guides", type=int, default=8000, metavar="N", help="strands tracked (default 8000)")
    add(
        "--set",
        action="append",
        default=[],
        metavar="X=V",
        help="passed on to `hairkit reconstruct`",
    )
    add("--out", type=Path, metavar="DIR", help="keep grooms and reports here")
    add("--no-grabcut", action="store_true", help="leave out the masks of grabcut")
    return parser.parse_args()


def _with_truth(captures: Path) -> list[str]:
    return sorted(path.parents[1].name for path in captures.glob("*/truth/truth.json"))


Columns = dict[tuple[str, str], tuple[Figure, ...]]
"""Figures by recipe and capture."""


def _measure_all(
    args: argparse.Namespace, names: Sequence[str], out: Path
) -> tuple[Columns, list[str]]:
    columns: Columns = {}
    failures = []
    for name in names:
        folder = args.captures / name
        try:
            truth = read_truth(folder)
            masks = None if args.no_grabcut else _grabcut_iou(folder, truth)
        except HairkitError as error:
            failures.append(f"{name}: {error}")
            continue
        for recipe in args.recipes:
            print(f"{name}, {recipe}", file=sys.stderr, flush=True)
            target = out / f"{name}-{Path(recipe).stem}"
            try:
                run = _reconstruct(folder, target, recipe, args)
                evaluation = _evaluate(target, truth, keep_report=args.out is not None)
            except HairkitError as error:
                failures.append(f"{name}, {recipe}: {error}")
                continue
            columns[recipe, name] = _column(evaluation, run, masks)
    return columns, failures


def _reconstruct(folder: Path, out: Path, recipe: str, args: argparse.Namespace) -> Run:
    """Run `hairkit reconstruct` from nothing in a process of its own."""
    options = [word for setting in args.set for word in ("--set", setting)]
    command = [sys.executable, "-c", _COMMAND, "reconstruct", str(folder), "-o", str(out)]
    command += ["--recipe", recipe, "--guides", str(args.guides), "--no-cache", "--json", *options]
    began = time.perf_counter()
    with (
        tempfile.TemporaryFile() as printed,
        tempfile.TemporaryFile() as said,
        subprocess.Popen(command, stdout=printed, stderr=said) as process,
    ):
        process.wait()
        seconds = time.perf_counter() - began
        printed.seek(0)
        said.seek(0)
        last = said.read().decode(errors="replace").strip().splitlines()[-1:]
        if process.returncode:
            raise HairkitError(" ".join(last) or f"exit code {process.returncode}")
        summary = json.loads(printed.read())
    return Run(summary["strands"], summary["roots"], seconds, int(last[0]) / 2**20)


def _evaluate(out: Path, truth: Truth, *, keep_report: bool) -> Evaluation:
    prediction = read_prediction(out)
    evaluation = evaluate(prediction, truth)
    if keep_report:
        write_report(out / "evaluation", evaluation, prediction, truth)
    return evaluation


def _grabcut_iou(folder: Path, truth: Truth) -> float:
    """Segment the photos from their strokes, without the mask files, and compare."""
    manager = Manager.loaded([])
    options = manager.options("grabcut", {})
    shares = []
    for view in read_capture(folder).views:
        found = manager.call("segment", "grabcut", options, view=replace(view, mask_path=None))
        true = truth.hair_mask(truth.names.index(view.name)) == HAIR
        shares.append(mask_iou(found.hair, true))
    return sum(shares) / len(shares)


def _column(evaluation: Evaluation, run: Run, masks: float | None) -> tuple[Figure, ...]:
    """Return the figures of one run; the masks' overlap is grabcut's, not that of given files."""
    shown = [
        replace(row, name="grabcut mask IoU", value=masks) if row.name == MASKS else row
        for row in figures(evaluation)
    ]
    grown = 100 * run.strands / run.roots
    return (
        *shown,
        Figure("roots that give a strand", grown, " %"),
        Figure(f"reconstruct, {run.roots} guides", run.seconds, " s"),
        Figure("peak memory", run.peak_gb, " GB", digits=2),
    )


def mean_figures(several: Sequence[Sequence[Figure]]) -> tuple[Figure, ...]:
    """Return the mean of each figure over evaluations whose figures come in the same order."""
    means = []
    for column in zip(*several, strict=True):
        known = [figure.value for figure in column if figure.value is not None]
        means.append(replace(column[0], value=float(np.mean(known)) if known else None))
    return tuple(means)


def _table(columns: Columns, recipes: Sequence[str], names: Sequence[str]) -> str:
    heads, bodies, means = [], [], {}
    for recipe in recipes:
        done = [columns[recipe, name] for name in names if (recipe, name) in columns]
        if not done:
            continue
        means[recipe] = mean_figures(done)
        heads += [f"{recipe}: {name}" for name in names if (recipe, name) in columns]
        heads.append(f"**{recipe}: mean**")
        bodies += [*done, means[recipe]]
    first = bodies[0]
    lines = ["| figure | " + " | ".join(heads) + " |", "|---" * (1 + len(heads)) + "|"]
    for row, figure in enumerate(first):
        cells = " | ".join(body[row].text() for body in bodies)
        lines.append(f"| {figure.name} | {cells} |")
    if {"default", "thesis"} <= set(means):
        mine, theirs = (means[recipe][0].value or 0.0 for recipe in ("default", "thesis"))
        lines.append(f"\ndefault over thesis, {first[0].name}: {mine / max(theirs, 1e-9):.2f}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
