"""Print how closely helix arcs follow strands, how many arcs that takes, and the time.

python benchmarks/helices.py captures/

Distances are means in mm between 1,000 true strands of each capture (or strands of procedural
grooms, named synth) and the curve made of their arcs: `to` is measured from the curve to the
strand, `from` the other way; `worst` is the 95th percentile over strands. `patent` counts arcs by
the patent's rule and keeps the tangents; `adaptive` is what hairkit uses.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from captures_argument import add_captures
from scipy.spatial import cKDTree

from hairkit.head_model.template import default_head
from hairkit.helices import Arcs, adaptive_counts, fit_arcs, patent_counts
from hairkit.synth import grow
from hairkit.types.strands import Strands

COUNT, STEP = 1000, 0.0005
METHODS: dict[str, Callable[[Strands], Arcs]] = {
    "patent": lambda strands: fit_arcs(strands, patent_counts(strands), turning=False),
    "adaptive": lambda strands: fit_arcs(strands, adaptive_counts(strands)),
}


def main() -> None:
    """Print one row a set of strands and method."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    sets = procedural()
    folder = parser.parse_args().captures
    if folder:
        sets = {
            p.parents[1].name: read(p) for p in sorted(folder.glob("*/truth/strands.npz"))
        } | sets
    print("| strands | method | arcs a strand | to mm | from mm | worst mm | s for 1,000 |")
    print("|---|---|---|---|---|---|---|")
    for name, strands in sets.items():
        for method, fit in METHODS.items():
            fit(strands)
            start = time.perf_counter()
            arcs = fit(strands)
            seconds = (time.perf_counter() - start) * 1000 / len(strands)
            to, back = distances(strands, arcs)
            count = len(arcs.lengths) / len(strands)
            print(
                f"| {name} | {method} | {count:.1f} | {to.mean():.2f} | {back.mean():.2f} "
                f"| {np.quantile(back, 0.95):.2f} | {seconds:.2f} |"
            )


def read(path: Path) -> Strands:
    """Return evenly picked true strands."""
    with np.load(path) as data:
        strands = Strands(data["points"], data["offsets"])
    return strands.select(np.linspace(0, len(strands) - 1, COUNT).astype(np.int64))


def procedural() -> dict[str, Strands]:
    """Return strands of procedural styles."""
    head = default_head()
    styles = ("straight", "wavy", "curly")
    return {f"synth {style}": grow(style, head, COUNT).strands for style in styles}


def distances(strands: Strands, arcs: Arcs) -> tuple[np.ndarray, np.ndarray]:
    """Return mm per strand from the curve to the strand and back, every tenth strand."""
    dense = strands.resampled_by_length(STEP)
    share = (np.arange(40) + 0.5) / 40
    result = []
    for s in range(0, len(strands), 10):
        arc = np.repeat(np.arange(arcs.offsets[s], arcs.offsets[s + 1]), len(share))
        curve, _ = arcs.at(arc, np.tile(share, len(arc) // len(share)))
        strand = dense.points[dense.offsets[s] : dense.offsets[s + 1]]
        to, back = cKDTree(strand).query(curve)[0], cKDTree(curve).query(strand)[0]
        result.append((1e3 * to.mean(), 1e3 * back.mean()))
    to_mm, back_mm = np.array(result).T
    return to_mm, back_mm


if __name__ == "__main__":
    main()
