"""Refine the edges of a coarse labelling at full size, where pixels mix the colours on both sides.

Near an edge a pixel's colour C is explained as a H + (1 - a) B, with H and B the means of the sure
hair and the sure background (or person) nearby; a is the share of hair (the alpha of Porter and
Duff 1984).
"""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.imaging.masked_filters import blur, picture_scale
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

_SIGMAS = (4.0, 12.0, 36.0)
"""Gaussians in reduced pixels of the local means; wider ones count where narrower have nothing."""

_CELL_OF_SIGMA = 4
"""Wide Gaussians are computed on cells of a quarter of their sigma."""

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

    Parameters are those of `refine_labels_and_alpha`.
    """
    return refine_labels_and_alpha(image, labels, seeds, hair_allowed)[0]


def refine_near_hair(
    image: UInt8Array, labels: UInt8Array, seeds: UInt8Array
) -> tuple[UInt8Array, UInt8Array]:
    """Return labels (H, W) and opacity with edges refined near the hair of the reduced picture.

    Far from hair an outline between skin and backdrop that is as dark as hair is none. Parameters
    are those of `refine_labels_and_alpha`.
    """
    anywhere = np.ones(labels.shape, np.bool_)
    fine, alpha = refine_labels_and_alpha(image, labels, seeds, anywhere)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_NEARBY, _NEARBY))
    nearby = cv2.dilate((labels == HAIR).astype(np.uint8), disc)
    large = image.shape[1::-1]
    far = cv2.resize(nearby, large, interpolation=cv2.INTER_NEAREST) == 0
    coarse = cv2.resize(labels, large, interpolation=cv2.INTER_NEAREST)
    result: UInt8Array = np.where(far, coarse, fine).astype(np.uint8)
    return result, np.where(far, np.uint8(0), alpha)


def refine_labels_and_alpha(
    image: UInt8Array, labels: UInt8Array, seeds: UInt8Array, hair_allowed: BoolArray
) -> tuple[UInt8Array, UInt8Array]:
    """Return labels (H, W) of the full picture from those of a reduced one, and hair's opacity.

    The opacity (H, W), 0 to 255, is the share of hair in a pixel near an edge.

    Parameters
    ----------
    image : (H, W, 3)
        RGB.
    labels : (h, w)
        255, 128 and 0, correct but for a few pixels at the edges.
    seeds : (h, w)
        Labels that are certain; other values elsewhere.
    hair_allowed : (h, w)
        False where no hair can be.
    """
    height, width = image.shape[:2]
    lab = cv2.cvtColor(image.astype(np.float32) / np.float32(255), cv2.COLOR_RGB2Lab)
    lab = blur(np.asarray(lab, np.float32), max(picture_scale(height), _LEAST_BLUR))
    small = np.asarray(
        cv2.resize(lab, labels.shape[::-1], interpolation=cv2.INTER_AREA), np.float32
    )
    sure = _sure(labels, seeds)
    if not sure[HAIR].any():
        plain = cv2.resize(labels, (width, height), interpolation=cv2.INTER_NEAREST)
        enlarged: UInt8Array = np.asarray(plain, np.uint8)
        return enlarged, np.where(enlarged == HAIR, np.uint8(255), np.uint8(0))
    unsure = ~np.logical_or.reduce(list(sure.values()))
    band = _enlarge(unsure, width, height)
    mean = {
        label: _upsample(_local_mean(small, core), band)
        for label, core in sure.items()
        if core.any()
    }
    away = {label: _upsample(_distance(sure[label]), band) for label in mean}
    coarse = np.where(unsure, np.uint8(PERSON), labels)
    large = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_NEAREST)
    result: UInt8Array = np.asarray(large, np.uint8)
    result[band], share = _classify(lab[band], mean, away)
    alpha = np.where(result == HAIR, np.uint8(255), np.uint8(0))
    alpha[band] = np.rint(255 * share)
    forbidden = (result == HAIR) & ~_enlarge(hair_allowed, width, height)
    result[forbidden] = BACKGROUND
    alpha[forbidden] = 0
    return result, alpha


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
    colour: Float32Array, mean: dict[int, Float32Array], away: dict[int, Float32Array]
) -> tuple[UInt8Array, Float32Array]:
    """Return label (N,) and share of hair (N,) of pixels of `colour` (N, 3).

    A pixel is mixed of hair and of the likelier of the other two.
    """
    best = np.full(len(colour), np.inf, np.float32)
    result = np.full(len(colour), HAIR, np.uint8)
    opacity = np.ones(len(colour), np.float32)
    limits = {PERSON: HAIR_OVER_PERSON, BACKGROUND: HAIR_OVER_BACKGROUND}
    for label, limit in limits.items():
        if label not in mean:
            continue
        across = mean[HAIR] - mean[label]
        offset = colour - mean[label]
        norm = np.maximum(np.einsum("nc,nc->n", across, across), 1.0)
        share = np.clip(np.einsum("nc,nc->n", offset, across) / norm, 0, 1)
        rest = offset - share[:, None] * across
        misfit = np.einsum("nc,nc->n", rest, rest) / _NOISE + _PER_PIXEL * away[label]
        better = misfit < best
        best = np.where(better, misfit, best)
        result = np.where(better, np.where(share > limit, HAIR, label), result).astype(np.uint8)
        opacity = np.where(better, share, opacity)
    return result, opacity


def _local_mean(values: Float32Array, core: BoolArray) -> Float32Array:
    """Return (h, w, 3) the mean over the nearby core; wider windows count where none is near."""
    height, width = core.shape
    weight = core.astype(np.float32)
    total = np.zeros(values.shape, np.float32)
    share = np.zeros_like(weight)
    stack = np.dstack([values * weight[..., None], weight])
    for index, sigma in enumerate(_SIGMAS):
        step = int(sigma // _CELL_OF_SIGMA)
        size = (max(width // step, 1), max(height // step, 1))
        coarse = cv2.resize(stack, size, interpolation=cv2.INTER_AREA)
        blurred = cv2.resize(blur(np.asarray(coarse, np.float32), sigma / step), (width, height))
        total += _FADE**index * blurred[..., :3]
        share += _FADE**index * blurred[..., 3]
    lost = share < _NO_WEIGHT
    mean = np.asarray(total / np.maximum(share, _NO_WEIGHT)[..., None], np.float32)
    mean[lost] = values[core].mean(axis=0)
    return mean


def _distance(core: BoolArray) -> Float32Array:
    return np.asarray(cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3), np.float32)


def _enlarge(mask: BoolArray, width: int, height: int) -> BoolArray:
    large = cv2.resize(mask.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    return np.asarray(large > 0)


def _upsample(values: Float32Array, band: BoolArray) -> Float32Array:
    """Return `values` of the reduced picture at the band's pixels of the full one."""
    height, width = band.shape
    return np.asarray(cv2.resize(values, (width, height))[band], np.float32)
