"""Last step of the pipeline: assemble strands, head and the photos' colours as a groom."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float64Array
from hairkit.colour import linear_from_srgb
from hairkit.errors import InputError
from hairkit.types.capture import View
from hairkit.types.chosen import ChosenHair
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.head import Head, Roots
from hairkit.types.mask import Mask
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.waves import Waves

SHORTEST = 1e-3
"""Strands shorter than this are no strands, metres."""

ENOUGH = 0.98
"""Share of roots that should give a strand."""

TIP_SHADE = 0.45
"""How bright tips are in photos over hair of the same colour near the crown, in linear light: 0.27
to 0.65 in eight path-traced captures."""

LIGHT = 0.67
"""How bright hair is drawn under the light at its camera, over its colour, in linear light. With it
the mean luma of hair drawn by its own cameras is 0.93 to 1.15 of the photos' on ten captures, of
straight hair more than of waves, whose locks shade each other; 1.6 where coils become straight."""

DEPTH = 0.87
"""Power of the channels of a colour, over their mean, with which hair is drawn as colourful as it
was photographed: the film curve of pictures deepens dark colours. On ten captures chroma is 1.00 of
the photos' in the mean, and 0.10 off on a scale of logarithms; with 1 it is 1.13 and 0.14."""

DARKEST = 1e-4
"""Least brightness that is divided by."""

_EDGE_PX = 4
_MOST_PIXELS = 20_000
_log = logging.getLogger("hairkit")


def assemble_groom(
    views: Sequence[View],
    masks: Sequence[Mask],
    head: Head,
    roots: Roots,
    strands: Strands,
    waves: Waves | None = None,
    tied: TiedHair | None = None,
    chosen: ChosenHair | None = None,
) -> Groom:
    """Return the groom of tracked strands, bound to the head, with the colour of the photos.

    Parameters
    ----------
    views, masks
        The photos and where hair is on them, in the same order.
    head
        The fitted head.
    roots
        Where the strands start; strand s belongs to root s.
    strands
        What tracking gave; strands shorter than `SHORTEST` are dropped.
    waves
        What the photos show of the hair's waves; None means straight hair.
    tied
        Where the strands are tied; None means loose hair.
    chosen
        Colours and width that the user chose; None means those of the photos.

    Raises
    ------
    InputError
        There is not one strand a root, or none is long enough.
    """
    if len(strands) != len(roots):
        raise InputError(
            f"tracking gave {len(strands)} strands for {len(roots)} roots, expected one each"
        )
    long_enough = strands.lengths() >= SHORTEST
    kept = int(np.count_nonzero(long_enough))
    if not kept:
        raise InputError(
            f"none of {len(roots)} roots gave a strand; check the masks: does hair touch the scalp?"
        )
    if kept < ENOUGH * len(roots):
        _log.warning("%d of %d roots gave no strand", len(roots) - kept, len(roots))
    curl = waves or Waves()
    material = replace(measure_colour(views, masks), curl_radius=curl.radius, curl_pitch=curl.pitch)
    material = material if chosen is None else chosen.material(material)
    return Groom(
        _as_guides(strands, roots, long_enough, material.width),
        head,
        roots.triangle[long_enough],
        roots.barycentric[long_enough],
        material,
        ties=() if tied is None else tuple(tail.tie for tail in tied.tails),
    )


def _as_guides(strands: Strands, roots: Roots, kept: BoolArray, width: float) -> Strands:
    """Return the strands that are kept, with root UVs, and a width and a group each."""
    grown = strands.select(kept)
    return Strands(
        grown.points,
        grown.offsets,
        np.full(len(grown.points), width, np.float32) if grown.widths is None else grown.widths,
        roots.uv[kept],
        np.zeros(len(grown), np.int32) if grown.group is None else grown.group,
        np.ones(len(grown), np.bool_),
    )


def measure_colour(views: Sequence[View], masks: Sequence[Mask]) -> HairMaterial:
    """Return a material with which hair is drawn as bright as it was photographed.

    All are of sRGB values. The colour near the crown is the median of the upper third of the hair's
    pixels of every view, near the tips of the lower third, which the sheen hardly moves. How much
    darker tips are tells little of their colour, since they hang in the shade: half of the
    difference to what is usual, on a scale of logarithms, is taken for the tips' own. Both together
    are then made as bright as the mean of all pixels, less the `LIGHT`, and paler by `DEPTH`.
    """
    crowns, tips, every = [], [], []
    for view, mask in zip(views, masks, strict=True):
        pixels = _hair_pixels(view, mask)
        third = len(pixels) // 3
        crowns.append(pixels[: third + 1])
        tips.append(pixels[-third - 1 :])
        every.append(pixels)
    root, tip = (linear_from_srgb(np.median(np.concatenate(p), axis=0)) for p in (crowns, tips))
    whole = linear_from_srgb(np.concatenate(every).mean(axis=0))
    crown, end = max(float(root.mean()), DARKEST), max(float(tip.mean()), DARKEST)
    tip = tip * min(np.sqrt(crown / (end * TIP_SHADE)), max(crown / end, 1.0))
    own = float(whole.mean()) / LIGHT / max(float(root.mean() + tip.mean()) / 2, DARKEST)
    root, tip = (np.minimum(own * _paler(colour), 1.0) for colour in (root, tip))
    return HairMaterial(root.astype(np.float32), tip.astype(np.float32))


def _paler(colour: Float64Array) -> Float64Array:
    """Return a colour (3,) as bright as another, which pictures deepen to that."""
    mean = max(float(colour.mean()), DARKEST)
    pale = np.maximum(colour / mean, DARKEST) ** DEPTH
    return np.asarray(pale * mean / pale.mean())


def _hair_pixels(view: View, mask: Mask) -> Float64Array:
    """Return sRGB (N, 3) in [0, 1] of hair away from its edge, from the picture's top down."""
    hair = mask.hair.astype(np.uint8)
    inner = cv2.erode(hair, np.ones((2 * _EDGE_PX + 1, 2 * _EDGE_PX + 1), np.uint8))
    row, column = np.nonzero(inner if inner.any() else hair)
    every = -(-len(row) // _MOST_PIXELS)
    return np.asarray(view.image[row[::every], column[::every]] / 255, np.float64)
