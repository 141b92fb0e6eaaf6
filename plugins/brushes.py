"""Repeats what an artist drew with hairkit's brushes over the strands."""

from __future__ import annotations

import logging

from hairkit import Hull, Strands, hookimpl
from hairkit.grooming.brushes import BRUSHES, HeadRoom, brush_strands
from hairkit.types.edits import Edits

_log = logging.getLogger(__name__)


@hookimpl
def edit_strands(strands: Strands, hull: Hull, edits: Edits) -> Strands:
    """Do the strokes; those that reach no hair are named, and kept."""
    room = HeadRoom(hull.grid, hull.head_distance)
    edited, reached = brush_strands(strands, edits, room, BRUSHES)
    for number, (edit, met) in enumerate(zip(edits.strokes, reached, strict=True), start=1):
        if not met:
            _log.warning("stroke %d (%s) reaches no hair; it is kept", number, edit.setting.brush)
    return edited
