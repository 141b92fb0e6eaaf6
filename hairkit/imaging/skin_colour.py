"""Blood and melanin in the skin, as two maps that change its albedo.

The light that skin returns falls exponentially with the pigments on its way (Tsumura et al. 2003):
log albedo is linear in both amounts. In the limit of diffusion its fall goes with the root of
absorption over scattering. Absorption at 600, 550 and 450 nm is Prahl's of oxygenated blood, and
proportional to the wavelength to the power of -3.33 for melanin; scattering goes with the power of
-1.3 (Jacques 2013). Both are given over green.
"""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.colour import linear_from_srgb, srgb_from_linear

_SCATTERING = np.array([0.89, 1.0, 1.3])
BLOOD = np.sqrt(np.array([0.074, 1.0, 1.46]) / _SCATTERING)
"""Fall of log albedo by oxygenated blood for red, green and blue, over that for green."""
MELANIN = np.sqrt(np.array([0.75, 1.0, 1.95]) / _SCATTERING)
"""The same by melanin."""
NEUTRAL = 128
"""Level of a map that changes nothing; higher is more of the pigment."""
FULL = 0.6
"""Fall of log albedo in green that a map's 255 adds, and nearly what its 0 takes away."""


def tint_albedo(
    albedo: UInt8Array, blood: UInt8Array | None = None, melanin: UInt8Array | None = None
) -> UInt8Array:
    """Return an albedo (H, W, 3) sRGB with more or less blood and melanin.

    Parameters
    ----------
    albedo
        (H, W, 3) sRGB.
    blood, melanin
        (h, w) levels around `NEUTRAL`, brought to the albedo's size; None changes nothing.
    """
    depth = np.zeros(albedo.shape)
    for levels, absorption in ((blood, BLOOD), (melanin, MELANIN)):
        if levels is not None:
            depth += _amount(levels, albedo.shape)[..., None] * absorption
    linear = linear_from_srgb(albedo / 255) * np.exp(-FULL * depth)
    return np.asarray(np.rint(255 * srgb_from_linear(np.clip(linear, 0, 1))), np.uint8)


def _amount(levels: UInt8Array, shape: tuple[int, ...]) -> Float64Array:
    """Return (H, W) from -1 to 1, 0 where the level is `NEUTRAL`."""
    if levels.shape != shape[:2]:
        resized = cv2.resize(levels, shape[1::-1], interpolation=cv2.INTER_LINEAR)
        levels = np.asarray(resized, np.uint8)
    return (levels.astype(np.float64) - NEUTRAL) / (255 - NEUTRAL)
