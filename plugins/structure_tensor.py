"""Strand orientation from a multi-scale structure tensor: where brightness changes least.

The structure tensor (Bigun and Granlund 1987) is the mean of g g^T over a window, g the gradient.
Strands are long and thin, so brightness changes across them: the strand is the eigenvector of the
smaller eigenvalue, with the coherence (l1 - l2) / (l1 + l2). In double angles the tensor is a
vector (l1 - l2) (cos 2t, sin 2t) and its trace l1 + l2.

Photos of hair need four things more:

1. shading, highlights and silhouettes are removed: log luminance, minus its masked mean, over its
   local deviation; pixels of the mask's edge, which mix in the background, are left out;
2. the finest gradient shows strands best;
3. gradients are weighted by their length, not its square, so that outliers count less;
4. no window suits both straight hair and curls. The mean over the widest window is refined by every
   narrower one where the difference exceeds the noise (the Wiener gain of Lee 1980 on a Laplacian
   pyramid of the tensor, Burt and Adelson 1983).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import Float32Array, read_only
from hairkit.hookspecs import hookimpl
from hairkit.imaging.masked_filters import (
    blur,
    bounding_box,
    hair_of,
    local_contrast,
    luminance,
    masked_blur,
    picture_scale,
    single_angle,
    well_inside,
)
from hairkit.options import option
from hairkit.types.capture import View
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap

_SCHARR_GAIN = 32.0
"""Response of `cv2.Scharr` to a slope of one per pixel."""
_LEAST_GRADIENT_SIGMA = 0.7
"""Pixels; the Scharr kernel's own width, which a narrower Gaussian does not reduce."""
_NOISE_SIGMA = 4.0
"""Gaussian in cells of a level under which the power of its detail is measured."""
_TOP_QUANTILE, _LEAST_TOP = 0.95, 0.25
"""Quantile of the confidence that becomes 1, and the least value of it, so that the confidence of a
picture of nothing but noise stays low."""
_LEVEL_SIGMA = 1.0
"""Gaussian in cells of the finest level: its window is one step wide."""
_LEAST_ENERGY = 1e-3
"""Energy, as a share of that of full contrast, below which a window's direction is unknown."""
_AGREEMENT_SIGMA = 10.0
"""Pixels over which neighbouring angles should agree."""
_AGREEMENT_POWER = 16
"""The mean resultant of angles with deviation s is exp(-2 s^2); to this power, exp(-32 s^2): half
of the confidence is gone when neighbours differ by 8 degrees."""
_SURE_COHERENCE = 0.14
"""Coherence with a confidence of one half; straight hair has twice, white noise a tenth of it."""


@dataclass(frozen=True)
class Options:
    """Settings of the structure tensor; lengths are for pictures 1080 pixels high."""

    gradient_sigma: float = option(
        0.7, low=0.3, high=10.0, doc="Gaussian under the gradient.", unit="px"
    )
    window_sigma: float = option(
        32.0, low=1.0, high=128.0, doc="Widest Gaussian window of the tensor.", unit="px"
    )
    finest_window: float = option(
        2.0, low=1.0, high=32.0, doc="Narrowest window, from which noise is measured.", unit="px"
    )
    noise_gain: float = option(
        4.0,
        low=0.0,
        high=100.0,
        doc="Detail is kept where its power exceeds this multiple of the noise.",
    )
    contrast_sigma: float = option(
        5.0, low=1.0, high=50.0, doc="Gaussian of the local mean and deviation.", unit="px"
    )
    edge_sigma: float = option(
        2.0, low=0.0, high=10.0, doc="Width of the mask's edge that is left out.", unit="px"
    )


@hookimpl
def orient(view: View, mask: Mask, options: Options) -> OrientationMap:
    """Return the strand's angle and its confidence at every hair pixel."""
    scale = picture_scale(view.height)
    hair = hair_of(view, mask)
    box = bounding_box(hair, round(2 * options.contrast_sigma * scale))
    core = well_inside(hair[box], options.edge_sigma * scale).astype(np.float32)
    detail = local_contrast(luminance(view.image[box]), core, options.contrast_sigma * scale)
    levels = _window_means(_tensor(detail, core, options, scale), options, scale)
    vectors = _refine(levels, options)
    confidence = _confidence(vectors, levels[0].weight, options, scale)

    angle_map, confidence_map = (np.zeros(hair.shape, np.float32) for _ in range(2))
    angle_map[hair] = single_angle(_resize(vectors, core.shape)[hair[box]])
    confidence_map[hair] = _resize(confidence, core.shape)[hair[box]]
    return OrientationMap(read_only(angle_map), read_only(confidence_map))


@dataclass(frozen=True)
class _Level:
    """One window's means, on a grid whose step is the window's sigma."""

    coherence: Float32Array
    """(h, w, 2) (l1 - l2) / (l1 + l2) (cos 2t, sin 2t), t the strand's angle."""
    weight: Float32Array
    """(h, w) share of the window that lies on hair."""


def _tensor(
    detail: Float32Array, core: Float32Array, options: Options, scale: float
) -> Float32Array:
    """Return (H, W, 4): double-angle vector of the strand, energy, and weight, 0 outside `core`.

    Gradients are divided by their response to white noise.
    """
    sigma = options.gradient_sigma * scale
    gain = math.sqrt(8 * math.pi) * max(sigma, _LEAST_GRADIENT_SIGMA) ** 2 / _SCHARR_GAIN
    smooth = blur(detail, sigma)
    along_x = cv2.Scharr(smooth, cv2.CV_32F, 1, 0, scale=gain)
    along_y = cv2.Scharr(smooth, cv2.CV_32F, 0, 1, scale=gain)
    square_x, square_y = along_x * along_x, along_y * along_y
    energy = square_x + square_y
    weight = core / cv2.sqrt(energy + _LEAST_ENERGY)
    parts = (square_y - square_x) * weight, -2 * along_x * along_y * weight, energy * weight
    return np.asarray(cv2.merge([*parts, core]), np.float32)


def _window_means(tensor: Float32Array, options: Options, scale: float) -> list[_Level]:
    """Return the means of the tensor over windows from the finest to the widest, each doubled."""
    step = max(options.finest_window * scale, 1.0)
    doublings = max(round(math.log2(options.window_sigma / options.finest_window)), 0)
    levels, shape = [], tensor.shape[:2]
    for index in range(doublings + 1):
        height, width = (max(round(n / (step * 2**index)), 1) for n in shape)
        if index == 0:
            smaller = cv2.resize(tensor, (width, height), interpolation=cv2.INTER_AREA)
            tensor = blur(np.asarray(smaller, np.float32), _LEVEL_SIGMA)
        else:
            # Variances add: a window of 1 step under a Gaussian of sqrt(3) becomes one of 2 steps.
            tensor = blur(tensor, math.sqrt(3))
            tensor = _resize(tensor, (height, width))
        energy = tensor[..., 2:3] + _LEAST_ENERGY * tensor[..., 3:]
        coherence = (tensor[..., :2] / np.maximum(energy, 1e-9)).astype(np.float32)
        levels.append(_Level(coherence, tensor[..., 3].copy()))
    return levels


def _refine(levels: list[_Level], options: Options) -> Float32Array:
    """Return the widest window's vectors refined by every narrower one where it exceeds the noise.

    The difference between the two finest windows is taken for noise. Its power falls by 4 with
    every doubling of the window, and the rest of each difference is signal.
    """
    vectors = levels[-1].coherence
    if len(levels) < 3:
        return levels[0].coherence if len(levels) == 1 else _resize(vectors, levels[0].weight.shape)
    finest = _difference(levels[0], levels[1])
    total = float(levels[0].weight.sum(dtype=np.float64))
    noise = float((finest**2).sum(axis=-1).ravel() @ levels[0].weight.ravel()) / max(total, 1e-9)
    for index in range(len(levels) - 2, 0, -1):
        level = levels[index]
        added = _difference(level, levels[index + 1])
        power = masked_blur((added**2).sum(axis=-1), level.weight, _NOISE_SIGMA)
        floor = options.noise_gain * noise / 4**index
        gain = np.clip(1 - floor / np.maximum(power, 1e-9), 0, 1)
        vectors = _resize(vectors, level.weight.shape) + gain[..., None] * added
    return _resize(vectors, levels[0].weight.shape)


def _difference(fine: _Level, wide: _Level) -> Float32Array:
    return fine.coherence - _resize(wide.coherence, fine.weight.shape)


def _confidence(
    vectors: Float32Array, weight: Float32Array, options: Options, scale: float
) -> Float32Array:
    """Return the confidence in [0, 1]: high in coherent windows whose neighbours agree.

    It is divided by its quantile `_TOP_QUANTILE` in the picture.
    """
    squared = (vectors**2).sum(axis=-1)
    unit = vectors / np.sqrt(np.maximum(squared, 1e-12))[..., None]
    reach = _AGREEMENT_SIGMA * scale / max(options.finest_window * scale, 1.0)
    mean = masked_blur(unit, weight, reach)
    agreement = np.hypot(mean[..., 0], mean[..., 1]) ** _AGREEMENT_POWER
    confidence = agreement * squared / (squared + _SURE_COHERENCE**2)
    on_hair = confidence[weight > 0.5]
    top = float(np.quantile(on_hair, _TOP_QUANTILE)) if on_hair.size else 1.0
    return np.asarray(np.clip(confidence / max(top, _LEAST_TOP), 0, 1), np.float32)


def _resize(values: Float32Array, shape: tuple[int, ...]) -> Float32Array:
    """Return (h, w) or (h, w, C) values interpolated to `shape` = (H, W)."""
    if values.shape[:2] == shape[:2]:
        return values
    resized = cv2.resize(values, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    return np.asarray(resized, np.float32)
