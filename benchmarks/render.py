"""Time pictures of a procedural groom and print one table.

python benchmarks/render.py --strands 10000 --size 810x1080

Times are the best of three with everything warm: wall seconds, and CPU seconds of all threads,
which on a busy machine mean more.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from hairkit.cli.render import parse_size
from hairkit.grooming.densify import densify
from hairkit.head_model.template import default_head
from hairkit.rendering import Lights, draw, draw_layers, draw_measurements, draw_views
from hairkit.rendering.context import renderer
from hairkit.rendering.framing import framing_cameras
from hairkit.synth import grow

GUIDES = 600
ROUNDS = 3


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    wall: float
    processor: float


def main() -> int:
    """Measure and print."""
    args = _arguments()
    with renderer() as gl:
        print(f"{gl.description}\n")
    print(f"| {args.strands} strands x {args.points} points, {args.size} | wall s | processor s |")
    print("|---|---|---|")
    for row in _measure(args):
        print(f"| {row.name} | {row.wall:.2f} | {row.processor:.2f} |", flush=True)
    return 0


def _measure(args: argparse.Namespace) -> Iterator[Row]:
    width, height = parse_size(args.size)
    head = default_head()
    guides = grow("wavy", head, GUIDES)
    hair = densify(guides, args.strands).resampled(args.points)
    camera = framing_cameras(hair.points, [(20.0, 5.0)], width, height)[0]
    small = [camera.resized(width // 5, height // 5)] * 8
    lights = Lights.at_camera(camera)
    jobs: dict[str, Callable[[], object]] = {
        f"densify {GUIDES} guides": lambda: densify(guides, args.strands),
        "draw": lambda: draw(hair, head, camera),
        "draw_layers": lambda: draw_layers(hair, head, camera),
        "draw_measurements": lambda: draw_measurements(hair, head, camera),
        "draw_views, 8 views a fifth the size": lambda: draw_views(
            hair, head, small, lights=lights
        ),
        "grow": lambda: grow("wavy", head, args.strands),
    }
    for name, job in jobs.items():
        yield _timed(name, job)


def _timed(name: str, job: Callable[[], object]) -> Row:
    walls, processors = [], []
    for _ in range(ROUNDS):
        wall, processor = time.perf_counter(), time.process_time()
        job()
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return Row(name, min(walls), min(processors))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--strands", type=int, default=10_000)
    parser.add_argument("--points", type=int, default=60, help="points a strand")
    parser.add_argument("--size", default="810x1080", metavar="WxH")
    return parser.parse_args()


if __name__ == "__main__":
    raise SystemExit(main())
