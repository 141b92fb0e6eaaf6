"""Masks that come with the photos: label images 255 hair, 128 the rest of the person, 0 background.

A file with only two levels says where the hair is and nothing about the person: the upper level is
hair. Whoever has masks of their own, from a matting tool or by hand, puts them beside the photos.
"""

from __future__ import annotations

import cv2
import numpy as np

from hairkit import Mask, View, hookimpl
from hairkit.arrays import UInt8Array
from hairkit.errors import InputError
from hairkit.io.photos import read_drawing
from hairkit.types.mask import BACKGROUND, HAIR, PERSON


@hookimpl
def segment(view: View) -> Mask | None:
    """Return the mask of the view's file at working size, None when the view has no file."""
    if view.mask_path is None:
        return None
    drawn = np.rot90(read_drawing(view.mask_path), -view.quarter_turns)
    size = drawn.shape[1], drawn.shape[0]
    if size != view.photo_size:
        wanted = f"{view.photo_size[0]} x {view.photo_size[1]}"
        raise InputError(
            f"{view.mask_path}: {size[0]} x {size[1]} pixels, its photo has {wanted};"
            " draw the mask on the photo"
        )
    left, top, right, bottom = view.frame
    labels, person_known = _labels(drawn[top:bottom, left:right], str(view.mask_path))
    if labels.shape != (view.height, view.width):
        labels = cv2.resize(  # type: ignore[assignment]  # OpenCV keeps uint8
            labels, (view.width, view.height), interpolation=cv2.INTER_NEAREST_EXACT
        )
    if not (labels == HAIR).any():
        raise InputError(f"{view.mask_path}: no pixel is marked as hair; paint the hair 255")
    return Mask(labels, person_known)


def _labels(drawn: UInt8Array, where: str) -> tuple[UInt8Array, bool]:
    """Return the labels, and whether they tell the person from the background."""
    levels = np.flatnonzero(np.bincount(drawn.ravel(), minlength=256))
    if PERSON in levels and np.isin(levels, [BACKGROUND, PERSON, HAIR]).all():
        return drawn, True
    if len(levels) == 1:  # nothing but hair, or nothing at all
        return np.full_like(drawn, HAIR if levels[0] == HAIR else BACKGROUND), False
    if len(levels) == 2 and (levels[0] < PERSON <= levels[1] or levels.tolist() == [0, 1]):
        return np.where(drawn == levels[1], np.uint8(HAIR), np.uint8(BACKGROUND)), False
    stray = next(level for level in levels if level not in (BACKGROUND, PERSON, HAIR))
    raise InputError(
        f"{where}: holds the value {stray}, expected 255 hair, 128 person and 0 background,"
        " or two levels"
    )
