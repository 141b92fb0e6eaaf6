"""Draws the default head's skin in several looks, and prints what each costs.

python studies/skin_looks.py -o docs/images/skin_looks.jpg

The upper row: without diffusion, with it, with mean free paths three times as long, smooth oil. The
lower row: a normal map, a roughness map, more blood and more melanin in the cheeks. The table has
processor seconds for one picture and the mean linear colour of the drawn skin over that of the
default look.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.colour import linear_from_srgb
from hairkit.head_model.template import default_head
from hairkit.imaging.relief import normal_from_height
from hairkit.imaging.skin_colour import NEUTRAL, tint_albedo
from hairkit.rendering import draw_views
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.skin_look import SkinLook
from hairkit.types.strands import Strands

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from example_textures import noise

HEIGHT = 480
"""Pixels of a picture; a quarter narrower than high."""
MAP = 1024
"""Pixels of the edge of a map."""


def main() -> int:
    """Draw every look and print its row."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="JPEG of all looks")
    out = parser.parse_args().output
    head = default_head()
    draw(head, SkinLook())  # compiles the shaders
    reference = draw(head, SkinLook())
    print("| look | seconds | red | green | blue |\n|---|---|---|---|---|")
    pictures = []
    for name, (look, change) in LOOKS.items():
        changed = change(head)
        began = time.process_time()
        picture = draw(changed, look)
        seconds = time.process_time() - began
        ratio = colour(picture) / colour(reference)
        print(f"| {name} | {seconds:.1f} | " + " | ".join(f"{r:.2f}" for r in ratio) + " |")
        pictures.append(picture)
    rows = [np.hstack(pictures[:4]), np.hstack(pictures[4:])]
    sheet = Texture.encode(np.vstack(rows), lossless=False)
    out.write_bytes(sheet.data.tobytes())
    return 0


def draw(head: Head, look: SkinLook) -> UInt8Array:
    """Return the head from the front left, without hair."""
    width = 3 * HEIGHT // 4
    camera = Camera.on_turn(
        25, distance=0.9, focal=2.6 * HEIGHT, width=width, height=HEIGHT, target=(0, -0.04, 0)
    )
    bald = Strands(np.zeros((0, 3), np.float32), np.zeros(1, np.int64))
    [picture] = draw_views(bald, head, [camera], bust=True, skin=look)
    return picture


def colour(picture: UInt8Array) -> np.ndarray:
    """Return the mean linear colour (3,) of the middle of a picture."""
    height, width = picture.shape[:2]
    middle = picture[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3]
    return np.asarray(linear_from_srgb(middle / 255).mean(axis=(0, 1)))


def with_maps(**maps: UInt8Array) -> Callable[[Head], Head]:
    """Return a change that adds maps to a head."""

    def change(head: Head) -> Head:
        assert head.maps is not None
        own = {name: Texture.encode(pixels) for name, pixels in maps.items()}
        return replace(head, maps=replace(head.maps, **own))

    return change


def tinted(name: str) -> Callable[[Head], Head]:
    """Return a change that puts more of a pigment into blotches of the skin."""

    def change(head: Head) -> Head:
        maps = head.maps or SkinMaps()
        assert maps.albedo is not None
        blotch = np.clip(noise(np.random.default_rng(3), MAP, MAP / 24) + 0.4, 0, 0.8)
        level = (NEUTRAL + blotch * (255 - NEUTRAL)).astype(np.uint8)
        pixels = tint_albedo(maps.albedo.pixels, **{name: level})
        return replace(head, maps=replace(maps, albedo=Texture.encode(pixels)))

    return change


def _pores() -> UInt8Array:
    height = 128 + 40 * noise(np.random.default_rng(1), MAP, 1.5)
    return normal_from_height(np.clip(height, 0, 255).astype(np.uint8), 2.5)


def _oily_patches() -> UInt8Array:
    patches = 140 + 60 * noise(np.random.default_rng(2), MAP, MAP / 40)
    return np.asarray(cv2.convertScaleAbs(np.clip(patches, 60, 230)), np.uint8)


def _same(head: Head) -> Head:
    return head


LOOKS: dict[str, tuple[SkinLook, Callable[[Head], Head]]] = {
    "no diffusion": (SkinLook(mean_free_path=(0.0, 0.0, 0.0)), _same),
    "default": (SkinLook(), _same),
    "three times the mean free path": (SkinLook(mean_free_path=(0.011, 0.0041, 0.002)), _same),
    "roughness 0.35": (SkinLook(roughness=0.35), _same),
    "normal map": (SkinLook(), with_maps(normal=_pores())),
    "roughness map": (SkinLook(), with_maps(roughness=_oily_patches())),
    "blood": (SkinLook(), tinted("blood")),
    "melanin": (SkinLook(), tinted("melanin")),
}
"""Looks, and what they change on the head."""


if __name__ == "__main__":
    sys.exit(main())
