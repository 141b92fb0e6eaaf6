"""The strands that the stage `orient` finds in a photo, drawn as short lines over it."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.types.orientation import OrientationMap

STEP, LENGTH = 8, 6.0
"""Pixels of the picture between lines, and half of a line's length."""
SCALE = 2
"""The picture is so many times as large as the photo that strands were found in."""
SATURATION = 0.55
"""Of the hues: paler ones are seen on dark hair too."""
LEAST_SURE = 0.1
"""Confidence below which no line is drawn; one of 0.5 is drawn opaque."""


def draw_strand_lines(orientation: OrientationMap) -> UInt8Array:
    """Return (SCALE H, SCALE W, 4) RGBA: lines along strands, their hue by the angle."""
    height, width = orientation.angle.shape
    picture = np.zeros((SCALE * height, SCALE * width, 4), np.uint8)
    rows, columns = np.mgrid[STEP // 2 : height : STEP, STEP // 2 : width : STEP]
    rows, columns = rows.ravel(), columns.ravel()
    sure = orientation.confidence[rows, columns]
    for row, column, share in zip(rows, columns, sure, strict=True):
        if share < LEAST_SURE:
            continue
        angle = float(orientation.angle[row, column])
        along = LENGTH * np.array([np.cos(angle), np.sin(angle)])
        middle = SCALE * np.array([column + 0.5, row + 0.5])
        first, last = (tuple(np.rint(middle + sign * along).astype(int)) for sign in (-1, 1))
        colour = (*_colour(angle), int(255 * min(2 * share, 1)))
        cv2.line(picture, first, last, colour, SCALE, cv2.LINE_AA)
    return picture


def _colour(angle: float) -> tuple[int, int, int]:
    red, green, blue = colorsys.hsv_to_rgb(angle / np.pi % 1, SATURATION, 1.0)
    return int(255 * red), int(255 * green), int(255 * blue)
