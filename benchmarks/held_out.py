"""Print the accuracy of heads by parts of the hair: all, outer, the crown, lengths and curls.

python benchmarks/held_out.py captures/ --results results/

`results/NAME` is what `hairkit reconstruct captures/NAME -o results/NAME --guides 8000` wrote; what
is missing is reconstructed. Scores are F in per cent; recall is that of the true hair at most
`CROWN` below the top of the head, at 4 mm and 40 degrees. Radius and pitch of waves and curls are
ours and, in brackets, the true ones.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from captures_argument import NO_CAPTURES, add_captures

from hairkit.evaluation import Evaluation, Prediction, Truth, evaluate, read_prediction, read_truth
from hairkit.helices.curl import measure_curl
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.types.groom import HairMaterial

GUIDES = 8000
"""Strands of a head that is reconstructed here."""
CROWN = 0.02
"""Height of the crown below the top of the head, metres."""
MEASURED = 200
"""True strands whose curl is measured."""


def main() -> None:
    """Print a row for every head that has truth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--results", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    print("| head | F 4/40 | F 3/30 | F 2/20 | outer 3/30 | recall on top | length | waves, mm |")
    print("|---|---|---|---|---|---|---|---|")
    for folder in sorted(path.parent for path in Path(arguments.captures).glob("*/truth")):
        print(_row(folder, arguments.results), flush=True)


def _row(folder: Path, results: Path | None) -> str:
    truth = read_truth(folder)
    with tempfile.TemporaryDirectory() as made:
        out = Path(made) if results is None else results / folder.name
        if not (out / "groom.npz").exists():
            reconstruct(folder, out, guides=GUIDES, sheet=False)
        prediction = read_prediction(out)
    found = evaluate(prediction, truth)
    fine, middle, coarse = (f"{100 * score.f:.1f}" for score in found.scores.all)
    outer = "-" if found.scores.outer is None else f"{100 * found.scores.outer[1].f:.1f}"
    length = prediction.groom.strands.lengths().mean() * found.similarity.scale
    cells = [folder.name, coarse, middle, fine, outer, f"{100 * _recall_on_top(found, truth):.0f}"]
    cells += [f"{length / truth.strands.lengths().mean():.2f}", _waves(prediction, truth)]
    return f"| {' | '.join(cells)} |"


def _recall_on_top(found: Evaluation, truth: Truth) -> float:
    """Return the share of true samples on the crown that have a partner at 4 mm, 40 degrees."""
    recall = found.evidence.recall
    top = float(truth.head.vertices[:, 1].max()) - CROWN
    crown = recall.samples.points[:, 1] > top
    return float((recall.free[crown] <= len(found.scores.all) - 1).mean()) if crown.any() else 0.0


def _waves(prediction: Prediction, truth: Truth) -> str:
    """Return radius and pitch of the waves, ours and the true ones."""
    chosen = np.linspace(0, len(truth.strands) - 1, min(MEASURED, len(truth.strands)))
    true = measure_curl(truth.strands.select(chosen.astype(np.int64)))
    wanted = true.written_to(HairMaterial())
    pairs = [
        f"{1000 * material.curl_radius:.1f}, {1000 * material.curl_pitch:.0f}"
        if material.curl_radius
        else "none"
        for material in (prediction.groom.material, wanted)
    ]
    return f"{pairs[0]} ({pairs[1]})"


if __name__ == "__main__":
    main()
