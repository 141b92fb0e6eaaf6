"""Pictures for strips: strands side by side that end at different places, and their relief."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.colour import srgb_from_linear
from hairkit.imaging.picture_file import encode_picture

_SHORTEST = 0.72
_LONGEST = 1.02
"""Shares of the strip's length that strands reach; the longest are cut off by its end."""
_DARKEST = 0.62
"""Brightness of the darkest strand, of 1."""
_EDGE_SHADE = 0.75
"""Brightness of a strand's edges, of its middle's: a round strand turns away there."""
_BULGE = 0.3
"""Height of a strand in shares of its slot's width."""
_HALF_WIDTH = 0.62
"""Half the width of a strand in shares of its slot's: neighbours overlap a little."""
_TAPERING = 0.3
"""Share of the strip's length over which a strand narrows to its tip."""
_THINNEST = 1e-4
"""Least half width in shares of the strip's: strands that have ended do not divide by 0."""


def strand_pictures(strands: int, opaque: bool) -> tuple[bytes, bytes]:
    """Return PNGs of colour with alpha (sRGB, to be multiplied with the hair's) and of normals.

    Parameters
    ----------
    strands
        How many lie side by side, root at the upper edge.
    opaque
        Without holes.
    """
    width, height = (64, 256) if strands <= 8 else (256, 256)
    relief, shade = _strands_side_by_side(strands, width, height)
    lit = shade * (_EDGE_SHADE + 0.25 * np.maximum(relief, 0))
    colour = np.repeat(255 * srgb_from_linear(lit)[..., None], 4, axis=-1)
    edge = 0.25  # of the relief: alpha goes from 0 to 1 there, so that the cut is smooth
    colour[..., 3] = 255 if opaque else 255 * np.clip(0.5 + relief / edge, 0, 1)
    return _png(colour), _png(_normals(np.maximum(relief, 0) * width / strands * _BULGE))


def white_picture() -> bytes:
    """Return a PNG of four white pixels: the place of a map that is not there yet."""
    return _png(np.full((2, 2, 3), 255.0))


def _strands_side_by_side(
    strands: int, width: int, height: int
) -> tuple[Float64Array, Float64Array]:
    """Return the strands' height over the strip (H, W), below 0 between them, and shades."""
    random = np.random.default_rng(0)
    u = (np.arange(width) + 0.5)[:, None] / width
    v = (np.arange(height) + 0.5)[:, None, None] / height
    slot = (np.arange(strands) + 0.5) / strands
    phase, end = random.uniform(0, 2 * np.pi, strands), random.uniform(_SHORTEST, _LONGEST, strands)
    end[strands // 2] = _LONGEST
    centre = slot + 0.25 / strands * np.sin(phase + 2 * np.pi * v * random.uniform(0.5, 1, strands))
    half = _HALF_WIDTH / strands * np.sqrt(np.clip((end - v) / _TAPERING, 0, 1))
    # a quadratic bump for every strand; the highest is seen
    bumps = 1 - ((u - centre) / np.maximum(half, _THINNEST)) ** 2
    nearest = bumps.argmax(axis=-1)
    shade = random.uniform(_DARKEST, 1.0, strands)[nearest]
    return np.maximum(bumps.max(axis=-1), -1.0), shade


def _normals(relief: Float64Array) -> Float64Array:
    """Return the normal map (H, W, 3) of a relief in pixels: +X to the right, +Y up."""
    down, right = np.gradient(relief)
    normal = np.stack([-right, down, np.ones_like(relief)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return 255 / 2 * (normal + 1)


def _png(picture: Float64Array) -> bytes:
    return encode_picture(np.rint(picture).astype(np.uint8))
