"""`hairkit evaluate OUT --truth DIR`: score a groom against the truth of its capture."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from hairkit.cli.arguments import Add, add_shared

if TYPE_CHECKING:
    from rich.table import Table

    from hairkit.evaluation import Evaluation

DESCRIPTION = """\
Example: hairkit evaluate out/ --truth captures/wavy/truth

Score a groom against the truth of its capture: precision, recall and F of the strands, lengths,
roots, silhouettes, directions and cameras. Photos fix no scale or frame, so the groom is first
moved by the one similarity with which the true cameras see it as its own cameras did.
A high score needs many strands: reconstruct with --guides 8000 to compare with others."""

_PLAIN_WIDTH = 100
"""Columns of a table that goes to a file or a pipe."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("groom", type=Path, metavar="OUT", help="folder of reconstruct, or a groom")
    add("--truth", type=Path, required=True, metavar="DIR", help="the capture's truth folder")
    add("-o", dest="report", type=Path, metavar="DIR", help="report folder (OUT/evaluation)")
    add("--scene", type=Path, metavar="FILE", help="cameras of the groom (scene.json beside it)")
    add("--consistency", action="store_true", help="measure strand consistency too (slower)")
    add_shared(add, "--json")


def run(args: argparse.Namespace) -> int:
    """Print the figures and write the report."""
    from hairkit.evaluation import evaluate, read_prediction, read_truth
    from hairkit.evaluation.report import to_text, write_report

    prediction, truth = read_prediction(args.groom, args.scene), read_truth(args.truth)
    evaluation = evaluate(prediction, truth, consistency=args.consistency)
    beside = args.groom if args.groom.is_dir() else args.groom.parent
    paths = write_report(args.report or beside / "evaluation", evaluation, prediction, truth)
    if args.json:
        sys.stdout.write(to_text(evaluation))
    else:
        _print(evaluation)
    print(f"written: {paths[0]}, {paths[1]}", file=sys.stderr)
    return 0


def _print(evaluation: Evaluation) -> None:
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        console = Console(width=_PLAIN_WIDTH)
    console.print(_score_table(evaluation))
    console.print(_figure_table(evaluation))
    if evaluation.consistency is not None:
        console.print(f"strand consistency at 4 mm/40: {100 * evaluation.consistency:.1f} %")


def _score_table(evaluation: Evaluation) -> Table:
    from rich.table import Table

    from hairkit.evaluation.report import score_rows

    counts = f"{evaluation.scores.predicted_strands} strands, {evaluation.scores.true_strands} true"
    table = Table(title=f"precision / recall / F, per cent ({counts})", title_justify="left")
    table.add_column("samples")
    rows = score_rows(evaluation)
    for score in rows[0][1]:
        table.add_column(f"{score.distance_mm:g} mm / {score.angle_deg:g} deg", justify="right")
    for name, scores in rows:
        cells = [
            f"{100 * s.precision:.1f} / {100 * s.recall:.1f} / {100 * s.f:.1f}" for s in scores
        ]
        table.add_row(name, *cells)
    return table


def _figure_table(evaluation: Evaluation) -> Table:
    from rich.table import Table

    from hairkit.evaluation.scorecard import figures

    table = Table()
    table.add_column("figure")
    table.add_column("value", justify="right")
    table.add_column("what is good")
    for row in figures(evaluation):
        table.add_row(row.name, row.text(), row.meaning)
    return table
