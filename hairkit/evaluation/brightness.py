"""Brightness of the drawn hair over that of the hair in the photos."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.errors import RenderError
from hairkit.grooming.densify import densify
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom

HEIGHT = 360
"""Height in pixels at which pictures are compared."""
LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Weights of red, green and blue (Rec. ITU-R BT.709)."""


def brightness_ratios(
    groom: Groom,
    cameras: Sequence[Camera],
    photos: Sequence[UInt8Array],
    hair: Sequence[BoolArray],
    strands: int,
) -> tuple[float, ...] | None:
    """Return mean luma of the drawn hair over that of the photo, by view; None without OpenGL.

    Both means are over the pixels of the photo that are hair there; where the drawn hair leaves
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
    return tuple(
        _mean_luma(picture, mask) / max(_mean_luma(photo, mask), 1.0)
        for picture, photo, mask in zip(drawn, photos, hair, strict=True)
    )


def _mean_luma(picture: UInt8Array, mask: BoolArray) -> float:
    """Return the mean luma under a mask, both brought to the same size; 0 under an empty one."""
    size = (round(HEIGHT * mask.shape[1] / mask.shape[0]), HEIGHT)
    luma: Float32Array = picture.astype(np.float32) @ LUMA
    luma = np.asarray(cv2.resize(luma, size, interpolation=cv2.INTER_AREA), np.float32)
    inside = cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    return float(luma[inside].mean()) if inside.any() else 0.0
