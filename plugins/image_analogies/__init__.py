"""Textures after an example pair: Image Analogies (Hertzmann et al. 2001).

* `blur_match`: the blur that makes the example look like the texture
* `features`: windows around a pixel, and their distance
* `pyramid`: Gaussian pyramids
* `search_tree`: nearest features by a k-d tree
* `synthesis`: the analogy, level by level
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Int32Array
from hairkit.errors import InputError
from hairkit.hookspecs import hookimpl
from hairkit.io.textures import read_texture
from hairkit.options import option
from hairkit.types.skin import Texture
from hairkit.types.texture_example import TextureExample

from .blur_match import blur, find_blur
from .synthesis import Settings, synthesise

_log = logging.getLogger("hairkit")

_LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of R, G and B in Y of YIQ (ITU-R BT.601)."""
_LEAST_DEVIATION = 1e-3
"""Deviation of the luminance, of 1, below which a picture has no contrast to be matched."""
SHARE_OF_EDGE = 1 / 64
"""Width of the blur before colours are compared, by the texture's shorter side."""
LEAST_SHARE = 0.01
"""Share of the example that an area must have, below which the whole example is used for it."""
_ROUNDS, _TOLERANCE, _TRIES, _SEED = 30, 0.1, 3, 1
"""Of k-means: rounds at most, moves of the means in CIELAB at which it ends, starts, and their
seed."""


@dataclass(frozen=True)
class Options:
    """Settings of Image Analogies."""

    kappa: float = option(
        2.0, low=0.0, high=100.0, doc="Preference for pieces of the example over single pixels."
    )
    alpha: float | None = option(
        None,
        low=0.0,
        high=1.0,
        doc="Weight of the filtered example against its source (Graham 2013); none for both.",
    )
    colours: bool = option(
        False, doc="Match and take colours; otherwise luminance, and the texture keeps its own."
    )
    remap: bool = option(
        True, doc="Bring the example to the texture's mean and deviation of luminance."
    )
    levels: int = option(5, low=1, high=10, doc="Levels of the pyramid at most.")
    leaves: int = option(
        16, low=1, high=1_000_000, doc="Leaves of the search tree that are looked at, at most."
    )
    regions: int = option(
        1, low=1, high=16, doc="Areas of common colour that are synthesised one by one."
    )
    border: int = option(
        16, low=0, high=1000, doc="Width of the blend between two of them.", unit="px"
    )
    blur: float | None = option(
        None, low=0.0, high=100.0, unit="px", doc="Gaussian for an example without a source."
    )
    close_up: Path | None = option(
        None, doc="Picture of sharp skin that the texture of a reconstruction follows."
    )


@hookimpl
def enhance_texture(texture: Texture, example: TextureExample | None, options: Options) -> Texture:
    """Return B' of the texture B and the example A, A'; of the size of B."""
    if example is None:
        example = _close_up(options)
    given = _as_floats(texture)
    filtered = _as_floats(example.filtered)
    if example.source is not None:
        source = _as_floats(example.source)
    else:
        source = blur(filtered, _blur_of(filtered, given, options))
    settings = Settings(options.levels, options.kappa, options.alpha, options.leaves)
    if options.regions == 1:
        made = _enhance(source, filtered, given, settings, options, None, None)
    else:
        made = _by_regions(source, filtered, given, settings, options)
    return Texture.encode(np.rint(255 * made.clip(0, 1)).astype(np.uint8))


def _close_up(options: Options) -> TextureExample:
    if options.close_up is None:
        raise InputError("image_analogies: no example; name a close-up of skin by close_up=FILE")
    return TextureExample(read_texture(options.close_up))


def _blur_of(filtered: Float32Array, given: Float32Array, options: Options) -> float:
    """Return the deviation of the blur that makes the source from the filtered picture."""
    if options.blur is not None:
        return options.blur
    found = find_blur(filtered @ _LUMINANCE, given @ _LUMINANCE)
    if found == 0:
        _log.warning("the texture is as sharp as the example; nothing is to be gained from it")
    return found


def _by_regions(
    source: Float32Array,
    filtered: Float32Array,
    given: Float32Array,
    settings: Settings,
    options: Options,
) -> Float32Array:
    """Synthesise every area with half of its borders, and blend them."""
    regions, others = find_regions(given, source, options.regions)
    weights = blend_weights(regions, options.regions, options.border)
    made = np.zeros_like(given)
    for number in np.unique(regions):
        share = weights[number]
        allowed = allowed_pixels(others, number)
        area = _enhance(source, filtered, given, settings, options, allowed, share > 0)
        made += share[..., None] * area
    return made


def _enhance(
    source: Float32Array,
    filtered: Float32Array,
    given: Float32Array,
    settings: Settings,
    options: Options,
    allowed: BoolArray | None,
    wanted: BoolArray | None,
) -> Float32Array:
    """Return B' (h, w, 3); `allowed` and `wanted` are masks of the example and the texture."""
    if options.colours:
        return synthesise(source, filtered, given, settings, allowed, wanted)[0]
    luminance = given @ _LUMINANCE
    gain, offset = 1.0, 0.0
    if options.remap:
        of_source = (source @ _LUMINANCE)[allowed if allowed is not None else ...]
        gain, offset = _remapping(of_source, luminance[wanted if wanted is not None else ...])
    pair = [(gain * (i @ _LUMINANCE) + offset)[..., None] for i in (source, filtered)]
    made, _ = synthesise(
        pair[0].astype(np.float32),
        pair[1].astype(np.float32),
        luminance[..., None],
        settings,
        allowed,
        wanted,
    )
    return np.asarray(given + (made - luminance[..., None]), np.float32)  # I and Q stay


def _remapping(example: Float32Array, texture: Float32Array) -> tuple[float, float]:
    """Return gain and offset to the texture's mean and deviation (Hertzmann 2001, 3.4)."""
    spread = float(example.std())
    gain = float(texture.std()) / spread if spread > _LEAST_DEVIATION else 1.0
    return gain, float(texture.mean()) - gain * float(example.mean())


def _as_floats(texture: Texture) -> Float32Array:
    """Return (H, W, 3) RGB from 0 to 1."""
    return np.asarray(texture.pixels, np.float32) / np.float32(255)


def find_regions(
    texture: Float32Array, example: Float32Array, count: int
) -> tuple[Int32Array, Int32Array]:
    """Return the regions (h, w) of a texture and (H, W) of its example, numbers below `count`.

    A face has areas of different skin: lips, cheeks, chin. Both pictures are divided by the same
    mean colours, k-means in CIELAB of the blurred texture.
    Both pictures are RGB (h, w, 3) from 0 to 1.
    """
    colours = _smooth_lab(texture)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, _ROUNDS, _TOLERANCE)
    cv2.setRNGSeed(_SEED)
    labels = np.zeros((colours.shape[0] * colours.shape[1], 1), np.int32)
    _, labels, means = cv2.kmeans(
        colours.reshape(-1, 3), count, labels, criteria, _TRIES, cv2.KMEANS_PP_CENTERS
    )
    others = _smooth_lab(example)
    nearest = np.square(others[:, :, None] - means).sum(axis=-1).argmin(axis=-1)
    return labels.reshape(colours.shape[:2]).astype(np.int32), nearest.astype(np.int32)


def allowed_pixels(regions: Int32Array, number: int) -> BoolArray:
    """Return (H, W) where the example may be used for a region: there, or everywhere if small."""
    inside = regions == number
    return inside if inside.mean() >= LEAST_SHARE else np.ones_like(inside)


def blend_weights(regions: Int32Array, count: int, border: int) -> Float32Array:
    """Return (N, h, w) the weight of each region: 1 inside, linear over `border` pixels, sum 1.

    A mean over a square of `border` pixels makes the step at a straight edge a linear ramp.
    """
    size = (2 * (border // 2) + 1,) * 2
    ramps = [
        cv2.blur((regions == n).astype(np.float32), size, borderType=cv2.BORDER_REPLICATE)
        for n in range(count)
    ]
    weights = np.stack(ramps).clip(0)
    weights[weights < np.float32(1 / (size[0] * size[1] + 1))] = 0  # round-off of the running sums
    return np.asarray(weights / weights.sum(axis=0), np.float32)


def _smooth_lab(image: Float32Array) -> Float32Array:
    sigma = max(min(image.shape[:2]) * SHARE_OF_EDGE, 1.0)
    return np.asarray(cv2.cvtColor(cv2.GaussianBlur(image, (0, 0), sigma), cv2.COLOR_RGB2LAB))
