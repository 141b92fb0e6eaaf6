"""Last step of the pipeline: assemble strands, head and the photos' colours as a groom."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hairkit.arrays import BoolArray
from hairkit.errors import InputError
from hairkit.grooming.photo_colours import measure_colour, with_hues
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.chosen import ChosenHair
from hairkit.types.groom import Groom
from hairkit.types.head import Head, Roots
from hairkit.types.mask import Mask
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.waves import Waves

SHORTEST = 1e-3
"""Strands shorter than this are no strands, metres."""
ENOUGH = 0.98
"""Share of roots that should give a strand."""

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
    cameras: Sequence[Camera] = (),
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
    cameras
        Those of the photos, by which hues are measured along the strands.

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
    groom = Groom(
        _as_guides(strands, roots, long_enough, material.width),
        head,
        roots.triangle[long_enough],
        roots.barycentric[long_enough],
        material,
        ties=() if tied is None else tuple(tail.tie for tail in tied.tails),
    )
    if cameras:
        groom = with_hues(groom, views, masks, cameras)
    if chosen is None:
        return groom
    own = None if chosen.root_colour or chosen.tip_colour else groom.strands.colours
    material = chosen.material(groom.material)
    return replace(groom, material=material, strands=replace(groom.strands, colours=own))


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
