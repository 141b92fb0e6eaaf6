"""Maps over the scalp, beside the .apx file: density, width, and colours of roots and tips."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.colour import srgb_from_linear
from hairkit.grooming.prepare_export import bound_roots
from hairkit.types.groom import Groom

EDGE = 256
"""Of a map in texels: guides are farther apart than the millimetre of one."""
NEAREST = 4
"""Guides whose values a texel mixes, by their inverse distance."""
LEAST = 1e-6
"""Distance in texture coordinates that is divided by, and least difference of widths, metres."""


def widths(groom: Groom) -> Float32Array:
    """Return the mean width (S,) of each strand, metres."""
    strands, width = groom.strands, groom.material.width
    if strands.widths is None or not len(strands):
        return np.full(len(strands), width, np.float32)
    sums = np.add.reduceat(strands.widths, strands.offsets[:-1])
    return np.asarray(sums / strands.counts, np.float32)


def scalp_maps(groom: Groom) -> dict[str, bytes]:
    """Return the TGA files of maps by the names of HairWorks' textures; only what varies has one.

    The groom's strands are the guides.
    """
    strands, maps = groom.strands, {}
    uv = bound_roots(groom).uv if strands.root_uv is None else strands.root_uv
    if groom.head.density is not None:
        grey = np.rint(255 * groom.root_density).astype(np.uint8)
        maps["densityTexture"] = _map(uv, grey[:, None])
    wide = widths(groom)
    if np.ptp(wide) > LEAST:
        maps["widthTexture"] = _map(uv, 255 * wide[:, None] / wide.max())
    if strands.colours is not None:
        shades = np.rint(255 * srgb_from_linear(np.clip(strands.colours, 0, 1)))
        maps["rootColorTexture"] = _map(uv, shades[strands.offsets[:-1]])
        maps["tipColorTexture"] = _map(uv, shades[strands.offsets[1:] - 1])
    return maps


def _map(uv: Float32Array, values: Float32Array | UInt8Array) -> bytes:
    """Return a picture of values (G, C) at places (G, 2) of the texture, v upwards."""
    places = (np.arange(EDGE) + 0.5) / EDGE
    texels = np.stack(np.meshgrid(places, places[::-1]), axis=-1)
    away, near = cKDTree(uv).query(texels, min(NEAREST, len(uv)))
    weight = 1 / np.maximum(away.reshape(EDGE, EDGE, -1), LEAST)
    weight /= weight.sum(axis=2, keepdims=True)
    mixed = np.einsum("hwk,hwkc->hwc", weight, values[near.reshape(weight.shape)])
    file = io.BytesIO()
    Image.fromarray(np.squeeze(np.rint(mixed).astype(np.uint8))).save(file, "TGA")
    return file.getvalue()
