"""Print errors of 2D orientation against the colour and the gloss of hair.

python studies/orientation_looks.py

Photographs two procedural heads, straight and wavy, in each colour and gloss, and measures both
orienters with true masks: mean degrees over the hair, then of the half with the most confidence;
guessing gives 45. Gloss is that of the surface reflection (the lobe R of `marschner.glsl`): matt
has none; greasy thrice the usual strength, in a lobe of 0.6 times the width.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from hairkit_plugins import gabor, structure_tensor

from hairkit.head_model.template import default_head
from hairkit.rendering import fibre
from hairkit.synth import StyleName, grow, photograph

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from orientation import Sample, plugin, read_samples, score

COLOURS = {
    "black": (0.010, 0.008, 0.007),
    "brown": (0.060, 0.036, 0.022),
    "red": (0.230, 0.060, 0.020),
    "blond": (0.450, 0.300, 0.150),
    "grey": (0.420, 0.420, 0.430),
}
"""Linear RGB at the root."""
TIP = 1.25
"""Colour at the tip over that at the root."""
GLOSS = {"matt": (0.0, 1.0), "usual": (1.0, 1.0), "greasy": (3.0, 0.6)}
"""Factors of strength and width of the light that the surface reflects."""
STYLES: tuple[StyleName, ...] = ("straight", "wavy")
STRANDS, SIZE, VIEWS = 8000, (540, 720), 3
METHODS = {"structure_tensor": plugin(structure_tensor), "gabor": plugin(gabor)}


def main() -> int:
    """Photograph, measure, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args()
    cv2.setNumThreads(1)
    names = [f"{method}, {gloss}" for method in METHODS for gloss in GLOSS]
    print("| hair | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 1))
    for style in STYLES:
        for colour in COLOURS:
            samples = {gloss: _photographed(style, colour, gloss) for gloss in GLOSS}
            cells = []
            for orient in METHODS.values():
                scores = [score(orient, samples[gloss]) for gloss in GLOSS]
                cells += [f"{mean:.1f} / {sure:.1f}" for mean, sure, _ in scores]
            print(f"| {style}, {colour} | " + " | ".join(cells) + " |", flush=True)
    return 0


def _photographed(style: StyleName, colour: str, gloss: str) -> list[Sample]:
    with tempfile.TemporaryDirectory() as folder:
        spawn = multiprocessing.get_context("spawn")  # a process compiles its shaders once
        with ProcessPoolExecutor(1, mp_context=spawn) as pool:
            look = style, COLOURS[colour], GLOSS[gloss]
            pool.submit(_photograph, *look, STRANDS, SIZE, folder).result()
        return read_samples(Path(folder))


def _photograph(
    style: StyleName,
    colour: tuple[float, float, float],
    gloss: tuple[float, float],
    strands: int,
    size: tuple[int, int],
    folder: str,
) -> None:
    """Write photos of the style, with the shader's surface reflection scaled."""
    fibre.FRESNEL, fibre.ROUGHNESS = gloss[0] * fibre.FRESNEL, gloss[1] * fibre.ROUGHNESS
    groom = grow(style, default_head(), strands)
    root = np.array(colour)
    material = replace(groom.material, root_colour=root, tip_colour=np.minimum(TIP * root, 1))
    photograph(replace(groom, material=material), folder, views=VIEWS, size=size)


if __name__ == "__main__":
    raise SystemExit(main())
