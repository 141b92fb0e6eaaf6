"""The turn found from faces, outlines and skin; order and names of the files do not matter.

Faces tell the azimuths of frontal photos. All other photos may be anywhere around the head, and
what fits best is searched for (`.search`): faces lie where their yaw says, outlines of opposite
views mirror each other and those of neighbours are alike, the share of skin falls from the face to
the back, and steps are even rather than not. A photo without which the rest is a better turn is one
from above. Frames of a video are in the order of time. What is no turn around one head is refused
in one line.

* `appearance`: outlines, skin, copies
* `arrangement`: how well photos fit azimuths
* `describe`: order and names of views, and the summary
* `refuse`: what is no turn
* `search`: the cheapest arrangement, and the next
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hairkit import Capture, View, hookimpl
from hairkit.arrays import BoolArray, Float64Array, Int64Array, UInt8Array
from hairkit.io.capture_reader import FEWEST
from hairkit.io.video import SUFFIXES
from hairkit.types.face import SURE_PRESENCE, Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

from .appearance import (
    Outline,
    compare_outlines,
    measure_clothes,
    measure_oddness,
    measure_skin,
    trace_outline,
)
from .arrangement import Evidence
from .describe import Found, in_turn_order, name_views, summarise, tell_doubts
from .refuse import check_one_person, check_turn, contradicting, find_copies, photo_name
from .search import differs, find_arrangements, margin_of, moved

ABOVE_DEG = 35.0
"""Photos from higher than this are no part of the ring."""
USUAL_ABOVE_DEG = 55.0
"""Elevation of a photo from above that shows no face: faces are found up to about 40 degrees."""
PITCH_SPREAD, PITCH_BIAS, RING_SPREAD, STRAY_SPREAD = 5.0, 4.0, 6.0, 3.0
"""Standard deviations in degrees: of a face's pitch, of what all pitches of one head have in
common, of rings of photos from level, of photos from their ring."""
LEAST_WIDTH = 0.05
"""Least width of a head, as a share of its photo's: what is narrower is a speck of a mask."""
NAMED_SPREAD = 1.0
"""Standard deviation of azimuths that the user names, degrees."""
FACE_VOTES = 3.0
"""Votes of a face; the edge of a picture where the person stands has one. Of 152 masks the edge
was right in 148, of 31 faces all."""
CLEAR = 2.0
"""The person covers the bottom edge at least this many times as far as any other."""
TURNS_TO_BOTTOM = np.array([0, 1, 2, 3])
"""Clockwise quarter turns that bring the bottom, right, top and left edge to the bottom."""


@hookimpl
def find_turn(capture: Capture, faces: tuple[Face, ...], persons: tuple[Person, ...]) -> Turnaround:
    """Return the arrangement that the photos fit best; `InputError` for what is no turn."""
    sizes = [(view.width, view.height) for view in capture.views]
    turns = find_quarter_turns(sizes, faces, persons)
    views = tuple(
        replace(view, face=face, person=person).turned(int(count))
        for view, face, person, count in zip(capture.views, faces, persons, turns, strict=True)
    )
    outlines = [_traced(view) for view in views]
    twins = find_copies(views, outlines)
    canonical = np.arange(len(views)) if _is_video(capture) else order_by_content(views)
    ordered = [views[i] for i in canonical]
    found = _find(ordered, [outlines[i] for i in canonical], _is_video(capture))
    order = in_turn_order(found)
    names = name_views(ordered, found, order)
    order, back = canonical[order], np.argsort(canonical)
    found, names = found.take(back), tuple(names[i] for i in back)
    summary = summarise(views, found, names, turns, twins)
    azimuth, elevation = found.azimuth_deg, found.elevation_deg
    doubts = tell_doubts(views, found)
    return Turnaround(order, azimuth, elevation, turns, names, found.margin, summary, doubts)


def _is_video(capture: Capture) -> bool:
    """Return whether the views are frames of one video, in the order of time."""
    return capture.source is not None and capture.source.suffix.lower() in SUFFIXES


def order_by_content(views: Sequence[View]) -> Int64Array:
    """Return the photos (V,) in an order in which neither their names nor their order has a part.

    Sums of floating-point numbers depend on the order, and so do ties.
    """
    digests = [hashlib.sha256(view.image.tobytes()).digest() for view in views]
    return np.array(sorted(range(len(views)), key=lambda i: digests[i]), np.int64)


def _find(views: Sequence[View], outlines: Sequence[Outline | None], in_time: bool) -> Found:
    """Return from where the photos were taken: as their names say, if no face contradicts them."""
    faces = [view.face or Face.absent() for view in views]
    azimuth = np.array([view.azimuth_deg for view in views])
    elevation = np.array([view.elevation_deg for view in views])
    named = np.array([view.named for view in views])
    none = np.zeros_like(named)
    read = Found(azimuth, elevation, elevation > ABOVE_DEG, np.inf, named, none, none)
    yaw = Evidence.of(faces).yaw_deg
    if not np.isfinite(yaw).any():
        unchecked = "no face was found, nobody checked the order of the photos"
        return read if named.all() else replace(read, margin=1.0, note=unchecked)
    wrong = contradicting(yaw, np.where(named, azimuth, yaw))
    if wrong is None and named.all():
        return read
    if wrong is not None:
        named = np.zeros_like(named)
    found = _arrange(views, _gather_evidence(views, outlines), named, in_time)
    if wrong is not None:
        note = (
            f"{photo_name(views[wrong])} is no view {views[wrong].name!r}, its face is turned by"
            f" {yaw[wrong]:.0f} degrees: the faces are believed, not the names"
        )
        found = replace(found, note=note)
    return found


def _arrange(views: Sequence[View], seen: Evidence, named: BoolArray, in_time: bool) -> Found:
    """Return the best arrangement; views in `named` (V,) stay as they are said to be."""
    azimuth = np.array([view.azimuth_deg for view in views])
    evidence = replace(
        seen,
        yaw_deg=np.where(named, azimuth, seen.yaw_deg),
        spread_deg=np.where(named, NAMED_SPREAD, seen.spread_deg),
        in_time=in_time,
    )
    elevation = np.array([view.elevation_deg for view in views])
    pitch = np.array([v.face.pitch_deg if v.face and v.face.sure else np.nan for v in views])
    pitch = np.where(named, elevation, pitch)
    known = np.isfinite(pitch)
    placed = find_arrangements(evidence, known & (pitch > ABOVE_DEG), known, named)
    best = placed[0]
    check_turn(views, best, seen.yaw_deg, seen.skin)
    found = np.where(best.above, USUAL_ABOVE_DEG, _ring_elevations(pitch, best.above))
    found = np.where(named | (best.above & known), pitch, found)
    azimuth = np.where(named, azimuth, best.azimuth_deg)
    other = next((other for other in placed[1:] if differs(other, best)), best)
    guessed = best.above & ~known
    return Found(azimuth, found, best.above, margin_of(placed), named, guessed, moved(best, other))


def _traced(view: View) -> Outline | None:
    """Return the outline of the person in a photo, None where nobody, or next to nothing, is."""
    if view.person is None or not view.person.alpha.size:
        return None
    outline = trace_outline(view.person.alpha)
    return outline if outline and outline.width_px > LEAST_WIDTH * view.width else None


def _gather_evidence(views: Sequence[View], outlines: Sequence[Outline | None]) -> Evidence:
    """Return what the photos show of their places; those without an outline only by faces."""
    faces = [view.face or Face.absent() for view in views]
    rows = [i for i, outline in enumerate(outlines) if outline is not None]
    known = [outline for outline in outlines if outline is not None]
    if len(known) < FEWEST:
        return Evidence.of(faces)
    photos = [views[i].image for i in rows]
    check_one_person([views[i] for i in rows], measure_clothes(photos, known))
    alike, mirrored = compare_outlines(known)
    odd = measure_oddness(known, alike, mirrored)
    skin = measure_skin(photos, known, [faces[i] for i in rows])
    count, pairs = len(views), np.ix_(rows, rows)
    return Evidence.of(
        faces,
        (_spread(alike, (count, count), pairs), _spread(mirrored, (count, count), pairs)),
        None if skin is None else _spread(skin, (count, skin.shape[1]), rows),
        np.nan_to_num(_spread(odd, (count,), rows)),
    )


def _spread(values: Float64Array, shape: tuple[int, ...], where: Any) -> Float64Array:
    """Return an array of a shape that holds values at some places, NaN elsewhere."""
    full = np.full(shape, np.nan)
    full[where] = values
    return full


def _ring_elevations(pitch: Float64Array, above: BoolArray) -> Float64Array:
    """Return elevations (V,) by the pitches of faces (NaN without): the ring's and each one's own.

    The mean of normal distributions given their sum with the noise of `PITCH_SPREAD`.
    """
    seen = np.isfinite(pitch) & ~above
    if not seen.any():
        return np.zeros(len(pitch))
    noise = PITCH_SPREAD**2 + STRAY_SPREAD**2
    mean = pitch[seen].mean()
    ring = mean * RING_SPREAD**2 / (RING_SPREAD**2 + PITCH_BIAS**2 + noise / seen.sum())
    own = np.where(seen, np.nan_to_num(pitch) - mean, 0.0) * STRAY_SPREAD**2 / noise
    return np.asarray(ring + own, np.float64)


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
