"""The atlas as pictures: albedo, coverage, normals, flow, depth and strand numbers."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import cv2
import numpy as np

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.colour import srgb_from_linear
from hairkit.parallel import thread_count
from hairkit.types.groom import HairMaterial
from hairkit.types.strand_blocks import colours
from hairkit.types.strands import Strands

from .painting import UNIT, Atlas, Int8Array

DARKEST = 0.7
"""Brightness of the darkest strand, of the material's."""
DEPTH = 0.02
"""Metres from black to white of the depth map; grey is the card."""
FASTEST = [cv2.IMWRITE_PNG_COMPRESSION, 1]
"""zlib's quickest: level 3 takes twice the time for 4 % less."""
SHADES, SCATTER = 251, 97
"""Shades by which strands differ, a prime number, and the step from one to the next strand's: so
all are used, and neighbours in a lock get different ones."""
PLACES = 32
"""Places along a strand whose colours differ."""
ZERO = 128
"""Byte of 0 in pictures of directions."""
BAND = 256
"""Rows that are finished at once."""


def encode_maps(atlas: Atlas, strands: Strands, material: HairMaterial) -> dict[str, bytes]:
    """Return the PNG of each map: `albedo` with coverage as alpha, and the others by name."""
    pictures: dict[str, Callable[[], UInt8Array]] = {
        "albedo": partial(_albedo, atlas, strands, material),
        "alpha": lambda: np.rint(255 * atlas.alpha).astype(np.uint8),
        "normal": partial(_directions, atlas.normal, outward=True),
        "flow": partial(_directions, atlas.flow, outward=False),
        "depth": partial(_depth, atlas),
        "id": lambda: (atlas.strand % SHADES).astype(np.uint8),
    }
    with ThreadPoolExecutor(thread_count()) as pool:
        files = pool.map(lambda make: _png(make()), pictures.values())
        return dict(zip(pictures, files, strict=True))


def _albedo(atlas: Atlas, strands: Strands, material: HairMaterial) -> UInt8Array:
    """Return (H, W, 4) BGRA: the strand's colour at its place; neighbours' are unequally bright."""
    places = np.rint(np.linspace(0, 1, PLACES) * (strands.counts[:, None] - 1)).astype(np.int64)
    own = colours(material, strands).at()[strands.offsets[:-1, None] + places]
    step = np.arange(len(strands)) * SCATTER % SHADES / (SHADES - 1)
    linear = own * (DARKEST + (1 - DARKEST) * step)[:, None, None]
    table = np.rint(255 * srgb_from_linear(np.clip(linear, 0, 1))).astype(np.uint8)
    column = np.rint(np.linspace(0, PLACES - 1, 256)).astype(np.uint8)
    out = np.empty((*atlas.alpha.shape, 4), np.uint8)
    for first in range(0, len(out), BAND):
        rows = slice(first, first + BAND)
        out[rows, :, :3] = table[..., ::-1][atlas.strand[rows], column[atlas.share[rows]]]
        out[rows, :, 3] = np.rint(255 * atlas.alpha[rows])
    return out


def _directions(parts: Int8Array, *, outward: bool) -> UInt8Array:
    """Return (H, W, 3) BGR of directions: red across, green towards the root, blue outward."""
    out = np.empty((*parts.shape[:2], 3), np.uint8)
    x, y = parts[..., 0].astype(np.int16), -parts[..., 1].astype(np.int16)
    out[..., 2], out[..., 1] = x + ZERO, np.clip(y + ZERO, 0, 255)
    if outward:
        rest = np.sqrt(np.maximum(float(UNIT) ** 2 - x.astype(np.float32) ** 2 - y**2, 0))
        out[..., 0] = np.rint(rest + ZERO)
    else:
        out[..., 0] = ZERO
    return out


def _depth(atlas: Atlas) -> UInt8Array:
    height: Float32Array = np.where(np.isfinite(atlas.height), atlas.height, 0)
    return np.asarray(np.rint(255 * np.clip(0.5 + height / DEPTH, 0, 1)).astype(np.uint8))


def _png(picture: UInt8Array) -> bytes:
    return bytes(cv2.imencode(".png", picture, FASTEST)[1])
