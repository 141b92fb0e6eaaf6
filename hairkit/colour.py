"""The sRGB transfer curve (IEC 61966-2-1), between linear light and what pictures store."""

from __future__ import annotations

import re
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array
from hairkit.errors import InputError

_Floats = TypeVar("_Floats", npt.NDArray[np.float32], npt.NDArray[np.float64])

_SLOPE, _OFFSET, _GAMMA = 12.92, 0.055, 2.4
_LINEAR_END, _SRGB_END = 0.0031308, 0.04045
"""End of the linear segment of the curve, in linear light and in sRGB."""


def linear_from_srgb(values: _Floats) -> _Floats:
    """Return linear intensities of sRGB values, both in [0, 1] and of the same type.

    >>> linear_from_srgb(np.array([0.0, 0.5, 1.0])).round(3).tolist()
    [0.0, 0.214, 1.0]
    """
    curve = ((values + _OFFSET) / (1 + _OFFSET)) ** _GAMMA
    return np.where(values <= _SRGB_END, values / _SLOPE, curve)


def srgb_from_linear(linear: _Floats) -> _Floats:
    """Return sRGB values of linear intensities, both in [0, 1] and of the same type.

    >>> srgb_from_linear(np.array([0.0, 0.214, 1.0])).round(3).tolist()
    [0.0, 0.5, 1.0]
    """
    curve = (1 + _OFFSET) * linear ** (1 / _GAMMA) - _OFFSET
    return np.where(linear <= _LINEAR_END, _SLOPE * linear, curve)


def linear_from_hex(said: str, name: str) -> Float32Array:
    """Return linear RGB (3,) of sRGB as #rrggbb; raises `InputError`, which names the setting."""
    if not re.fullmatch("#[0-9a-fA-F]{6}", said):
        raise InputError(f"{name} is {said!r}, expected sRGB as #rrggbb")
    srgb = np.array(list(bytes.fromhex(said[1:]))) / 255
    return linear_from_srgb(srgb).astype(np.float32)
