"""Print how many frames per second the viewer draws.

python benchmarks/viewer.py --guides 600 --hairs 10000 --size 1280x720

Each row is the median frame of a shaken head in wind, the last one of each simulator that of a
still head: as wall time, and as CPU time of all threads over the number of cores, which is the wall
time on an otherwise idle machine. `chosen` is what the frame budget settles on, in 50 ms unless
`--budget` says otherwise; `--level` measures one level of quality only. A picture is 1/60 s. Hair
is drawn by compute shaders, meant for a graphics card, or by compiled loops on the processor, which
the viewer uses without one.

A line below says the same of a comb that is led over the hair, which the budget hurries. The last
one is a still picture with all its samples, and the most memory that the program took
until then; `--still` measures nothing else.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from hairkit.cli.render import parse_size
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.rendering.context import Renderer, renderer
from hairkit.synth import grow
from hairkit.viewer.actions.actions import perform
from hairkit.viewer.draw.frame_budget import LEVELS, Budget
from hairkit.viewer.preview import Preview
from hairkit.viewer.session import STEP, Session

HEADINGS = (
    "simulation", "hair by", "quality", "wall ms", "fps", "processor ms / cores",
    "fps idle machine",
)  # fmt: skip
ROWS = ((False, 0), (False, 1), (True, 0), (True, 1), (True, 3), (None, None))
"""Whether hair is drawn by the processor, and the level of quality; None lets the budget choose."""
WARM = 12
"""Pictures before the measured ones."""
SETTLING = 80
"""Further pictures after which the budget has chosen its level."""


def main() -> int:
    """Measure and print."""
    args = _arguments()
    with tempfile.TemporaryDirectory() as folder, renderer() as gl:
        path = Path(folder) / "groom.npz"
        groom = grow("straight", default_head(), args.guides)
        marked = replace(groom.strands, guide=np.ones(len(groom.strands), np.bool_))
        replace(groom, strands=marked).save(path)
        print(f"{gl.description}, {os.cpu_count()} cores\n")
        print(f"{args.guides} guides, {args.hairs} hairs, {args.size}, {args.pictures} pictures\n")
        print(f"| {' | '.join(HEADINGS)} |\n|{'---|' * len(HEADINGS)}")
        for simulator in () if args.still else ("none", None):
            session = Session(
                Manager.loaded(),
                path,
                size=parse_size(args.size),
                simulator=simulator,
                hairs=args.hairs,
            )
            rows = ROWS if args.level is None else ((None, args.level),)
            for soft, level in rows:
                _row(args, gl, session, level, soft)
            _row(args, gl, session, rows[-1][1], None, shaken=False)
        if not args.still:
            _comb(args, gl, session)
        _still(args, gl, path)
    return 0


def _still(args: argparse.Namespace, gl: Renderer, path: Path) -> None:
    """Print the time of a still picture as the window refines it, and the program's memory."""
    size = parse_size(args.size)
    session = Session(Manager.loaded(), path, size=size, hairs=args.hairs)
    preview = Preview(gl, session)
    preview.draw(still=True)
    wall, processor = time.perf_counter(), time.process_time()
    while preview.refine():
        pass
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"\nstill picture: {wall:.2f} s, {processor:.2f} processor seconds;"
        f" {args.hairs} hairs, at most {most:.2f} GB"
    )
    preview.release()


def _row(
    args: argparse.Namespace,
    gl: Renderer,
    session: Session,
    level: int | None,
    soft: bool | None,
    *,
    shaken: bool = True,
) -> None:
    """Print one line: a fixed level of quality, or the budget's choice."""
    budget = Budget(1e-3 * args.budget)
    session.reset()
    session.max_seconds = 0.4 * budget.seconds
    preview = Preview(gl, session, budget, soft)
    walls, processors = [], []
    for picture in range(WARM + args.pictures + (SETTLING if level is None else 0)):
        if picture % 60 == 0:
            if shaken:
                perform(session, "shake", {"seconds": 3.0})
            perform(session, "wind", {"on": True})
        if level is not None:
            budget.level, budget._wait = level, 99
        wall, processor = time.perf_counter(), time.process_time()
        preview.frame(STEP)
        gl.context.finish()
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    wall = statistics.median(walls[-args.pictures :])
    processor = statistics.median(processors[-args.pictures :]) / (os.cpu_count() or 1)
    quality = LEVELS[budget.level]
    name = (
        f"{'chosen: ' if level is None else ''}scale {quality.scale}, {quality.share:.0%} of hairs"
        f"{', soft' if quality.smooth else ''}{'' if shaken else ', still head'}"
    )
    drawn_by = "processor" if preview.frame_renderer.soft else "shaders"
    print(
        f"| {session.simulation.plugin} | {drawn_by}"
        f" | {name} | {1e3 * wall:.0f}"
        f" | {1 / wall:.1f} | {1e3 * processor:.0f} | {1 / processor:.1f} |",
        flush=True,
    )
    preview.release()


def _comb(args: argparse.Namespace, gl: Renderer, session: Session) -> None:
    """Print how fast a comb goes over all guides."""
    preview = Preview(gl, session, Budget(1e-3 * args.budget))
    perform(session, "brush", {"name": "comb"})
    strokes, pictures, (width, height) = [], [], session.size
    for k in range(SETTLING):
        began = time.perf_counter()
        perform(session, "stroke", {"x": 0.42 * width + 2 * k, "y": 0.4 * height + k % 20})
        combed = time.perf_counter()
        preview.frame(STEP)
        gl.context.finish()
        strokes.append(combed - began)
        pictures.append(time.perf_counter() - combed)
    stroke, picture = (statistics.median(part[SETTLING // 2 :]) for part in (strokes, pictures))
    quality = LEVELS[preview.budget.level]
    print(
        f"\ncomb over {len(session.body.guides)} guides: stroke {1e3 * stroke:.1f} ms, picture"
        f" {1e3 * picture:.1f} ms, {1 / (stroke + picture):.0f} a second; scale {quality.scale},"
        f" {quality.share:.0%} of hairs"
    )
    preview.release()


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--guides", type=int, default=600)
    parser.add_argument("--hairs", type=int, default=10_000)
    parser.add_argument("--size", default="1280x720", metavar="WxH")
    parser.add_argument("--pictures", type=int, default=40)
    parser.add_argument("--budget", type=float, default=50.0, help="milliseconds (default 50)")
    parser.add_argument("--level", type=int, choices=range(len(LEVELS)), help="0 is the best")
    parser.add_argument("--still", action="store_true", help="measure a still picture only")
    return parser.parse_args()


if __name__ == "__main__":
    raise SystemExit(main())
