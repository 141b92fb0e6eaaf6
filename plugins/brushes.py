"""Repeats what an artist drew with hairkit's brushes over the hair."""

from __future__ import annotations

from hairkit import Groom, hookimpl
from hairkit.grooming import brushes
from hairkit.types.edits import Edits


@hookimpl
def edit_groom(groom: Groom, edits: Edits) -> Groom:
    """Do the strokes; those that reach no hair are named, and kept."""
    return brushes.edit_groom(groom, edits)
