"""Draw the strands of captures from above, from the side and from behind, beside the true ones.

python studies/looks.py captures/ -o looks.jpg --results results/

`results/NAME` is what `hairkit reconstruct captures/NAME -o results/NAME` wrote; what is missing is
reconstructed. Each capture has a row: the true strands, then ours, by the same light and camera.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.evaluation import Truth, read_prediction, read_truth
from hairkit.evaluation.align import align, alignment_points
from hairkit.imaging.picture_file import write_picture
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.rendering import draw_views
from hairkit.rendering.framing import framing_cameras
from hairkit.types.head import Head
from hairkit.types.strands import Strands

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from captures_argument import NO_CAPTURES, add_captures

GUIDES = 8000
"""Strands of a capture that is reconstructed here, and true strands that are drawn."""
WIDTH, HEIGHT = 190, 215
"""Pixels of one picture."""
TURN = ((0.0, 75.0), (90.0, 5.0), (180.0, 5.0))
"""Azimuth and elevation of the cameras, degrees: from above, from the left, from behind."""
CAPTION, INK = 18, (40, 40, 40)
"""Pixels of the line with the name, and its colour."""


def main() -> None:
    """Draw every capture that has truth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE")
    parser.add_argument("--results", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    print("| capture | strands | mean length, mm | true, mm |\n|---|---|---|---|")
    folders = sorted(path.parent for path in Path(arguments.captures).glob("*/truth"))
    rows = [_row(folder, arguments.results) for folder in folders]
    half = -(-len(rows) // 2)
    rows += [np.full_like(rows[0], 255)] * (2 * half - len(rows))
    sheet = np.concatenate([np.concatenate(rows[:half]), np.concatenate(rows[half:])], axis=1)
    write_picture(arguments.output, sheet)


def _row(folder: Path, results: Path | None) -> UInt8Array:
    """Return the pictures of one capture side by side, its name above; print its line."""
    truth = read_truth(folder)
    strands, head = _reconstructed(folder, results, truth)
    chosen = np.linspace(0, len(truth.strands) - 1, min(GUIDES, len(truth.strands)))
    wanted = truth.strands.select(chosen.astype(np.int64))
    cameras = framing_cameras(wanted.points, TURN, WIDTH, HEIGHT)
    pictures = []
    for camera in cameras:
        pictures += draw_views(wanted, truth.head, [camera]) + draw_views(strands, head, [camera])
    row = np.concatenate(pictures, axis=1)
    caption = np.full((CAPTION, row.shape[1], 3), 255, np.uint8)
    text = f"{folder.name}: true and ours from above, from the left, from behind"
    cv2.putText(
        caption, text, (4, CAPTION - 5), cv2.FONT_HERSHEY_SIMPLEX, 0.42, INK, 1, cv2.LINE_AA
    )
    lengths = [1000 * float(s.lengths().mean()) for s in (strands, wanted)]
    print(f"| {folder.name} | {len(strands)} | {lengths[0]:.0f} | {lengths[1]:.0f} |")
    return np.concatenate([caption, row])


def _reconstructed(folder: Path, results: Path | None, truth: Truth) -> tuple[Strands, Head]:
    """Return strands and head of the capture in the truth's frame."""
    with tempfile.TemporaryDirectory() as made:
        out = Path(made) if results is None else results / folder.name
        if not (out / "groom.npz").exists():
            reconstruct(folder, out, guides=GUIDES, sheet=False)
        found = read_prediction(out).in_order_of(truth)
    groom = found.groom
    points = alignment_points(groom.strands, groom.head.vertices)
    similarity = align(found.cameras, truth.cameras, points)
    head = replace(groom.head, vertices=similarity.apply(groom.head.vertices))
    return similarity.moved_strands(groom.strands), head


if __name__ == "__main__":
    main()
