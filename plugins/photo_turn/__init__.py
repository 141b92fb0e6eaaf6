"""The turn found from faces, outlines and skin; the order of the photos is only a hint.

Faces tell the azimuths of frontal photos. Both directions, every start, uneven steps, and, where
the order of the files does not fit, other orders are scored (`.arrangement`): faces must lie where
their yaw says, outlines of opposite views mirror each other and those of neighbours are alike, and
the share of skin falls from the face to the back. A photo without which the rest is a better turn
is one from above. What is no turn around one head is refused in one line.

* `appearance`: outlines, skin, copies
* `arrangement`: rings of photos and their cost
* `describe`: order and names of views, and the summary
* `refuse`: what is no turn
* `search`: the cheapest arrangement
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hairkit import Capture, View, hookimpl
from hairkit.arrays import BoolArray, Float64Array
from hairkit.imaging.person_outline import Outline, trace_outline
from hairkit.io.photos import focal_from_equivalent
from hairkit.types.face import Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

from .appearance import compare_outlines, measure_clothes, measure_skin
from .arrangement import Evidence
from .describe import Found, in_turn_order, name_views, summarise
from .refuse import check_one_person, check_turn, contradicting, find_copies, photo_name
from .search import find_arrangements, margin_of

ABOVE_DEG = 35.0
"""Photos from higher than this are no part of the ring."""
USUAL_ABOVE_DEG = 55.0
"""Elevation of a photo from above that shows no face: faces are found up to about 40 degrees."""
PITCH_SPREAD, PITCH_BIAS, RING_SPREAD, STRAY_SPREAD = 5.0, 4.0, 6.0, 3.0
"""Standard deviations in degrees: of a face's pitch, of what all pitches of one head have in
common, of rings of photos from level, of photos from their ring."""


USUAL_LENS_MM = 26.0
"""35 mm equivalent of a phone's main lens, where the focal length is unknown."""


@hookimpl
def find_turn(capture: Capture, faces: tuple[Face, ...], persons: tuple[Person, ...]) -> Turnaround:
    """Return the arrangement that the photos fit best; `InputError` for what is no turn."""
    seen = zip(capture.views, faces, persons, strict=True)
    views = tuple(replace(view, face=face, person=person) for view, face, person in seen)
    twins = find_copies(views)
    found = _find(views)
    order = in_turn_order(found)
    names = name_views(views, found, order)
    summary = summarise(views, found, names, twins)
    azimuth, elevation = found.azimuth_deg, found.elevation_deg
    return Turnaround(order, azimuth, elevation, names, found.margin, summary)


def _find(views: Sequence[View]) -> Found:
    """Return from where the photos were taken: as their names say, if no face contradicts them."""
    faces = [view.face or Face.absent() for view in views]
    azimuth = np.array([view.azimuth_deg for view in views])
    elevation = np.array([view.elevation_deg for view in views])
    named = np.array([view.named for view in views])
    read = Found(azimuth, elevation, elevation > ABOVE_DEG, np.inf, named)
    yaw = Evidence.of(faces, None, None).yaw_deg
    if not np.isfinite(yaw).any():
        unchecked = "no face was found, nobody checked the order of the photos"
        return read if named.all() else replace(read, note=unchecked)
    wrong = contradicting(yaw, np.where(named, azimuth, yaw))
    if wrong is None and named.all():
        return read
    if wrong is not None:
        named = np.zeros_like(named)
    found = _arrange(views, faces, named)
    if wrong is not None:
        note = (
            f"{photo_name(views[wrong])} is no view {views[wrong].name!r}, its face is turned by"
            f" {yaw[wrong]:.0f} degrees: the faces are believed, not the names"
        )
        found = replace(found, note=note)
    return found


def _arrange(views: Sequence[View], faces: Sequence[Face], named: BoolArray) -> Found:
    """Return the best arrangement; views in `named` (V,) stay as they are said to be."""
    outlines = _trace_outlines(views)
    skin, distances = None, None
    if outlines is not None:
        photos = [view.image for view in views]
        check_one_person(views, measure_clothes(photos, outlines))
        skin = measure_skin(photos, outlines, faces)
        distances = compare_outlines(outlines)
    seen = Evidence.of(faces, distances, skin)
    azimuth = np.array([view.azimuth_deg for view in views])
    evidence = replace(seen, yaw_deg=np.where(named, azimuth, seen.yaw_deg))
    elevation = np.array([view.elevation_deg for view in views])
    pitch = np.array([face.pitch_deg if face.sure else np.nan for face in faces])
    pitch = np.where(named, elevation, pitch)
    known = np.isfinite(pitch)
    placed = find_arrangements(evidence, known & (pitch > ABOVE_DEG), known)
    best = placed[0]
    check_turn(views, best, seen.yaw_deg, skin)
    found = np.where(
        best.above, USUAL_ABOVE_DEG, _ring_elevations(pitch, best.above, _level(views))
    )
    found = np.where(named | (best.above & known), pitch, found)
    note = "" if best.in_order else "the photos are not in the order of their names"
    azimuth = np.where(named, azimuth, best.azimuth_deg)
    return Found(azimuth, found, best.above, margin_of(placed), named, note)


def _trace_outlines(views: Sequence[View]) -> list[Outline] | None:
    """Return the outlines of the persons, None when some photo shows none."""
    outlines = []
    for view in views:
        known = view.person is not None and view.person.alpha.size > 0
        outline = trace_outline(view.person.alpha) if view.person and known else None
        if outline is None:
            return None
        outlines.append(outline)
    return outlines


def _level(views: Sequence[View]) -> Float64Array:
    """Return from what elevations (V,) level cameras see heads beside their axes."""
    usual = [focal_from_equivalent(USUAL_LENS_MM, *view.photo_size) / view.scale for view in views]
    focal = [view.focal_px or lens for view, lens in zip(views, usual, strict=True)]
    down = [view.aim[1] - view.centre[1] for view in views]
    return np.asarray(np.degrees(np.arctan2(down, focal)), np.float64)


def _ring_elevations(pitch: Float64Array, above: BoolArray, level: Float64Array) -> Float64Array:
    """Return elevations (V,) by the pitches of faces (NaN without): the ring's and each one's own.

    The mean of normal distributions given their sum with the noise of `PITCH_SPREAD`; `level` (V,)
    are the elevations if all cameras are level.
    """
    seen = np.isfinite(pitch) & ~above
    if not seen.any():
        return level
    noise = PITCH_SPREAD**2 + STRAY_SPREAD**2
    pitch = pitch - level
    mean = pitch[seen].mean()
    ring = mean * RING_SPREAD**2 / (RING_SPREAD**2 + PITCH_BIAS**2 + noise / seen.sum())
    own = np.where(seen, np.nan_to_num(pitch) - mean, 0.0) * STRAY_SPREAD**2 / noise
    return np.asarray(level + ring + own, np.float64)
