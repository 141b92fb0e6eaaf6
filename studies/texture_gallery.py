"""Draws the figures of the textures page: one row each, as JPEG.

python studies/texture_gallery.py -o docs/images

The rows are those of the figures in the report of the University of Bath ("Visual Effects", 2015):
regions of common colour, bump maps made sharp, textures made sharp, super-resolution, normal maps
after albedo. All pictures are drawn from random numbers. Prints a Markdown table: PSNR of the
input and of the result, in decibels, where the truth is known, and power of the detail (deviation
of the Laplacian) of input and result, over that of the truth.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from hairkit_plugins.image_analogies import find_regions

from hairkit.arrays import UInt8Array
from hairkit.imaging.relief import bump_from_albedo, draw_difference, normal_from_height
from hairkit.manager import Manager
from hairkit.parallel import one_blas_thread
from hairkit.types.skin import Texture
from hairkit.types.texture_example import TextureExample

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from example_textures import blur, draw_skin, noise

SIZE = 256
"""Pixels of a picture's edge."""
GAP = 6
"""White pixels between two pictures."""
ALPHA = 0.1
"""Graham's weight, as `hairkit texture sharpen` takes it."""
_ZONES = np.array([[235, 120, 90], [90, 160, 220], [120, 200, 120], [240, 210, 90]], np.uint8)


@one_blas_thread()
def main() -> int:
    """Draw every row and print its figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder of the pictures")
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    manager = Manager.loaded()
    print("| figure | PSNR before | after | detail before | after |\n|---|---|---|---|---|")
    for name, draw in FIGURES.items():
        pictures, before, after, truth = draw(manager)
        row = [np.pad(p, ((0, 0), (0, GAP), (0, 0)), constant_values=255) for p in pictures]
        sheet = np.hstack(row)[:, :-GAP]
        (folder / f"texture_{name}.jpg").write_bytes(
            Texture.encode(sheet, lossless=False).data.tobytes()
        )
        scores = [psnr(before, truth), psnr(after, truth)]
        scores += [detail(before) / detail(truth), detail(after) / detail(truth)]
        print(f"| {name} | " + " | ".join(f"{score:.2f}" for score in scores) + " |", flush=True)
    return 0


Row = tuple[list[UInt8Array], UInt8Array, UInt8Array, UInt8Array]
"""The pictures of a row; then input, result and truth, which are compared."""


def draw_face(seed: int) -> UInt8Array:
    """Return skin in three areas of common colour: cheek, lip, brow."""
    skin = draw_skin(SIZE, seed, scale=1.5).astype(np.float32)
    row = np.arange(SIZE)[:, None] + 8 * noise(np.random.default_rng(seed), SIZE, SIZE / 12)
    lip, brow = row > 0.68 * SIZE, row < 0.3 * SIZE
    colour = np.where(lip[..., None], [0.82, 0.55, 0.6], np.where(brow[..., None], 0.72, 1.0))
    return np.clip(skin * colour, 0, 255).astype(np.uint8)


def regions(manager: Manager) -> Row:
    """Figure 2: the texture, its regions, and the result with and without them."""
    truth, close_up = draw_face(1), draw_face(2)
    scan = blur(truth, 1.5)
    found, _ = find_regions(scan / np.float32(255), close_up / np.float32(255), 3)
    example = TextureExample(Texture.encode(close_up))
    whole, apart = (enhance(manager, scan, example, regions=n, alpha=ALPHA) for n in (1, 3))
    return [scan, _ZONES[found], whole, apart, truth], scan, apart, truth


def bump(manager: Manager) -> Row:
    """Figure 3: A, A', B, results of two alphas, the truth; the bump maps are heights."""
    sharp, truth = (bump_from_albedo(draw_skin(SIZE, n, scale=2.0)) for n in (3, 4))
    sharp, truth = (np.repeat(p[..., None], 3, axis=2) for p in (sharp, truth))
    source, given = blur(sharp, 1.5), blur(truth, 1.5)
    example = TextureExample(Texture.encode(sharp), Texture.encode(source))
    classic, weighted = (enhance(manager, given, example, alpha=a) for a in (None, ALPHA))
    return [source, sharp, given, classic, weighted, truth], given, weighted, truth


def sharpen(manager: Manager) -> Row:
    """Figure 4: the scan, the close-up, the result, what changed, the truth."""
    truth, close_up = (draw_skin(SIZE, n, scale=1.5) for n in (5, 6))
    scan = blur(truth, 1.5)
    made = enhance(manager, scan, TextureExample(Texture.encode(close_up)), alpha=ALPHA)
    return [scan, close_up, made, draw_difference(scan, made), truth], scan, made, truth


def super_resolution(manager: Manager) -> Row:
    """Figure 5: the texture enlarged by cubic interpolation and by dictionaries, the truth."""
    truth, close_up = (draw_skin(SIZE, n, scale=1.0) for n in (7, 8))
    half = np.asarray(cv2.resize(truth, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))
    made = enhance(
        manager, half, TextureExample(Texture.encode(close_up)), using="super_resolution"
    )
    cubic = np.asarray(cv2.resize(half, (SIZE, SIZE), interpolation=cv2.INTER_CUBIC), np.uint8)
    return [cubic, made, draw_difference(cubic, made), truth], cubic, made, truth


def normal(manager: Manager) -> Row:
    """Figure 6: albedo, normal map after another albedo and its map, the difference, the truth."""
    albedos = [draw_skin(SIZE, n, scale=2.0) for n in (9, 10)]
    maps = [normal_from_height(blur(bump_from_albedo(a), 1.0), 6.0) for a in albedos]
    example = TextureExample(Texture.encode(maps[0]), Texture.encode(albedos[0]))
    made = enhance(manager, albedos[1], example, colours=True, remap=False, alpha=ALPHA)
    flat = np.full_like(made, (128, 128, 255))
    return [albedos[1], made, draw_difference(maps[1], made), maps[1]], flat, made, maps[1]


FIGURES = {
    "regions": regions,
    "bump": bump,
    "sharpen": sharpen,
    "super_resolution": super_resolution,
    "normal": normal,
}
"""Rows by the name of their file."""


def enhance(
    manager: Manager,
    texture: UInt8Array,
    example: TextureExample,
    using: str = "image_analogies",
    **values: Any,
) -> UInt8Array:
    """Return what a plugin makes of a texture."""
    made = manager.call(
        "enhance_texture", using, values, texture=Texture.encode(texture), example=example
    )
    return np.asarray(made.pixels)


def psnr(first: UInt8Array, second: UInt8Array) -> float:
    """Return the peak signal-to-noise ratio, decibels."""
    error = first.astype(np.float64) - second
    return float(10 * np.log10(255**2 / max((error**2).mean(), 1e-9)))


def detail(picture: UInt8Array) -> float:
    """Return the deviation of the Laplacian."""
    return float(cv2.Laplacian(picture, cv2.CV_32F).std())


if __name__ == "__main__":
    sys.exit(main())
