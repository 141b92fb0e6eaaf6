"""Refine the edges of a coarse labelling at full size, where pixels mix the colours on both sides.

Near an edge a pixel's colour C is explained as a H + (1 - a) B, with H and B the means of the sure
hair and the sure background (or person) nearby; a is the share of hair (the alpha of Porter and
Duff 1984).
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Int64Array, UInt8Array
from hairkit.imaging.masked_filters import blur, picture_scale
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

_SIGMAS = (4.0, 12.0, 36.0)
"""Gaussians in reduced pixels of the local means; wider ones count where narrower have nothing."""
_CELL_OF_SIGMA = 2
"""Gaussians are computed on cells of half their sigma."""
_FADE = 0.02
"""Weight of a Gaussian against the next narrower one."""
_NO_WEIGHT = 1e-9
"""Weight of all Gaussians below which a pixel has no sure pixel nearby."""
_NOISE = 30.0
"""Squared distance in Lab from the line between two means that costs one unit: 5.5 in Lab."""
_PER_PIXEL = 0.15
"""Cost of a class for each reduced pixel of distance from its nearest sure pixel."""
_SURE_MARGIN, _THIN_PERSON = 7, 9
"""Edges in reduced pixels of the discs that a sure pixel's label has to fill, and that opens the
person's label, so that strips of it between hair and background are unsure."""
_LEAST_BLUR = 0.3
"""Least Gaussian in pixels of the full picture under which colours are compared."""
_NEARBY = 13
"""Edge in reduced pixels of the disc around hair in which edges are refined."""
HAIR_OVER_BACKGROUND, HAIR_OVER_PERSON = 0.3, 0.6
"""Least share of hair in a hair pixel. Light from behind makes a wisp before a backdrop look
thinner than it is; the shadow of hair on skin makes it look thicker."""


def refine_labels(
    image: UInt8Array, labels: UInt8Array, seeds: UInt8Array, hair_allowed: BoolArray
) -> UInt8Array:
    """Return labels (H, W) of the full picture from those of a reduced one.

    Parameters are those of `refine_near_hair`, and where hair can be (h, w).
    """
    fine, _ = _refine(image, labels, seeds, np.ones(labels.shape, np.bool_))
    allowed = _enlarge(hair_allowed.astype(np.uint8), *image.shape[1::-1]) > 0
    fine[(fine == HAIR) & ~allowed] = BACKGROUND
    return fine


def refine_near_hair(
    image: UInt8Array, labels: UInt8Array, seeds: UInt8Array
) -> tuple[UInt8Array, UInt8Array]:
    """Return labels (H, W) of the full picture, refined near hair, and the hair's opacity.

    The opacity (H, W), 0 to 255, is the share of hair in a pixel near an edge. Far from hair an
    outline between skin and backdrop that is as dark as hair is none.

    Parameters
    ----------
    image : (H, W, 3)
        RGB.
    labels : (h, w)
        255, 128 and 0, correct but for a few pixels at the edges.
    seeds : (h, w)
        Labels that are certain; other values elsewhere.
    """
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_NEARBY, _NEARBY))
    return _refine(image, labels, seeds, cv2.dilate((labels == HAIR).astype(np.uint8), disc) > 0)


def _refine(
    image: UInt8Array, labels: UInt8Array, seeds: UInt8Array, near: BoolArray
) -> tuple[UInt8Array, UInt8Array]:
    """Return labels and opacity (H, W), refined where `near` (h, w) says so."""
    height, width = image.shape[:2]
    sure = _sure(labels, seeds)
    result = _enlarge(labels, width, height)
    alpha = np.where(result == HAIR, np.uint8(255), np.uint8(0))
    unsure = near & ~np.logical_or.reduce(list(sure.values()))
    band = np.flatnonzero(_enlarge(unsure.astype(np.uint8), width, height))
    if not sure[HAIR].any() or not band.size:
        return result, alpha
    smooth = cv2.GaussianBlur(image, (0, 0), max(picture_scale(height), _LEAST_BLUR))
    small = _lab(cv2.resize(smooth, labels.shape[::-1], interpolation=cv2.INTER_AREA))
    around = {
        label: _take(cv2.resize(_surroundings(small, core), (width, height)), band)
        for label, core in sure.items()
        if core.any()
    }
    result.flat[band], share = _classify(_lab(_take(smooth, band)[None])[0], around)
    alpha.flat[band] = np.rint(255 * share)
    return result, alpha


def _take(picture: npt.NDArray[Any], pixels: Int64Array) -> npt.NDArray[Any]:
    """Return some pixels (N, C) of a picture (H, W, C), by their numbers (N,)."""
    return picture.reshape(-1, picture.shape[2]).take(pixels, axis=0)


def _lab(picture: npt.NDArray[Any]) -> Float32Array:
    return np.asarray(
        cv2.cvtColor(picture.astype(np.float32) / np.float32(255), cv2.COLOR_RGB2Lab), np.float32
    )


def _sure(labels: UInt8Array, seeds: UInt8Array) -> dict[int, BoolArray]:
    """Return for each label the (h, w) pixels off any edge; thin strips of person are unsure."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_SURE_MARGIN, _SURE_MARGIN))
    wide = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_THIN_PERSON, _THIN_PERSON))
    sure = {}
    for label in (HAIR, PERSON, BACKGROUND):
        area = (labels == label).astype(np.uint8)
        if label == PERSON:
            area = cv2.morphologyEx(area, cv2.MORPH_OPEN, wide)
        sure[label] = (cv2.erode(area, disc) > 0) | (seeds == label)
    return sure


def _classify(
    colour: Float32Array, around: dict[int, Float32Array]
) -> tuple[UInt8Array, Float32Array]:
    """Return label (N,) and share of hair (N,) of pixels of `colour` (N, 3).

    A pixel is mixed of hair and of the likelier of the other two, by the `_surroundings` (N, 4).
    """
    best = np.full(len(colour), np.inf, np.float32)
    result = np.full(len(colour), HAIR, np.uint8)
    opacity = np.ones(len(colour), np.float32)
    limits = {PERSON: HAIR_OVER_PERSON, BACKGROUND: HAIR_OVER_BACKGROUND}
    for label, limit in limits.items():
        if label not in around:
            continue
        mean, away = around[label][:, :3], around[label][:, 3]
        across = around[HAIR][:, :3] - mean
        offset = colour - mean
        norm = np.maximum(np.einsum("nc,nc->n", across, across), 1.0)
        share = np.clip(np.einsum("nc,nc->n", offset, across) / norm, 0, 1)
        rest = offset - share[:, None] * across
        misfit = np.einsum("nc,nc->n", rest, rest) / _NOISE + _PER_PIXEL * away
        better = misfit < best
        best = np.where(better, misfit, best)
        result = np.where(better, np.where(share > limit, HAIR, label), result).astype(np.uint8)
        opacity = np.where(better, share, opacity)
    return result, opacity


def _surroundings(values: Float32Array, core: BoolArray) -> Float32Array:
    """Return (h, w, 4) the mean over the nearby core, and the distance from it in pixels.

    Wider windows count where none is near.
    """
    height, width = core.shape
    weight = core.astype(np.float32)
    total = np.zeros((height, width, 4), np.float32)
    stack = cv2.merge([*cv2.split(values * weight[..., None]), weight])
    for index, sigma in enumerate(_SIGMAS):
        step = int(sigma // _CELL_OF_SIGMA)
        size = (max(width // step, 1), max(height // step, 1))
        coarse = cv2.resize(stack, size, interpolation=cv2.INTER_AREA)
        blurred = blur(np.asarray(coarse, np.float32), sigma / step)
        total += _FADE**index * cv2.resize(blurred, (width, height))
    lost = total[..., 3] < _NO_WEIGHT
    total[..., :3] /= np.maximum(total[..., 3:], _NO_WEIGHT)
    total[lost, :3] = values[core].mean(axis=0)
    total[..., 3] = cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3)
    return total


def _enlarge(picture: UInt8Array, width: int, height: int) -> UInt8Array:
    large = cv2.resize(picture, (width, height), interpolation=cv2.INTER_NEAREST)
    return np.asarray(large, np.uint8)
