"""Segmentation without strokes: a small network, then this photo's own colours, then the matte.

A convolutional network that knows hair, skin, cloth and backdrop from rendered heads
(`hairkit.imaging.hair_network`) says on a coarse grid what is probable. Colour mixtures learnt from
where it is sure tell this person's hair from this backdrop (after Rother et al. 2004), and edges
are refined at full size (`hairkit.imaging.alpha_matting`). A person's probability and the face's
landmarks, where a view has them, are inputs of the network; it works without. Strokes that correct
this mask (`flags.corrects` of their file) decide what is under them and what is like it nearby.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.errors import InputError
from hairkit.hookspecs import hookimpl
from hairkit.imaging.corrections import BRUSHED, Corrections, paint_to_edges
from hairkit.imaging.hair_network import find_hair, mark_face
from hairkit.imaging.masked_filters import picture_scale, reduced_size
from hairkit.imaging.seeded_segmentation import label_from_probability
from hairkit.io.strokes import LINE_WIDTH, rasterise, read_view_strokes
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, Mask

_LEAST_HAIR = 5e-4
"""Share of the picture below which there is no hair."""


@dataclass(frozen=True)
class Options:
    """Settings of the segmentation without strokes."""


@hookimpl
def segment(view: View, options: Options) -> Mask:
    """Label a photo.

    Raises
    ------
    InputError
        No hair was found.
    """
    size = reduced_size(view.width, view.height)
    corrections = _corrections(view, size)
    labels, alpha = label_from_probability(
        view.image, find_hair(view), size, mark_face(view, size) > 0, corrections=corrections
    )
    if np.count_nonzero(labels == HAIR) < _LEAST_HAIR * labels.size:
        raise InputError(
            f"no hair found in photo {view.name}; draw strokes on it or give a mask file"
        )
    return Mask(labels, person_known=True, alpha=alpha)


def _corrections(view: View, size: tuple[int, int]) -> Corrections | None:
    """Return what strokes say of the reduced picture's pixels."""
    drawn = read_view_strokes(view, *size)
    if drawn is None:
        return None
    hair = np.zeros(size[::-1], np.bool_)
    rest = np.zeros_like(hair)
    brushed = np.zeros(hair.shape, np.float32)
    if drawn.rectangle is not None:
        (left, top), (right, bottom) = np.clip(np.rint(drawn.rectangle), 0, None).astype(int)
        rest[:] = True
        rest[top:bottom, left:right] = False
    for stroke in drawn.strokes:
        if stroke.label == "parting":
            continue
        under = rasterise(stroke, *size, LINE_WIDTH * picture_scale(size[1]))
        is_hair = stroke.label == "foreground"
        hair[under], rest[under] = is_hair, not is_hair
        if stroke.radius is not None:
            small = cv2.resize(view.image, size, interpolation=cv2.INTER_AREA)
            painted = paint_to_edges(np.asarray(small, np.uint8), under, stroke.radius)
            brushed[painted] = BRUSHED if is_hair else -BRUSHED
    return Corrections(hair, rest, brushed)
