"""The light of the photos taken out of a head's colours.

Seen skin is taken to have nearly one albedo. What its brightness owes to the direction of its
surface is the irradiance, a polynomial of second degree in the normal (Ramamoorthi and Hanrahan
2001), fitted by robust least squares, so that brows, eyes and lips do not count. What is left over
centimetres is light too, such as the shadow below the chin or of the hair (Horn 1974). The map is
divided by both, each channel by its own: the shadow of brown hair is orange.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array

Floats = npt.NDArray[np.floating[Any]]

GAMMA = 2.2
"""Exponent from sRGB to linear light, close enough for ratios."""
STEP = 2
"""Texels between those to which light is fitted."""
ROUNDS = 12
"""Rounds of reweighted least squares."""
SPREAD = 0.18
"""Relative difference from the fit from which a texel counts less: pores and noise are below."""
RIDGE = 0.01
"""Weight of the belief that light is even, in shares of the weight of all texels, times the squared
degree: directions that no view sees stay at the mean. From 0.003 to 0.03 the map hardly changes."""
DARKEST, BRIGHTEST = 0.3, 2.5
"""Bounds of the irradiance, in shares of its mean."""
REACH = 14.0
"""Sigma over which leftover brightness is light, texels of 1 mm: broader than brows and lips."""
LARGEST = 0.6
"""Largest logarithm of the leftover that is taken out."""
LEAST = 1e-6
"""Least weight that is divided by."""


def find_shading(
    colours: Float32Array, weight: Float32Array, normals: Float32Array
) -> Float32Array:
    """Return the factors (H, W, 3) of the light in a map of colours, of mean 1 where skin is seen.

    Each channel has its own: light from a window is bluer than what walls, hair and skin return.

    Parameters
    ----------
    colours
        (H, W, 3) sRGB, 0 to 255.
    weight
        (H, W) how well each texel is seen, and how much it is skin; 0: not at all.
    normals
        (H, W, 3) unit normals of the head.

    Returns
    -------
    shading
        Factors of sRGB values: the linear light to the power of 1 / 2.2.
    """
    if not weight.any():
        return np.ones(colours.shape, np.float32)
    linear = (np.maximum(colours, 1.0) / 255.0) ** GAMMA
    return np.stack([_shade(channel, weight, normals) for channel in linear.transpose(2, 0, 1)], 2)


def _shade(brightness: Floats, weight: Float32Array, normals: Float32Array) -> Float32Array:
    """Return the factor (H, W) of one channel's light."""
    seen = weight > 0
    step = STEP if seen[::STEP, ::STEP].any() else 1
    few = slice(None, None, step), slice(None, None, step)
    light = _fit_light(normals[few], brightness[few], weight[few])
    shading = harmonics(normals) @ light
    mean = float(np.average(shading[seen], weights=weight[seen]))
    trust = _agreement(brightness, np.maximum(shading, DARKEST * np.median(brightness[seen])))
    shading = np.clip(shading, DARKEST * mean, BRIGHTEST * mean)
    skin = np.asarray(weight * trust, np.float32)
    shading *= np.exp(_leftover(brightness / shading, skin))
    level = np.average(np.log(shading[seen]), weights=weight[seen])
    return np.asarray((shading / np.exp(level)) ** (1 / GAMMA), np.float32)


def harmonics(normals: Floats) -> Floats:
    """Return (..., 9) the real spherical harmonics up to degree 2, without their factors."""
    x, y, z = np.moveaxis(normals, -1, 0)
    terms = [np.ones_like(x), y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y]
    return np.stack(terms, axis=-1)


def _fit_light(normals: Floats, brightness: Floats, weight: Floats) -> Float32Array:
    """Return the light (9,) that fits a map's brightness (H, W) best."""
    seen = weight > 0
    basis, brightness = harmonics(normals[seen]).astype(np.float64), brightness[seen]
    weight = weight[seen].astype(np.float64)
    degree = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2])
    ridge = np.diag(RIDGE * weight.sum() * degree**2)
    darkest = DARKEST * np.median(brightness)
    trust: Floats = np.ones(len(weight))
    light: Floats = np.zeros(len(degree))
    for _ in range(ROUNDS):
        weighted = basis * (weight * trust)[:, None]
        light = np.linalg.solve(weighted.T @ basis + ridge, weighted.T @ brightness)
        trust = _agreement(brightness, np.maximum(basis @ light, darkest))
    return light.astype(np.float32)


def _agreement(brightness: Floats, fitted: Floats) -> Floats:
    """Return (...) how far texels agree with the fit, from 0 to 1."""
    return np.asarray(1 / (1 + ((brightness / fitted - 1) / SPREAD) ** 2) ** 2)


def _leftover(ratio: Floats, skin: Float32Array) -> Floats:
    """Return the smooth logarithm (H, W) of brightness over fitted light, 0 far from skin."""
    logs = np.log(np.clip(ratio, np.exp(-2 * LARGEST), np.exp(2 * LARGEST)))
    level = np.average(logs, weights=skin)
    total = cv2.GaussianBlur(skin, (0, 0), REACH)
    mean = cv2.GaussianBlur(((logs - level) * skin).astype(np.float32), (0, 0), REACH)
    peak = float(total.max())
    return np.asarray(np.clip(mean / np.maximum(total, LEAST * peak), -LARGEST, LARGEST))
