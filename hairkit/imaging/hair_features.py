"""What the hair network sees of a photo: colour, texture, the person and the face, on a small grid.

Hair differs from skin and cloth of its colour by fine strands that run in one direction nearby.
A small picture does not show them, so their strength and direction are measured in a larger one
(Bigun and Granlund 1987) and averaged into its cells, as are the colours. A face adds where a
pixel lies in its frame, and how its colour differs from the skin of the cheeks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array

GRID, CELL = 128, 5
"""Cells along the longer side of the photo, and pixels along a cell where texture is measured."""
CHANNELS = 14
"""Number of features of a cell."""
_LIGHTNESS, _CHROMA = 50.0, 30.0
"""Units of Lab that are one unit of a feature."""
_DETAIL_SIGMA, _DETAIL_GAIN = 1.5, 4.0
"""Gaussian in pixels that fine detail is measured against, and its gain before the logarithm."""
_TENSOR_SIGMA, _LEAST_ENERGY, _ENERGY_UNITS = 1.0, 0.05, 3.0
"""Gaussian in cells of the structure tensor, its trace in a flat region, and the number of units
of the trace's logarithm that are one unit of a feature."""
_SOBEL_SCALE = 1 / 8
"""Makes the difference of a 3 x 3 Sobel filter one per pixel."""
_UNKNOWN = 0.5
"""Probability of the person where nothing is known about it."""
_REACH = 2.0
"""Coordinates in the frame of the face saturate at about this many face lengths (eyes to mouth)."""
_FADE = 32.0
"""Square of face lengths at which these coordinates have faded to 1 / e."""
EYES, MOUTH = slice(36, 48), slice(48, 68)
"""iBUG landmarks of the eyes and of the mouth."""
_CHEEKS = (36, 45, 54, 48)
"""Corners of the region whose median colour is that of the skin: of the eyes and of the mouth."""


@dataclass(frozen=True, eq=False)
class HairFeatures:
    """The input of the hair network."""

    values: Float32Array
    """(CHANNELS, GRID, GRID); 0 outside of the photo, which lies in the upper left corner."""
    size: tuple[int, int]
    """Cells that the photo fills: (width, height)."""


def hair_features(
    image: UInt8Array, person: Float32Array | None, landmarks: Float64Array | None
) -> HairFeatures:
    """Return the features of a photo.

    Parameters
    ----------
    image : (H, W, 3)
        RGB.
    person : (H, W), optional
        Probability of the person, 0 to 1.
    landmarks : (68, 2), optional
        iBUG points in pixels of `image`.
    """
    height, width = image.shape[:2]
    scale = GRID / max(height, width)
    size = (max(round(width * scale), 1), max(round(height * scale), 1))
    colour, texture = _appearance(image, size)
    values = np.zeros((CHANNELS, GRID, GRID), np.float32)
    inside = values[:, : size[1], : size[0]]
    inside[0] = colour[..., 0] / _LIGHTNESS - 1
    inside[1:3] = np.moveaxis(colour[..., 1:], -1, 0) / _CHROMA
    inside[3:7] = np.moveaxis(texture, -1, 0)
    inside[7] = _UNKNOWN if person is None else _cells(person, size)
    inside[8] = 1
    if landmarks is not None:
        points = landmarks * (size[0] / width, size[1] / height) - 0.5
        inside[9:11] = _face_coordinates(points, size)
        inside[11] = _hull(points, size)
        inside[12:14] = _unlike_skin(colour, _hull(points[list(_CHEEKS)], size))
    return HairFeatures(values, size)


def _appearance(image: UInt8Array, size: tuple[int, int]) -> tuple[Float32Array, Float32Array]:
    """Return of every cell the mean Lab (h, w, 3), and detail, direction and energy (h, w, 4)."""
    large = (size[0] * CELL, size[1] * CELL)
    shrunk = image.shape[1] > large[0]
    picture = cv2.resize(image, large, interpolation=cv2.INTER_AREA if shrunk else cv2.INTER_LINEAR)
    lab = cv2.cvtColor(picture.astype(np.float32) / np.float32(255), cv2.COLOR_RGB2Lab)
    lightness = np.ascontiguousarray(lab[..., 0])
    detail = cv2.absdiff(lightness, cv2.GaussianBlur(lightness, (0, 0), _DETAIL_SIGMA))
    along_x = cv2.Sobel(lightness, cv2.CV_32F, 1, 0, scale=_SOBEL_SCALE)
    along_y = cv2.Sobel(lightness, cv2.CV_32F, 0, 1, scale=_SOBEL_SCALE)
    products = np.dstack([along_x * along_x, along_y * along_y, along_x * along_y])
    tensor = cv2.GaussianBlur(_cells(products, size), (0, 0), _TENSOR_SIGMA)
    energy = tensor[..., 0] + tensor[..., 1] + np.float32(_LEAST_ENERGY)
    texture = np.dstack(
        [
            np.log1p(np.float32(_DETAIL_GAIN) * _cells(detail, size)) - 1,
            (tensor[..., 0] - tensor[..., 1]) / energy,
            2 * tensor[..., 2] / energy,
            np.log(energy) / np.float32(_ENERGY_UNITS),
        ]
    )
    return _cells(lab, size), texture.astype(np.float32)


def _face_coordinates(points: Float64Array, size: tuple[int, int]) -> Float32Array:
    """Return (2, h, w) places to the right and up in the face's frame, which fade far from it."""
    eyes, mouth = points[EYES].mean(axis=0), points[MOUTH].mean(axis=0)
    length = float(np.hypot(*(eyes - mouth))) + 1e-6
    up = (eyes - mouth) / length
    columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    offset = np.stack([columns - eyes[0], rows - eyes[1]], axis=-1) / length
    place = np.stack([offset @ np.array([-up[1], up[0]]), offset @ up])
    fade = np.exp(-np.square(place).sum(axis=0) / _FADE)
    return np.asarray(np.tanh(place / _REACH) * fade, np.float32)


def _unlike_skin(colour: Float32Array, cheeks: BoolArray) -> Float32Array:
    """Return (2, h, w) how lightness and chroma differ from the skin's, -1 to 1."""
    if not cheeks.any():
        return np.zeros((2, *colour.shape[:2]), np.float32)
    offset = (colour - np.median(colour[cheeks], axis=0)) / np.float32(_CHROMA)
    distance = np.hypot(offset[..., 1], offset[..., 2])
    return np.asarray(np.tanh(np.stack([offset[..., 0], distance])), np.float32)


def _hull(points: Float64Array, size: tuple[int, int]) -> BoolArray:
    """Return (h, w) the convex hull of points (N, 2) in cells."""
    canvas = np.zeros((size[1], size[0]), np.uint8)
    cv2.fillConvexPoly(canvas, cv2.convexHull(np.rint(points).astype(np.int32)), 1)
    return canvas > 0


def _cells(values: npt.NDArray[Any], size: tuple[int, int]) -> Float32Array:
    """Return the mean of `values` (H, W, ...) in each cell."""
    picture = np.ascontiguousarray(values, np.float32)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.float32)
