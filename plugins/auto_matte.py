"""Segmentation without strokes: seeds from the usual composition of a portrait.

The picture's upper border shows the backdrop, its middle the subject; skin is smooth, bright and of
skin's hue; hair lies along the upper outline of the subject and is not skin; clothes are at the
bottom and unlike the hair. These seeds are then used like a user's strokes
(`hairkit.imaging.seeded_segmentation`, after Rother et al. 2004). No model file is needed. A beard
between cheeks and neck counts as face. Landmarks, where a view has them, mark the face.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.hookspecs import hookimpl
from hairkit.imaging.seeded_segmentation import (
    UNKNOWN,
    LabelSettings,
    appearance,
    coarse_labels,
    label_from_seeds,
    reduced_size,
)
from hairkit.options import option
from hairkit.types.capture import View
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask

_SUBJECT_COLUMNS, _SUBJECT_TOP = (0.42, 0.58), 0.4
"""Shares of the picture's width and height: the subject fills these columns below this row."""

_SKIN_HUE_DEG = (15.0, 80.0)
"""Hue of skin in Lab, degrees from +a (red) to +b (yellow)."""

_SKIN_CHROMA, _SKIN_BRIGHTER = 9.0, 22.0
"""Least chroma of skin in Lab, and by how much its L is above the darkest tenth of the subject."""

_DARKEST = 0.1
"""Share of the subject's pixels that are its darkest."""

_SMALLEST_SKIN = 0.005
"""Share of the picture below which a patch of skin's colour is none."""

_UNLIKE_HAIR, _COLOUR_NOISE = 4.0, 2.0
"""Mahalanobis distance in deviations at which colours are not those of the hair, and a deviation in
Lab that is added to the hair's own."""

_CLOTHES_TOP = 0.93
"""Share of the picture's height below which the subject may be clothes."""

_HAIR_BOTTOM, _CHEEKS_TOP = 0.35, 0.45
"""Shares of the way from the subject's top to the picture's bottom: the outline above the first is
hair, skin below the second is cheeks or neck."""

_CHEEK_COLUMNS = (0.25, 0.75)
"""Quantiles of the cheeks' columns between which all that skin encloses is face."""

_EYE_HEIGHT = 16
"""Eyes and mouth are lower than the picture by more than this factor."""

_FIRST_INNER_LANDMARK = 27
"""First of the iBUG landmarks that are not jaw or brows: nose, eyes and mouth."""

_FEWEST = 30
"""Pixels of the reduced picture below which hair is not found, or its colours not measured."""

_SPECK = 1e-4
"""Share of the picture up to which parts of the hair that hold no seed are kept."""

_BRIDGED = 200
"""Parts of the hair this fraction of the picture's height from a common pixel are one part."""

_NOTICEABLE = 3.0
"""Distance in Lab from which two colours look different; a just noticeable one is 2.3 (Mahy, Van
Eycken and Oosterlinck 1994)."""

_EDGE, _SKIN_EDGE, _WITHIN = 5, 7, 7
"""Edges in reduced pixels of the squares: by which the subject's inside is eroded, that opens skin,
and by which the subject is eroded before background in it becomes person."""

_SKIN_MARGIN, _BACKDROP_MARGIN = 2, 6
"""Reduced pixels from skin where hair's seeds begin, and from the subject where the backdrop's."""


@dataclass(frozen=True)
class Options:
    """Settings of the segmentation without strokes."""

    reduced_height: int = option(
        360, low=120, high=1080, doc="Rows of the picture that is segmented first.", unit="px"
    )
    border: float = option(
        0.03, low=0.005, high=0.2, doc="Share of the picture at its border that is backdrop."
    )
    side_height: float = option(
        0.35, low=0.0, high=1.0, doc="Share of the picture's sides, from the top, that is backdrop."
    )
    rim: float = option(
        0.07, low=0.01, high=0.3, doc="Depth of the hair under the outline, in picture heights."
    )
    seed: int = option(1, low=0, high=2**31 - 1, doc="Seed of the colour clustering.")


@hookimpl
def segment(view: View, options: Options) -> Mask:
    """Label a photo from the usual composition of a portrait.

    Raises
    ------
    InputError
        No hair was found.
    """
    width, height = reduced_size(view.width, view.height, options.reduced_height)
    settings = LabelSettings(seed=options.seed)
    subject = _subject(view.image, width, height, options, settings)
    seeds = _seeds(view, subject, options)
    if np.count_nonzero(seeds == HAIR) < _FEWEST:
        raise InputError(
            f"no hair found in photo {view.name}; draw strokes on it or give a mask file"
        )
    labels = label_from_seeds(view.image, seeds, subject, settings)
    within = cv2.erode(subject.astype(np.uint8), np.ones((_WITHIN, _WITHIN)))
    within = cv2.resize(within, (view.width, view.height), interpolation=cv2.INTER_NEAREST)
    lost = (within > 0) & (labels == BACKGROUND)
    lost |= _astray(labels == HAIR, seeds == HAIR)
    return Mask(np.where(lost, np.uint8(PERSON), labels), person_known=True)


def _subject(
    image: UInt8Array, width: int, height: int, options: Options, settings: LabelSettings
) -> BoolArray:
    """Return where the person is (h, w): two classes, the border against the middle."""
    seeds = np.full((height, width), UNKNOWN, np.uint8)
    strip = max(round(options.border * height), 1)
    seeds[:strip] = BACKGROUND
    sides = round(options.side_height * height)
    seeds[:sides, :strip] = BACKGROUND
    seeds[:sides, -strip:] = BACKGROUND
    middle = slice(*(round(share * width) for share in _SUBJECT_COLUMNS))
    seeds[round(_SUBJECT_TOP * height) :, middle] = HAIR
    labels = coarse_labels(image, seeds, np.ones(seeds.shape, np.bool_), settings)
    area = (labels == HAIR).astype(np.uint8)
    _, parts, stats, _ = cv2.connectedComponentsWithStats(area)
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return _fill_holes(parts == largest)


def _seeds(view: View, subject: BoolArray, options: Options) -> UInt8Array:
    """Return seeds (h, w) of the three classes from the subject's outline and colours."""
    height, width = subject.shape
    colour, _ = appearance(view.image, width, height)
    inner = cv2.erode(subject.astype(np.uint8), np.ones((_EDGE, _EDGE))) > 0
    skin = _skin(colour, inner)
    hair = _upper_rim(subject, options.rim) & inner & ~_dilate(skin, _SKIN_MARGIN)
    seeds = np.full(subject.shape, UNKNOWN, np.uint8)
    seeds[~_dilate(subject, _BACKDROP_MARGIN)] = BACKGROUND
    seeds[_clothes(colour, hair, inner)] = PERSON
    if _differ(colour[hair], colour[seeds == BACKGROUND]):
        seeds[hair] = HAIR
    seeds[_face(skin, subject)] = PERSON
    if view.landmarks is not None:
        seeds[_inner_face(view, view.landmarks, width, height)] = PERSON
    return seeds


def _differ(hair: Float32Array, backdrop: Float32Array) -> bool:
    """Return whether hair (N, 3) and backdrop (M, 3), both Lab, look different."""
    if not (len(hair) and len(backdrop)):
        return False
    apart = np.linalg.norm(np.median(hair, axis=0) - np.median(backdrop, axis=0))
    return bool(apart > _NOTICEABLE)


def _skin(colour: Float32Array, inner: BoolArray) -> BoolArray:
    """Return skin (h, w): of skin's hue, and much brighter than the darkest of the subject."""
    hue = np.degrees(np.arctan2(colour[..., 2], colour[..., 1]))
    chroma = np.hypot(colour[..., 1], colour[..., 2])
    hued = (hue > _SKIN_HUE_DEG[0]) & (hue < _SKIN_HUE_DEG[1]) & (chroma > _SKIN_CHROMA) & inner
    darkest = np.quantile(colour[..., 0][inner], _DARKEST) if inner.any() else 0.0
    skin = (hued & (colour[..., 0] > darkest + _SKIN_BRIGHTER)).astype(np.uint8)
    opened = cv2.morphologyEx(skin, cv2.MORPH_OPEN, np.ones((_SKIN_EDGE, _SKIN_EDGE)))
    _, parts, stats, _ = cv2.connectedComponentsWithStats(np.asarray(opened, np.uint8))
    large = stats[:, cv2.CC_STAT_AREA] > _SMALLEST_SKIN * skin.size
    return np.asarray((np.asarray(opened) > 0) & large[parts], np.bool_)


def _astray(hair: BoolArray, seeds: BoolArray) -> BoolArray:
    """Return parts of the hair (H, W) that hold no seed, but for specks: brows, glasses, a beard.

    Parts less than a hundredth of the picture's height apart are one.
    """
    height, width = hair.shape
    large = cv2.resize(seeds.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    bridged = _dilate(hair, height // _BRIDGED).astype(np.uint8)
    count, parts, stats, _ = cv2.connectedComponentsWithStats(bridged)
    held = np.bincount(parts[large > 0], minlength=count) > 0
    astray = ~held & (stats[:, cv2.CC_STAT_AREA] > _SPECK * hair.size)
    astray[0] = False
    return np.asarray(hair & astray[parts], np.bool_)


def _upper_rim(subject: BoolArray, rim: float) -> BoolArray:
    """Return the band under the outline of the upper third of the subject."""
    height = subject.shape[0]
    depth = cv2.distanceTransform(subject.astype(np.uint8), cv2.DIST_L2, 3)
    rows = np.flatnonzero(subject.any(axis=1))
    lowest = rows[0] + _HAIR_BOTTOM * (height - rows[0])
    above = np.arange(height)[:, None] < lowest
    return np.asarray(subject & (depth < rim * height) & above, np.bool_)


def _clothes(colour: Float32Array, hair: BoolArray, inner: BoolArray) -> BoolArray:
    """Return the subject's lowest rows where they are unlike the hair (Mahalanobis 1936)."""
    low = inner.copy()
    low[: round(_CLOTHES_TOP * len(low))] = False
    if np.count_nonzero(hair) < _FEWEST:
        return low
    middle = np.median(colour[hair], axis=0)
    precision = np.linalg.inv(np.cov(colour[hair].T) + _COLOUR_NOISE**2 * np.eye(3))
    offset = colour - middle
    squared = np.einsum("hwa,ab,hwb->hw", offset, precision, offset)
    return np.asarray(low & (squared > _UNLIKE_HAIR**2))


def _face(skin: BoolArray, subject: BoolArray) -> BoolArray:
    """Return skin and what has skin above and below it: eyes and mouth, lower down a beard."""
    height = len(skin)
    top = int(np.flatnonzero(subject.any(axis=1))[0])
    short = cv2.morphologyEx(
        skin.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((max(height // _EYE_HEIGHT, 1) | 1, 3))
    )
    cheeks = skin & (np.arange(height)[:, None] > top + _CHEEKS_TOP * (height - top))
    columns = np.flatnonzero(cheeks.any(axis=0))
    if len(columns):
        left, right = np.quantile(columns, _CHEEK_COLUMNS).astype(int)
        cheeks[:, :left] = cheeks[:, right:] = False
    above = np.maximum.accumulate(cheeks, axis=0)
    below = np.maximum.accumulate(cheeks[::-1], axis=0)[::-1]
    return np.asarray((short > 0) | (above & below))


def _inner_face(view: View, landmarks: Float64Array, width: int, height: int) -> BoolArray:
    """Return the hull of the landmarks of nose, eyes and mouth."""
    scale = np.array([width / view.width, height / view.height])
    points = landmarks[_FIRST_INNER_LANDMARK:] * scale - 0.5
    canvas = np.zeros((height, width), np.uint8)
    cv2.fillConvexPoly(canvas, cv2.convexHull(np.rint(points).astype(np.int32)), 1)
    return canvas > 0


def _fill_holes(area: BoolArray) -> BoolArray:
    """Return the area without holes."""
    padded = np.pad(~area, 1, constant_values=True).astype(np.uint8)
    cv2.floodFill(padded, None, (0, 0), 2)
    return np.asarray(padded[1:-1, 1:-1] != 2, np.bool_)


def _dilate(area: BoolArray, radius: int) -> BoolArray:
    """Return the area dilated by a disc of `radius` pixels."""
    size = (2 * radius + 1, 2 * radius + 1)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, size)
    return np.asarray(cv2.dilate(area.astype(np.uint8), disc) > 0)
