"""Which side of each photo is up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hairkit.arrays import Float64Array, Int64Array, UInt8Array
from hairkit.types.face import SURE_PRESENCE, Face
from hairkit.types.person import Person

FACE_VOTES = 3.0
"""Votes of a face; the edge of a picture where the person stands has one. Of 152 masks the edge
was right in 148, of 31 faces all."""
CLEAR = 2.0
"""The person covers the bottom edge at least this many times as far as any other."""
TURNS_TO_BOTTOM = np.array([0, 1, 2, 3])
"""Clockwise quarter turns that bring the bottom, right, top and left edge to the bottom."""


def find_quarter_turns(
    sizes: Sequence[tuple[int, int]], faces: Sequence[Face], persons: Sequence[Person]
) -> Int64Array:
    """Return the clockwise quarter turns (V,) that bring the photos upright.

    Photos are turned by the majority of those with the same long side (`sizes` are widths and
    heights): a camera is held one way for a while.
    """
    turns = np.zeros(len(sizes), np.int64)
    wide = np.array([width > height for width, height in sizes])
    votes = np.array([_votes(f, p) for f, p in zip(faces, persons, strict=True)])
    for group in (wide, ~wide):
        if group.any():
            turns[group] = int(votes[group].sum(axis=0).argmax())
    return turns


def _votes(face: Face, person: Person) -> Float64Array:
    """Return the votes (4,) of a photo for 0 to 3 quarter turns."""
    votes = np.zeros(4)
    if face.presence >= SURE_PRESENCE:
        votes[face.quarter_turns] = FACE_VOTES
    elif person.alpha.size:
        covered = _covered_edges(person.alpha)
        first, second = np.argsort(covered)[::-1][:2]
        if covered[first] > CLEAR * covered[second]:
            votes[TURNS_TO_BOTTOM[first]] = 1.0
    return votes


def _covered_edges(alpha: UInt8Array) -> Float64Array:
    """Return the share of the bottom, right, top and left edge that the person covers."""
    edges = (alpha[-1], alpha[:, -1], alpha[0], alpha[:, 0])
    return np.array([edge.mean() / np.iinfo(np.uint8).max for edge in edges])
