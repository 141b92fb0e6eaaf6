"""Image Analogies: how good the fast search is beside an exhaustive one, and how much faster.

python benchmarks/analogies.py

Four analogies of the kinds that Hertzmann et al. (2001) show, on pictures drawn from random
numbers: texture by numbers, blurred to sharp, embossed, painted. `search` and `exhaustive` compare
B' of the plugin's search and of an exhaustive one, by a plain twin of the program in NumPy, with
what the filter itself makes of B: PSNR in decibels and SSIM (Wang et al. 2004, luminance), the mean
over `SEEDS` pairs. Texture by numbers has no pixelwise truth; there the mean over patches of
the distance to the nearest patch of the example's picture stands in for it, as PSNR.
`seconds` are of the processor for a picture of `LARGE` pixels square, `plain` those of
the same twin with SciPy's k-d tree (eps = 1, as Hertzmann's), measured on `ROWS` rows of the
finest level and extended to all levels.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

import cv2
import numpy as np
from example_textures import blur, draw_map, draw_scene, draw_skin, emboss, paint
from hairkit_plugins.image_analogies import Options
from hairkit_plugins.image_analogies.pyramid import count_levels
from hairkit_plugins.image_analogies.synthesis import Settings, synthesise
from plain_analogies import PlainLevel, plain_analogy, pyramid
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.parallel import one_blas_thread

SMALL, LARGE = 64, 512
"""Pixels of the pictures that are compared, and of those that are timed."""
SEEDS = 3
"""Pairs of pictures of each kind."""
ROWS = 2
"""Rows that the plain twin is timed on."""
PATCH = 5
"""Pixels of the patches whose nearest is looked for."""
_LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)
_SSIM_SIGMA, _SSIM_C1, _SSIM_C2 = 1.5, 0.01**2, 0.03**2
"""Window and constants of the structural similarity, for values from 0 to 1."""

Pictures = tuple[UInt8Array, UInt8Array, UInt8Array, UInt8Array]
"""A, A', B and what the filter makes of B."""


def by_numbers(size: int, seed: int) -> Pictures:
    """Return a painted map, and another map."""
    return *draw_map(size, 2 * seed), *draw_map(size, 2 * seed + 1)


def sharpened(size: int, seed: int) -> Pictures:
    """Return blurred and sharp skin, twice."""
    first, second = (draw_skin(size, 2 * seed + k, scale=2.0) for k in (0, 1))
    return blur(first), first, blur(second), second


def filtered(way: Callable[[UInt8Array], UInt8Array]) -> Callable[[int, int], Pictures]:
    """Return a maker of two scenes and what a filter makes of them."""

    def make(size: int, seed: int) -> Pictures:
        first, second = (draw_scene(size, 2 * seed + k) for k in (0, 1))
        return first, way(first), second, way(second)

    return make


KINDS: dict[str, tuple[Callable[[int, int], Pictures], bool]] = {
    "texture by numbers": (by_numbers, True),
    "blurred to sharp": (sharpened, False),
    "emboss": (filtered(emboss), False),
    "painted": (filtered(paint), False),
}
"""What makes the pictures, and whether colours are matched."""


@one_blas_thread()
def main() -> int:
    """Print a row for each kind."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    print("| analogy | search | exhaustive | SSIM | SSIM | seconds | plain, s | times faster |")
    print("|---|---|---|---|---|---|---|---|")
    for name, (make, colours) in KINDS.items():
        quality = np.mean([compare(make(SMALL, seed), colours) for seed in range(SEEDS)], axis=0)
        fast, plain = seconds(make(LARGE, 0), colours)
        print(
            f"| {name} | {quality[0]:.2f} | {quality[1]:.2f} | {quality[2]:.3f} | {quality[3]:.3f}"
            f" | {fast:.1f} | {plain:.0f} | {plain / fast:.0f} |",
            flush=True,
        )
    return 0


def compare(pictures: Pictures, colours: bool) -> list[float]:
    """Return PSNR of the search, of the exhaustive one, and both SSIM."""
    (source, example, given), settings = prepare(pictures[:3], colours)
    fast, _ = synthesise(source, example, given, settings)
    slow = plain_analogy(source, example, given, settings.levels, settings.kappa)
    truth = numbers(pictures[3], colours)
    made = [np.asarray(image, np.float64).clip(0, 1) for image in (fast, slow)]
    if colours:
        errors = [_patch_error(image, example) for image in made]
    else:
        errors = [float(((image - truth) ** 2).mean()) for image in made]
    likeness = [ssim(image.mean(axis=2), truth.mean(axis=2)) for image in made]
    return [*(-10 * np.log10(max(error, 1e-9)) for error in errors), *likeness]


def seconds(pictures: Pictures, colours: bool) -> tuple[float, float]:
    """Return processor seconds of the plugin and of the plain twin."""
    images, settings = prepare(pictures[:3], colours)
    synthesise(*(image[:16, :16] for image in images), settings)  # compiles
    began = time.process_time()
    synthesise(*images, settings)
    fast = time.process_time() - began
    pyramids = [pyramid(image, 2) for image in images]
    coarse: list[Float32Array | None] = [p[1] for p in pyramids]
    twin = PlainLevel(pyramids, 0, pyramids[2][1].astype(np.float64), coarse, None)
    began = time.process_time()
    twin.prepare(1.0)
    built = time.process_time() - began
    began = time.process_time()
    for row in range(ROWS):
        for column in range(images[2].shape[1]):
            twin.fill(row, column, 1 + settings.kappa)
    searched = (time.process_time() - began) / ROWS * images[2].shape[0]
    all_levels = sum(0.25**level for level in range(settings.levels))
    return fast, (built + searched) * all_levels


def prepare(
    pictures: tuple[UInt8Array, ...], colours: bool
) -> tuple[tuple[Float32Array, ...], Settings]:
    """Return the pictures as numbers from 0 to 1, and the plugin's default settings."""
    images, options = tuple(numbers(picture, colours) for picture in pictures), Options()
    levels = count_levels(options.levels, *images)
    return images, Settings(levels, options.kappa, options.alpha, options.leaves)


def numbers(picture: UInt8Array, colours: bool) -> Float32Array:
    """Return colours (H, W, 3) or luminance (H, W, 1), from 0 to 1."""
    image = picture.astype(np.float32) / np.float32(255)
    return image if colours else (image @ _LUMINANCE)[..., None]


def ssim(first: Float64Array, second: Float64Array) -> float:
    """Return the mean structural similarity of two images (H, W) of values from 0 to 1."""
    means = [cv2.GaussianBlur(image, (0, 0), _SSIM_SIGMA) for image in (first, second)]
    spread = [
        cv2.GaussianBlur(a * b, (0, 0), _SSIM_SIGMA) for a, b in
        ((first, first), (second, second), (first, second))
    ]  # fmt: skip
    product = means[0] * means[1]
    squares = means[0] ** 2 + means[1] ** 2
    covariance = spread[2] - product
    variance = spread[0] + spread[1] - squares
    top = (2 * product + _SSIM_C1) * (2 * covariance + _SSIM_C2)
    return float((top / ((squares + _SSIM_C1) * (variance + _SSIM_C2))).mean())


def _patch_error(made: Float64Array, example: Float32Array) -> float:
    """Return the mean squared distance of a pixel to the nearest patch of the example."""
    first, second = (
        np.lib.stride_tricks.sliding_window_view(image, (PATCH, PATCH), axis=(0, 1))
        .reshape(-1, PATCH * PATCH * image.shape[2]) for image in (made, example)
    )  # fmt: skip
    return float((cKDTree(second).query(first[::7])[0] ** 2).mean() / first.shape[1])


if __name__ == "__main__":
    sys.exit(main())
