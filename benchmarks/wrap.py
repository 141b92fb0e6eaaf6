"""How well grooms lie on other heads: a child's, a man's of few triangles, a woman's remeshed.

    python benchmarks/wrap.py [-o PICTURE] [--strands N] [--heads FILE ...]

Prints for each style of hair and each head how far roots are off the surface, how deep points lie
in the head, how much lengths change, and the processor time. -o draws the wavy groom on all heads.
--heads takes files of heads or bodies instead, in metres, +Y up, the face along +Z.
"""

from __future__ import annotations

import argparse
import time
from functools import partial
from pathlib import Path

import numpy as np
from foreign_heads import FOREIGN_HEADS

from hairkit.grooming.wrap import wrap_groom
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.head_model.signed_distance import distance_to
from hairkit.head_model.template import default_head
from hairkit.imaging.picture_file import write_picture
from hairkit.io.head_reader import read_bare_head
from hairkit.rendering.framing import framing_cameras
from hairkit.rendering.picture import draw_views
from hairkit.synth import grow
from hairkit.types.groom import Groom

STYLES = ("short", "wavy", "curly")
SIDES = [(0.0, 0.0), (70.0, 0.0), (140.0, 0.0), (-110.0, 15.0)]
"""Azimuth and elevation of the pictures, degrees."""
SIZE = (320, 400)
"""Pixels of a picture."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, help="picture")
    parser.add_argument("--strands", type=int, default=1000)
    parser.add_argument("--heads", type=Path, nargs="*", default=(), metavar="FILE")
    args = parser.parse_args()
    makers = {path.stem: partial(read_bare_head, path) for path in args.heads} or FOREIGN_HEADS
    print("| hair | head | roots off, mm | deepest point, mm | lengths changed | seconds |")
    print("|---|---|---|---|---|---|")
    shown = []
    for style in STYLES:
        groom = grow(style, default_head(), args.strands, 0)
        shown += [groom] if style == "wavy" else []
        for name, make in makers.items():
            head = make()
            start = time.process_time()
            wrapped = wrap_groom(groom, head)
            seconds = time.process_time() - start
            tree = build_tree(head.vertices, head.faces)
            off = 1e3 * nearest_on_surface(tree, wrapped.strands.roots)[2].max()
            deep = -1e3 * distance_to(wrapped.head, wrapped.strands.points).min()
            change = wrapped.strands.lengths().mean() / groom.strands.lengths().mean() - 1
            print(
                f"| {style} | {name} | {off:.4f} | {deep:.3f} | {abs(change):.4%} | {seconds:.1f} |"
            )
            shown += [wrapped] if style == "wavy" else []
    if args.output is not None:
        write_picture(args.output, np.concatenate([_row(groom) for groom in shown]))


def _row(groom: Groom) -> np.ndarray:
    """Return one groom from several sides."""
    cameras = framing_cameras(groom.strands.points, SIDES, *SIZE)
    return np.concatenate(draw_views(groom, None, cameras), axis=1)


if __name__ == "__main__":
    main()
