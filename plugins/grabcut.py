"""Segmentation from a user's strokes: GrabCut as in the thesis (4.2), or with three classes.

The user draws a rectangle around the hair, lines and convex areas on hair, and lines and convex
areas on anything else (Rother, Kolmogorov and Blake, "GrabCut", SIGGRAPH 2004, with the tools of
the thesis). `layered` learns hair, person and background separately, from colour and texture, at
reduced size, and refines the edges at full size; `opencv` is OpenCV's two-class GrabCut, which the
thesis used.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.hookspecs import hookimpl
from hairkit.imaging.masked_filters import picture_scale, reduced_size
from hairkit.imaging.seeded_segmentation import UNKNOWN, LabelSettings, label_from_seeds
from hairkit.io.strokes import LINE_WIDTH, Stroke, Strokes, rasterise, read_view_strokes
from hairkit.options import option
from hairkit.types.capture import View
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask

_GAMMA = {"as_is": 1.0, "brighter": 0.7, "much_brighter": 0.5, "darker": 1.4}
"""Exponent of the brightness in [0, 1] for each preset."""
_RECTANGLE_MARGIN = 2
"""Reduced pixels by which the hair may be outside the rectangle; a hand draws no better."""
_SIDE_STRIP = 2
"""Reduced pixels at the picture's sides that are backdrop where the rectangle ends before them."""
_OUTSIDE = 0.5
"""Share of a background stroke outside the rectangle that makes it a stroke on the backdrop."""


@dataclass(frozen=True)
class Options:
    """Settings of the segmentation from strokes."""

    model: str = option(
        "layered",
        choices=("layered", "opencv"),
        doc="Three classes, or OpenCV's two-class GrabCut.",
    )
    brightness: str = option(
        "as_is", choices=tuple(_GAMMA), doc="Preset applied to the photo before segmentation."
    )
    iterations: int = option(2, low=1, high=20, doc="Times that the colour models are learnt.")
    seed: int = option(1, low=0, high=2**31 - 1, doc="Seed of the colour clustering.")


@hookimpl
def segment(view: View, options: Options) -> Mask | None:
    """Label the photo from its strokes; None when it has none, so that the next plugin is asked.

    Strokes that only correct the automatic mask are left to the plugin that makes it.
    """
    width, height = reduced_size(view.width, view.height)
    strokes = read_view_strokes(view, width, height)
    if strokes is None or strokes.only_parting or strokes.corrects:
        return None
    if not strokes.labelled("foreground"):
        raise InputError(
            f"{view.strokes_path}: no foreground stroke, draw at least one on the hair"
        )
    image = brighten(view.image, options.brightness)
    thickness = LINE_WIDTH * picture_scale(height)
    allowed = _inside(strokes, width, height)
    if options.model == "opencv":
        hair = _opencv_grabcut(image, strokes, allowed, thickness, options)
        return Mask(np.where(hair, HAIR, BACKGROUND).astype(np.uint8), person_known=False)
    seeds = seed_image(strokes, width, height, thickness)
    if not np.isin(seeds, (PERSON, BACKGROUND)).any():
        raise InputError(f"{view.strokes_path}: no background stroke, draw one off the hair")
    settings = LabelSettings(rounds=options.iterations, seed=options.seed)
    labels = label_from_seeds(image, seeds, allowed, settings)
    known = bool((seeds == PERSON).any() and (seeds == BACKGROUND).any())
    if not known:
        labels = np.where(labels == HAIR, HAIR, BACKGROUND).astype(np.uint8)
    return Mask(labels, person_known=known)


def seed_image(strokes: Strokes, width: int, height: int, thickness: float) -> UInt8Array:
    """Return the (height, width) labels that the strokes make certain, `UNKNOWN` elsewhere.

    A background stroke is on the person or on the backdrop (`_is_backdrop`). The rows above the
    rectangle and the picture's sides beside its upper half are backdrop too.
    """
    seeds = np.full((height, width), UNKNOWN, np.uint8)
    if strokes.rectangle is not None:
        _mark_backdrop(seeds, strokes.rectangle)
    top = min(stroke.points[:, 1].min() for stroke in strokes.labelled("foreground"))
    for stroke in strokes.labelled("background"):
        label = BACKGROUND if _is_backdrop(stroke, strokes, float(top)) else PERSON
        seeds[rasterise(stroke, width, height, thickness)] = label
    for stroke in strokes.labelled("person"):
        seeds[rasterise(stroke, width, height, thickness)] = PERSON
    for stroke in strokes.labelled("foreground"):
        seeds[rasterise(stroke, width, height, thickness)] = HAIR
    return seeds


def _mark_backdrop(seeds: UInt8Array, rectangle: Float64Array) -> None:
    (left, top), (right, bottom) = rectangle
    width = seeds.shape[1]
    seeds[: max(int(top) - _RECTANGLE_MARGIN, 0)] = BACKGROUND
    upper = slice(0, max(int((top + bottom) / 2), 0))
    room = _RECTANGLE_MARGIN + _SIDE_STRIP
    if left > room:
        seeds[upper, :_SIDE_STRIP] = BACKGROUND
    if right < width - room:
        seeds[upper, -_SIDE_STRIP:] = BACKGROUND


def _is_backdrop(stroke: Stroke, strokes: Strokes, hair_top: float) -> bool:
    """Return whether a background stroke is on the backdrop: it passes above or beside the hair."""
    points = stroke.sampled()
    if points[:, 1].min() < hair_top:
        return True
    if strokes.rectangle is None:
        return False
    (left, top), (right, bottom) = strokes.rectangle
    outside = (points[:, 0] < left) | (points[:, 0] > right) | (points[:, 1] < top)
    return bool(outside.mean() > _OUTSIDE and points[:, 1].min() < (top + bottom) / 2)


def _inside(strokes: Strokes, width: int, height: int) -> BoolArray:
    """Return where hair may be: in the rectangle and its margin, and under foreground strokes."""
    allowed = np.ones((height, width), np.bool_)
    if strokes.rectangle is not None:
        (left, top), (right, bottom) = strokes.rectangle
        rows, columns = np.arange(height), np.arange(width)
        margin = _RECTANGLE_MARGIN
        allowed = np.logical_and.outer(
            (rows >= top - margin) & (rows < bottom + margin),
            (columns >= left - margin) & (columns < right + margin),
        )
    for stroke in strokes.labelled("foreground"):
        allowed |= rasterise(stroke, width, height, 1.0)
    return allowed


def brighten(image: UInt8Array, preset: str) -> UInt8Array:
    """Return the photo with the gamma curve of one of the presets applied."""
    if preset == "as_is":
        return image
    table = np.round(255 * (np.arange(256) / 255) ** _GAMMA[preset]).astype(np.uint8)
    return np.asarray(cv2.LUT(image, table), np.uint8)


def _opencv_grabcut(
    image: UInt8Array, strokes: Strokes, allowed: BoolArray, thickness: float, options: Options
) -> BoolArray:
    """Return hair (H, W) by OpenCV's GrabCut at reduced size, enlarged."""
    height, width = allowed.shape
    mask = np.where(allowed, cv2.GC_PR_FGD, cv2.GC_BGD).astype(np.uint8)
    for stroke in strokes.strokes:
        sure = cv2.GC_FGD if stroke.label == "foreground" else cv2.GC_BGD
        mask[rasterise(stroke, width, height, thickness)] = sure
    small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    hair_model, rest_model = np.zeros((1, 65)), np.zeros((1, 65))
    everywhere = (0, 0, width, height)  # ignored in this mode
    cv2.setRNGSeed(options.seed)  # OpenCV's clustering is random otherwise
    rounds = options.iterations
    cv2.grabCut(small, mask, everywhere, rest_model, hair_model, rounds, cv2.GC_INIT_WITH_MASK)
    hair = ((mask == cv2.GC_FGD) | (mask == cv2.GC_PR_FGD)).astype(np.float32)
    return np.asarray(cv2.resize(hair, image.shape[1::-1]) > 0.5)
