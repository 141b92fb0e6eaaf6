"""The colours of a person's eyes, from photos in which their landmarks are known.

The six landmarks of an eye enclose what is seen between the lids. The iris is the darkest disc in
there whose size suits the distance of the eye's corners; its colour is the median of a ring in it,
beyond the pupil and the glint, and the white's is that of the brighter pixels beside it. Eyes lie
in shadow; since whites are much alike, theirs says how deep it is, and is taken out of both.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.head_model.eyes import IRIS, IRIS_RADIUS, LOWER_LID, SCLERA
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.head import EYES, Head

CORNERS = 0, 3
"""Of an eye's points, those at its corners."""
LEAST_WIDTH = 12.0
"""Pixels between the corners of an eye whose colour is measured."""
LEAST_OPEN = 0.15
"""Area of an opening whose colour is measured, in shares of its squared width: closed eyes are
not."""
RING = (0.45, 0.85)
"""Radii of the ring in the iris, in shares of the iris's."""
BESIDE = 1.25
"""Radius from which a pixel is the white's, in shares of the iris's."""
SHARE = IRIS_RADIUS / (LOWER_LID[-1][0] - LOWER_LID[0][0])
"""Radius of the iris in shares of the distance of the corners."""
FEWEST = 6
"""Pixels that a colour is measured on at least."""
DEEPEST = 1.5
"""Largest factor by which lids and brows darken the eyes: the white tells how much they do."""
EYE_MARGIN = 0.0015
"""Metres beside the lids' edges that are left out: the eyeball would be painted on the lids."""
FARTHEST = 1e5
"""Pixels from the picture's corner beyond which nothing is drawn."""

Colour = tuple[float, float, float]


def find_eye_colours(views: Sequence[View], gains: Float64Array) -> tuple[Colour, Colour]:
    """Return the colours of iris and white, sRGB of 255; average ones where no eye is seen.

    `gains` (V, 3) are multiplied with the colours of each view.
    """
    found: list[list[Float64Array]] = [[], []]
    for view, gain in zip(views, gains, strict=True):
        if view.landmarks is None:
            continue
        for eye in EYES:
            for list_, colour in zip(found, _measure(view.image, view.landmarks[eye]), strict=True):
                if colour is not None:
                    list_.append(colour * gain)
    iris, white = (
        _as_colour(np.median(colours, axis=0)) if colours else usual
        for colours, usual in zip(found, (IRIS, SCLERA), strict=True)
    )
    lit = float(np.clip(np.mean(SCLERA) / np.mean(white), 1.0, DEEPEST))
    return _as_colour(lit * np.array(iris)), _as_colour(lit * np.array(white))


def mark_beside_eyes(head: Head, camera: Camera) -> Float32Array:
    """Return (H, W) 0 on the eyes of the head and what lies just beside their lids, 1 elsewhere."""
    beside = np.ones((camera.height, camera.width), np.float32)
    if head.landmark_vertices is None:
        return beside
    for eye in EYES:
        lids = head.vertices[head.landmark_vertices[eye]].astype(np.float64)
        middle = lids.mean(axis=0)
        grown = (lids - middle) * (1 + EYE_MARGIN / np.linalg.norm(lids - middle, axis=1).min())
        pixels = camera.project(middle + grown)
        if np.isfinite(pixels).all() and np.abs(pixels).max() < FARTHEST:
            hull = cv2.convexHull(pixels.astype(np.float32))
            cv2.fillConvexPoly(beside, np.rint(hull).astype(np.int32), 0.0)
    return beside


def _measure(
    photo: UInt8Array, points: Float64Array
) -> tuple[Float64Array | None, Float64Array | None]:
    """Return the colours of iris and white between the landmarks (6, 2) of an eye."""
    width = float(np.linalg.norm(points[CORNERS[1]] - points[CORNERS[0]]))
    low = np.floor(points.min(axis=0)).astype(int)
    high = np.ceil(points.max(axis=0)).astype(int) + 1
    size = np.array(photo.shape[1::-1])
    if width < LEAST_WIDTH or (low < 0).any() or (high > size).any():
        return None, None
    part = photo[low[1] : high[1], low[0] : high[0]]
    hull = cv2.convexHull((points - low - 0.5).astype(np.float32))
    if cv2.contourArea(hull) < LEAST_OPEN * width**2:
        return None, None
    inside = cv2.fillConvexPoly(np.zeros(part.shape[:2], np.uint8), np.rint(hull).astype(int), 1)
    away = _from_iris(part, inside > 0, SHARE * width) / (SHARE * width)
    iris = part[(inside > 0) & (away > RING[0]) & (away < RING[1])].astype(np.float64)
    white = part[(inside > 0) & (away > BESIDE)].astype(np.float64)
    if len(iris) < FEWEST or len(white) < FEWEST:
        return None, None
    bright = white[white.mean(axis=1) >= np.median(white.mean(axis=1))]
    return np.median(iris, axis=0), np.median(bright, axis=0)


def _from_iris(part: UInt8Array, inside: BoolArray, radius: float) -> Float64Array:
    """Return (H, W) pixels from the middle of the darkest disc."""
    grey = part.mean(axis=2)
    grey[~inside] = grey[inside].max()
    blurred = cv2.GaussianBlur(grey, (0, 0), 0.5 * radius)
    blurred[~inside] = np.inf
    row, column = np.unravel_index(int(blurred.argmin()), blurred.shape)
    rows, columns = np.mgrid[: part.shape[0], : part.shape[1]]
    return np.asarray(np.hypot(rows - row, columns - column))


def _as_colour(values: Float64Array) -> Colour:
    red, green, blue = (float(value) for value in values)
    return red, green, blue
