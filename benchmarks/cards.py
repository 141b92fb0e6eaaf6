"""Hair cards: how fast they are made, and how well they cover what the strands cover.

    python benchmarks/cards.py [--strands N] [--points N] [--cards N] [--atlas N] [-o PICTURE]

Prints for each style and level of detail the cards, the triangles, the seconds (wall, and of the
processor) in which all levels and maps were made, and the intersection over union of the coverage
from eight views: strands of their own width against cards cut out at alpha 0.4, where more than
half of a pixel is covered. -o draws the strands and all levels of the first style.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from card_picture import TexturedMesh, draw_cards
from hairkit_plugins import cards as plugin
from hairkit_plugins.cards.build import CardSet, Level, build_cards

from hairkit.head_model.template import default_head
from hairkit.imaging.picture_file import write_picture
from hairkit.rendering import draw, draw_layers
from hairkit.rendering.framing import framing_cameras
from hairkit.synth import grow
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom

STYLES = ("wavy", "straight", "curly")
VIEWS = [(45.0 * view, 0.0) for view in range(8)]
SIZE = (384, 512)
"""Pixels of a picture."""
WARM_UP = 200
"""Strands of a first run, which compiles the kernels."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strands", type=int, default=100_000)
    parser.add_argument("--points", type=int, default=32)
    parser.add_argument("--cards", type=int, default=plugin.Options.cards)
    parser.add_argument("--atlas", type=int, default=plugin.Options.atlas)
    parser.add_argument("-o", "--output", type=Path, help="picture")
    args = parser.parse_args()
    options = plugin.Options(cards=args.cards, atlas=args.atlas)
    build_cards(_groom(STYLES[0], WARM_UP, args.points), options)
    print("| hair | level | cards | triangles | seconds | processor | IoU, mean | least |")
    print("|---|---|---|---|---|---|---|---|")
    for style in STYLES:
        groom = _groom(style, args.strands, args.points)
        start, worked = time.perf_counter(), time.process_time()
        made = build_cards(groom, options)
        spent = time.perf_counter() - start, time.process_time() - worked
        cameras = framing_cameras(groom.strands.points, VIEWS, *SIZE)
        wanted = [_covered(groom, camera) for camera in cameras]
        for number, shots in enumerate(_drawn(made, groom, cameras)):
            found = [shot[..., 3] > 127 for shot in shots]
            pairs = zip(wanted, found, strict=True)
            scores = [(a & b).sum() / max((a | b).sum(), 1) for a, b in pairs]
            level = made.levels[number]
            print(
                f"| {style} | {number} | {len(level.cards)} | {len(level.faces)} |"
                f" {spent[0]:.1f} | {spent[1]:.1f} | {np.mean(scores):.3f} | {min(scores):.3f} |"
            )
        if args.output is not None and style == STYLES[0]:
            _write(args.output, groom, made, cameras)


def _groom(style: str, strands: int, points: int) -> Groom:
    groom = grow(style, default_head(), strands, 0)  # type: ignore[arg-type]
    return replace(groom, strands=groom.strands.resampled(points))


def _covered(groom: Groom, camera: Camera) -> np.ndarray:
    width = groom.material.width
    return draw_layers(groom.strands, groom.head, camera, width=width)[0] > 0.5


def _drawn(made: CardSet, groom: Groom, cameras: list[Camera]) -> list[list[np.ndarray]]:
    """Return the pictures (H, W, 4) of each level."""
    albedo = cv2.imdecode(np.frombuffer(made.maps["albedo"], np.uint8), cv2.IMREAD_UNCHANGED)
    picture = np.ascontiguousarray(albedo[..., [2, 1, 0, 3]])
    return [[*draw_cards(_textured(level, picture), groom.head, cameras)] for level in made.levels]


def _textured(level: Level, picture: np.ndarray) -> TexturedMesh:
    return TexturedMesh(level.vertices, level.faces, level.normals, level.uv, picture)


def _write(path: Path, groom: Groom, made: CardSet, cameras: list[Camera]) -> None:
    """Draw strands and levels from four sides, a row each."""
    shown = cameras[::2]
    rows = [[draw(groom, None, camera) for camera in shown]]
    for shots in _drawn(made, groom, shown):
        rows.append([shot[..., :3] for shot in shots])
    write_picture(path, np.concatenate([np.concatenate(row, axis=1) for row in rows]))


if __name__ == "__main__":
    main()
