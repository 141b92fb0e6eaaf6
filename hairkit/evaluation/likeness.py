"""How alike drawn and photographed hair look: brightness, colour, contrast and order of strands."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.errors import RenderError
from hairkit.grooming.densify import densify
from hairkit.pipeline.drawn_hair import FINER, photo_directions
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom

HEIGHT = 720
"""Height in pixels at which pictures are compared."""
LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Weights of red, green and blue (Rec. ITU-R BT.709)."""
SCALES = (1.0, 3.0, 9.0)
"""Gaussians about which contrast is measured, pixels: strands, wisps and locks of a whole head."""
MEASURES = ("brightness", "chroma", *(f"contrast at {s:g} px" for s in SCALES), "coherence")
"""Mean luma; then medians, which skin and backdrop beside the hair hardly move: CIELAB chroma;
difference of luma between each Gaussian and one twice as wide, over mean luma; coherence of
directions (Bigun and Granlund 1987), 0 to 1."""


def likeness(
    groom: Groom,
    cameras: Sequence[Camera],
    photos: Sequence[UInt8Array],
    hair: Sequence[BoolArray],
    strands: int,
) -> Float64Array | None:
    """Return (V, 6) `MEASURES` of the drawn hair over those of the photos; None without OpenGL.

    They are taken over the pixels of the photo that are hair there; where the drawn hair leaves
    some of them bare, they show skin in the drawing, as an onlooker sees it.

    Parameters
    ----------
    groom
        Guides, in the frame of the cameras; they are densified to `strands`.
    cameras
        V cameras of the photos.
    photos
        V photos (H, W, 3), sRGB.
    hair
        V masks (H, W) of the hair in them.
    """
    from hairkit.rendering.picture import draw_views  # loads OpenGL

    small = [c.resized(round(HEIGHT * c.width / c.height), HEIGHT) for c in cameras]
    try:
        drawn = draw_views(densify(groom, strands), groom.head, small, material=groom.material)
    except RenderError:
        return None
    pairs = zip(drawn, photos, hair, strict=True)
    return np.array([measure(d, mask) / measure(p, mask) for d, p, mask in pairs])


def measure(picture: UInt8Array, mask: BoolArray) -> Float64Array:
    """Return the `MEASURES` (6,), above 0, of a picture under a mask, at equal height."""
    size = (round(HEIGHT * mask.shape[1] / mask.shape[0]), HEIGHT)
    inside = cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    if not inside.any():
        return np.ones(len(MEASURES))
    rgb = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    luma, weight = np.asarray(rgb @ LUMA, np.float32), inside.astype(np.float32)
    chroma = np.linalg.norm(cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB)[inside, 1:], axis=1)
    bands = [_smooth(luma, weight, scale) - _smooth(luma, weight, 2 * scale) for scale in SCALES]
    mean = luma[inside].mean()
    contrasts = [np.median(abs(band[inside])) / max(mean, 1e-3) for band in bands]
    coarse = (size[0] // FINER, size[1] // FINER)
    sure = photo_directions(picture, mask.astype(np.uint8), coarse)[1]
    coherence = np.median(cv2.resize(sure, size, interpolation=cv2.INTER_NEAREST)[inside])
    found = (mean, np.median(chroma), *contrasts, coherence)
    return np.maximum(np.array(found, np.float64), 1e-3)


def _smooth(values: Float32Array, weight: Float32Array, sigma: float) -> Float32Array:
    """Return values (H, W) smoothed inside the mask, which holds what lies beyond it away."""
    over = cv2.GaussianBlur(weight, (0, 0), sigma)
    return np.asarray(cv2.GaussianBlur(values * weight, (0, 0), sigma) / np.maximum(over, 1e-6))
