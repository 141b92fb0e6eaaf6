"""Draws a fitted head from eight sides, without hair, on its bust.

hairkit head photos/ -o head.npz
python docs/images/head_sides.py head.npz -o docs/images/head_sides.jpg

The upper row turns from the front to the back by the subject's left, the lower one on to the front.
Without a file it is the default head.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from hairkit.head_model.template import default_head
from hairkit.rendering import draw_views
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.skin import Texture
from hairkit.types.strands import Strands

HEIGHT = 400
"""Pixels of a picture; a quarter narrower than high."""
SIDES = 8


def main() -> int:
    """Draw and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("head", type=Path, nargs="?", help="head of hairkit head, .npz")
    parser.add_argument("-o", "--output", type=Path, required=True, help="JPEG of all sides")
    arguments = parser.parse_args()
    head = default_head() if arguments.head is None else Head.load(arguments.head)
    cameras = [
        Camera.on_turn(
            360 * side / SIDES,
            distance=0.9,
            focal=2.6 * HEIGHT,
            width=3 * HEIGHT // 4,
            height=HEIGHT,
            target=(0, -0.05, 0),
        )
        for side in range(SIDES)
    ]
    bald = Strands(np.zeros((0, 3), np.float32), np.zeros(1, np.int64))
    pictures = draw_views(bald, head, cameras, bust=True)
    rows = [np.hstack(pictures[: SIDES // 2]), np.hstack(pictures[SIDES // 2 :])]
    arguments.output.write_bytes(Texture.encode(np.vstack(rows), lossless=False).data.tobytes())
    print(arguments.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
