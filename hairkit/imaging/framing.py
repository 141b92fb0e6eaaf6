"""Finds the head in photos: which way is up, and the part of each photo that holds head and hair.

Networks see a photo on a coarse grid, so a head that is small in it is lost among clothes. Faces,
and the silhouettes of persons where no face shows, tell where heads are and how large they are in
the median of a turn: its frames are of one size. Long hair leaves such a frame: it grows down
while the hair network finds hair at the lower edge of most photos.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int64Array, UInt8Array
from hairkit.imaging.hair_features import EYES, MOUTH
from hairkit.imaging.hair_network import hair_probability, likely_landmarks, silhouette
from hairkit.imaging.person_outline import MIDDLE, PERSON_LEVEL, trace_outline
from hairkit.types.capture import Capture, View
from hairkit.types.face import SURE_PRESENCE, Face
from hairkit.types.framing import Framing
from hairkit.types.person import Person

FACE_VOTES = 3.0
"""Votes of a face; the edge of a picture where the person stands has one. Of 152 masks the edge
was right in 148, of 31 faces all."""
CLEAR = 2.0
"""The person covers the bottom edge at least this many times as far as any other."""
TURNS_TO_BOTTOM = np.array([0, 1, 2, 3])
"""Clockwise quarter turns that bring the bottom, right, top and left edge to the bottom."""
LEAST_PERSON, LEAST_WIDTH = 0.01, 0.04
"""Share of the photo below which a silhouette is a speck, and the same of a head's width in the
longer side; in a whole-body frame they are 0.1 and 0.1."""
ROOM, REGION = 0.1, 0.7
"""A person who fills less than the second share of the photo's longer side is cropped first, with
this share of room around."""
BORDER_LEVELS, SIDE_DRAWN = 12, 0.5
"""Levels by which a border's pixels differ at most from its corner, and the least share of each
side of a picture inside of it that differs more: a person before a white wall has no such sides."""
WIDTH_OF_FACE, CROWN_OF_FACE = 2.8, 1.75
"""Width of a head with its hair, and height of its crown above the eyes, in lengths from eyes to
mouth: means of 13 captures."""
CHIN_DEPTH = 1.5
"""A face whose eyes lie farther than this below the crown of the silhouette, head widths, or
above it, is another person's."""
SHOULDERS = 1.8
"""Times the median head's width from which only shoulders were found, as from behind."""
ASIDE, OVER = 1.4, 0.3
"""Head widths from the middle of the head to the sides of the frame, and from the crown to its
upper edge."""
DEPTHS = (2.5, 3.8, 5.7)
"""Head widths from the crown to the lower edge of the frames: the first that hair crosses in half
of the photos or fewer."""
CROSSING = 0.15
"""Hair crosses the lower edge where it is wider there than this, head widths."""
WHOLE = 0.85
"""A frame longer than this share of the photo's longer side is the whole photo."""


class Head(NamedTuple):
    """Where a head is in a photo, pixels of its picture."""

    middle: float
    """Its column."""
    crown: float
    """Row of its upper end."""
    width: float
    """With hair."""


def find_framing(capture: Capture, faces: tuple[Face, ...], persons: tuple[Person, ...]) -> Framing:
    """Return the part of each photo that holds the head.

    Parameters
    ----------
    capture
        The photos, or parts of them, upright, in any order.
    faces, persons
        What was found in each.
    """
    seen = zip(capture.views, faces, persons, strict=True)
    views = [view.with_findings(face, person) for view, face, person in seen]
    heads = _of_one_size([_find_head(view) for view in views], views)
    parts = _parts(views, heads)
    frames = [view.to_photo(part) for view, part in zip(views, parts, strict=True)]
    middles = [_middle(*each) for each in zip(views, heads, parts, strict=True)]
    turns = np.array([view.quarter_turns for view in views])
    return Framing(turns, np.rint(frames).astype(np.int64).reshape(-1, 4), np.array(middles))


def find_regions(capture: Capture, faces: tuple[Face, ...], persons: tuple[Person, ...]) -> Framing:
    """Return how photos are turned upright, and the part of each that holds the person, if small.

    Arguments are those of `find_framing`, of whole photos that may lie on their side.
    """
    sizes = [(view.width, view.height) for view in capture.views]
    turns = find_quarter_turns(sizes, faces, persons)
    seen = zip(capture.views, faces, persons, turns, strict=True)
    views = [view.with_findings(face, person).turned(int(n)) for view, face, person, n in seen]
    parts = _as_large([_region(view) for view in views], views)
    frames = [view.to_photo(part) for view, part in zip(views, parts, strict=True)]
    middles = [frame.mean(axis=0) for frame in frames]
    return Framing(turns, np.rint(frames).astype(np.int64).reshape(-1, 4), np.array(middles))


def _region(view: View) -> Float64Array:
    """Return the corners (2, 2) of the part of a picture that holds the person; all where large."""
    inner = _without_border(view.image)
    inner = inner if _is_small(inner, view) else _whole(view)
    if view.person is None:
        return inner
    part = _around(view.person.alpha)
    if _is_small(part, view):  # a large person is no smaller with hair
        part = _around(silhouette(view))
    within = part.clip(*inner)
    return within if _is_small(part, view) and (within[1] > within[0]).all() else inner


def _as_large(parts: list[Float64Array], views: Sequence[View]) -> list[Float64Array]:
    """Return parts (2, 2) of pictures, none smaller than the median one.

    A person from behind may be found without the body, which the other photos show.
    """
    edges = np.array([max(view.width, view.height) for view in views])
    sizes = np.array([(part[1] - part[0]).max() for part in parts])
    room = np.maximum(np.median(sizes / edges) * edges - sizes, 0) / 2
    grown = parts + room[:, None, None] * [[-1.0], [1.0]]
    return [part.clip(0, (v.width, v.height)) for part, v in zip(grown, views, strict=True)]


def _around(alpha: UInt8Array) -> Float64Array:
    """Return the corners (2, 2) of a person with room around, no area where there is a speck."""
    inside = alpha > PERSON_LEVEL
    if inside.mean() < LEAST_PERSON:
        return np.zeros((2, 2))
    spans = [np.nonzero(inside.any(axis))[0][[0, -1]] for axis in (0, 1)]
    first, last = np.transpose(spans).astype(np.float64)
    room = ROOM * (last - first).max()
    return np.stack([first - room, last + room])


def _is_small(part: Float64Array, view: View) -> bool:
    """Return whether a part, by its corners (2, 2), is not most of the picture."""
    return bool((part[1] - part[0]).max() <= REGION * max(view.width, view.height))


def _without_border(image: UInt8Array) -> Float64Array:
    """Return the corners (2, 2) of a picture inside a border of one colour; all without such."""
    whole = np.array([[0.0, 0.0], image.shape[1::-1]])
    corner = image[0, 0].astype(np.float64)
    drawn = np.asarray(cv2.inRange(image, corner - BORDER_LEVELS, corner + BORDER_LEVELS) == 0)
    if not drawn.any():
        return whole
    (left, right), (top, bottom) = (np.nonzero(drawn.any(axis))[0][[0, -1]] for axis in (0, 1))
    inner = drawn[top : bottom + 1, left : right + 1]
    sides = (inner[0], inner[-1], inner[:, 0], inner[:, -1])
    if min(side.mean() for side in sides) < SIDE_DRAWN:
        return whole
    return np.array([[left, top], [right + 1, bottom + 1]], np.float64)


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


def _find_head(view: View) -> Head | None:
    """Return the head by the silhouette, or by the face where they contradict each other."""
    landmarks, head = likely_landmarks(view), None
    least = LEAST_WIDTH * max(view.width, view.height)
    if view.person is not None:
        outline = trace_outline(silhouette(view))
        if outline is not None and outline.width_px >= least:
            head = Head(outline.middle_px, outline.top_px, outline.width_px)
    if landmarks is None:
        return head
    eyes, mouth = landmarks[EYES].mean(axis=0), landmarks[MOUTH].mean(axis=0)
    if head is not None:
        below, beside = (eyes[1] - head.crown) / head.width, (eyes[0] - head.middle) / head.width
        if 0 < below < CHIN_DEPTH and abs(beside) < 1:
            return head
    length = float(np.hypot(*(eyes - mouth)))
    face = Head(float(eyes[0]), float(eyes[1]) - CROWN_OF_FACE * length, WIDTH_OF_FACE * length)
    return None if face.width < least else face


def _of_one_size(heads: list[Head | None], views: Sequence[View]) -> list[Head | None]:
    """Return heads as wide as the median one in a photo of its size; shoulders have its place."""
    edges = [float(max(view.photo_size)) for view in views]
    shares = [
        np.append(view.to_photo(np.array(head[:2])), view.scale * head.width) / edge
        for head, view, edge in zip(heads, views, edges, strict=True)
        if head
    ]
    *place, usual = np.median(shares, axis=0) if shares else np.zeros(3)
    alike = []
    for head, view, edge in zip(heads, views, edges, strict=True):
        width = float(usual * edge / view.scale)
        if head and head.width > SHOULDERS * width:
            middle, crown = view.from_photo(edge * np.array(place)).tolist()
            head = Head(middle, crown, width)
        alike.append(head and head._replace(width=width))
    return alike


def _parts(views: Sequence[View], heads: Sequence[Head | None]) -> list[Float64Array]:
    """Return the corners (2, 2) of the parts of the pictures that hold the heads and their hair."""
    parts = []
    for depth in DEPTHS:
        parts = [_part(view, head, depth) for view, head in zip(views, heads, strict=True)]
        cut = [
            _hair_crosses(view, part, head.width)
            for view, head, part in zip(views, heads, parts, strict=True)
            if head and part[1, 1] < view.height
        ]
        if sum(cut) <= len(cut) / 2:
            break
    return parts


def _middle(view: View, head: Head | None, part: Float64Array) -> Float64Array:
    """Return the middle of a head in the photo on disk; of the picture where that is whole."""
    if head is None or np.array_equal(part, _whole(view)):
        return view.to_photo(view.aim)
    return view.to_photo(np.array([head.middle, head.crown + MIDDLE * head.width]))


def _whole(view: View) -> Float64Array:
    return np.array([[0.0, 0.0], [view.width, view.height]])


def _part(view: View, head: Head | None, depth: float) -> Float64Array:
    """Return the corners (2, 2) of the part that holds a head, down to `depth` head widths below
    the crown; the whole picture where that is most of it."""
    whole = _whole(view)
    if head is None:
        return whole
    size = np.rint(head.width * np.array([2 * ASIDE, OVER + depth])).clip(1, whole[1])
    corner = np.rint([head.middle - size[0] / 2, head.crown - OVER * head.width])
    first = corner.clip(0, whole[1] - size)
    part = np.stack([first, first + size])
    return whole if (part[1] - part[0]).max() > WHOLE * whole.max() else part


def _hair_crosses(view: View, corners: Float64Array, width: float) -> bool:
    """Return whether hair crosses the lower edge of a part of the picture."""
    (left, top), (right, bottom) = corners.astype(int)
    part = np.s_[top:bottom, left:right]
    person = None if view.person is None else view.person.part(part)
    landmarks = likely_landmarks(view)
    if landmarks is not None:
        landmarks = landmarks - corners[0]
    hair: BoolArray = hair_probability(view.image[part], person, landmarks)[..., 0] > 0.5
    cells = hair.shape[1] / (right - left)
    return bool(hair[-2:].sum(axis=1).mean() > CROSSING * width * cells)
