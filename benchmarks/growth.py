"""Time a tracker that grows full hair: many strands through one field in one call.

python benchmarks/growth.py [PHOTOS] --strands 100000

Reconstructs a capture (the sample by default) once, keeps its hull and field, and times both
trackers alone in that field, with compiled kernels. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.head_model.scalp import sample_roots
from hairkit.hookspecs import hookimpl
from hairkit.io.capture_reader import read_capture, sample_folder
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.types.parting import Parting
from hairkit.types.tie import TiedHair
from hairkit.types.waves import Waves

TRACKERS: dict[str, dict[str, object]] = {
    "hybrid_growth": {"waves": False, "cover": 0.0},
    "certainty_tracker": {},
}
"""Trackers with the options that let them do the same work."""


class Listener:
    """Keeps what the stages made."""

    def __init__(self) -> None:
        self.made: dict[str, list[Any]] = {}

    @hookimpl
    def stage_finished(self, stage: str, result: Any) -> None:
        """Keep one result."""
        self.made.setdefault(stage, []).append(result)


def main() -> int:
    """Reconstruct, track, print."""
    args = _arguments()
    manager, listener = Manager.loaded([]), Listener()
    manager.register(listener, "growth_benchmark")
    capture = read_capture(args.photos)
    with tempfile.TemporaryDirectory() as out:
        reconstruct(capture, out, load_recipe(args.recipe), manager, guides=200)
    made = listener.made
    scene, hull, field = (made[stage][-1] for stage in ("fit_head", "build_hull", "solve_field"))
    began = time.perf_counter()
    roots = sample_roots(scene.head, args.strands)
    print(f"{args.strands} roots spread over the scalp in {time.perf_counter() - began:.2f} s\n")
    print("| tracker | strands | seconds, best round | longest |\n|---|---|---|---|")
    given = {
        "scene": scene,
        "masks": (),
        "orientations": (),
        "hull": hull,
        "field": field,
        "waves": Waves(),
        "parting": Parting(),
        "tied": TiedHair(),
        "scalp_distance": measure_scalp_distance(scene.head, hull),
    }
    for name, settings in TRACKERS.items():
        options = manager.options(name, settings)
        times = []
        for _ in range(args.rounds):
            began = time.perf_counter()
            strands = manager.call("track", name, options, **given, roots=roots)
            times.append(time.perf_counter() - began)
        longest = strands.lengths().max()
        print(f"| `{name}` | {len(strands)} | {min(times):.2f} | {longest:.2f} m |")
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("photos", nargs="?", type=Path, default=sample_folder(), metavar="PHOTOS")
    add("--strands", type=int, default=100_000, metavar="N")
    add("--recipe", default="patent", metavar="R")
    add("--rounds", type=int, default=3, metavar="N")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
