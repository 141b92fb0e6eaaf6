"""The turn found from faces, outlines and skin; order and names of the files do not matter.

Faces tell the azimuths of frontal photos. All other photos may be anywhere around the head, and
what fits best is searched for (`.search`): faces lie where their yaw says, outlines of opposite
views mirror each other, neighbours look alike, the share of skin falls from the face to the back,
and steps are even rather than not. A photo without which the rest is a better turn is one
from above. Where several arrangements fit nearly alike, all are handed on: their cameras tell.
Frames of a video are in the order of time. What is no turn around one head is refused in one line.
One or two photos, and more of which none shows the back, are no turn: their azimuths are those of
their faces, and photos without a face are from the side on which they show the skin.

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
from hairkit.arrays import BoolArray, Float64Array, Int64Array
from hairkit.errors import InputError
from hairkit.imaging.hair_network import silhouette
from hairkit.imaging.person_outline import Outline, trace_outline
from hairkit.io.video import SUFFIXES
from hairkit.types.face import Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

from .appearance import (
    compare_heads,
    compare_outlines,
    measure_clothes,
    measure_oddness,
    measure_skin,
)
from .arrangement import SIDE_DEG, Evidence
from .describe import Found, in_turn_order, name_views, summarise, tell_doubts
from .refuse import (
    SIDE_ONLY_DEG,
    NoBackError,
    check_one_person,
    check_turn,
    contradicting,
    find_copies,
)
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
LEAST_WIDTH = 0.05
"""Least width of a head, as a share of its photo's: what is narrower is a speck of a mask."""
CERTAIN = 1.5
"""Margin from which no other arrangement is handed on. Of 241 turns and parts of turns with a
margin above 1.25 ten were wrong before cameras were asked, of 101 with a smaller one 34."""
MOST_HANDED_ON = 12
"""Arrangements that are handed on."""
WHOLE_TURN = 3
"""Photos that can go around a head; fewer are no turn."""
FEW, PROFILE_MOMENT = 4, 0.055
"""Photos at most of which none need be from behind, and the sideways moment of skin from which one
without a face is a profile, over the largest share with one: of eight rendered captures profiles
have 0.07 to 0.17, and photos from behind 0.04 at most, but tied hair from aside 0.07."""
CLOSE = 7
"""Photos from which neighbours are near enough to look alike: of 6 of a turn of eight, with gaps,
more turns would be sure and wrong."""
IN_ORDER = 4.0
"""Logarithm of the odds that photos are given in the order of the turn, over any other order of as
good evidence: most are, and a turn of eight has 2,520 orders."""
NAMED_SPREAD = 1.0
"""Standard deviation of azimuths that the user names, degrees."""


@hookimpl
def find_turn(capture: Capture, faces: tuple[Face, ...], persons: tuple[Person, ...]) -> Turnaround:
    """Return the arrangement that the photos fit best; `InputError` for what is no turn."""
    seen = zip(capture.views, faces, persons, strict=True)
    views = tuple(view.with_findings(face, person) for view, face, person in seen)
    outlines = [_traced(view) for view in views]
    twins = find_copies(views, outlines)
    canonical = np.arange(len(views)) if _is_video(capture) else order_by_content(views)
    ordered = [views[i] for i in canonical]
    follow = np.inf if _is_video(capture) else IN_ORDER
    arrangements = _find(ordered, [outlines[i] for i in canonical], canonical, follow)
    best, *others = (_tell(views, found, canonical, twins) for found in arrangements)
    return replace(best, others=tuple(others))


def _tell(
    views: Sequence[View], found: Found, canonical: Int64Array, twins: Sequence[tuple[int, int]]
) -> Turnaround:
    """Return an arrangement of views in canonical order as one of the views."""
    order = in_turn_order(found)
    names = name_views([views[i] for i in canonical], found, order)
    order, back = canonical[order], np.argsort(canonical)
    found, names = found.take(back), tuple(names[i] for i in back)
    summary, doubts = summarise(views, found, names, twins), tell_doubts(views, found)
    azimuth, elevation = found.azimuth_deg, found.elevation_deg
    return Turnaround(order, azimuth, elevation, names, found.margin, summary, doubts)


def _is_video(capture: Capture) -> bool:
    """Return whether the views are frames of one video, in the order of time."""
    return capture.source is not None and capture.source.suffix.lower() in SUFFIXES


def order_by_content(views: Sequence[View]) -> Int64Array:
    """Return the photos (V,) in an order in which neither their names nor their order has a part.

    Sums of floating-point numbers depend on the order, and so do ties.
    """
    digests = [hashlib.sha256(view.image.tobytes()).digest() for view in views]
    return np.array(sorted(range(len(views)), key=lambda i: digests[i]), np.int64)


def _find(
    views: Sequence[View], outlines: Sequence[Outline | None], sequence: Int64Array, follow: float
) -> list[Found]:
    """Return from where the photos were taken: as their names say, if no face contradicts them.

    `sequence` (V,) is the order in which they were given, `follow` the odds that they were taken
    so. Behind the likeliest arrangement come those that fit nearly as well.
    """
    faces = [view.face or Face.absent() for view in views]
    azimuth = np.array([view.azimuth_deg for view in views])
    elevation = np.array([view.elevation_deg for view in views])
    named = np.array([view.named for view in views])
    none = np.zeros_like(named)
    read = Found(azimuth, elevation, elevation > ABOVE_DEG, np.inf, named, none)
    evidence = Evidence.of(faces)
    yaw = evidence.yaw_deg
    if not (few := _is_part(yaw, named)) and not np.isfinite(yaw).any():
        unchecked = "no face was found, nobody checked the order of the photos"
        return [read if named.all() else replace(read, margin=1.0, note=unchecked)]
    wrong = contradicting(yaw, np.where(named, azimuth, yaw))
    if wrong is None and named.all():
        return [read]
    if wrong is not None:
        named = np.zeros_like(named)
    if few:
        found = [_by_faces(views, evidence, replace(read, named=named))]
    else:
        seen = _gather_evidence(views, outlines)
        try:
            if len(views) <= FEW and _are_profiles(seen):
                raise NoBackError("no photo shows the back of the head")
            seen = replace(seen, sequence=sequence, follow=follow)
            found = _arrange(views, seen, named)
        except NoBackError:
            found = [_by_faces(views, _with_profiles(seen), replace(read, named=named))]
    if wrong is not None:
        note = (
            f"{views[wrong].photo_name} is no view {views[wrong].name!r}, its face is turned by"
            f" {yaw[wrong]:.0f} degrees: the faces are believed, not the names"
        )
        found = [replace(each, note=note) for each in found]
    return found


def _is_part(yaw_deg: Float64Array, named: BoolArray) -> bool:
    """Return whether the photos are too few for a turn, or all are unnamed and show the face."""
    return len(named) < WHOLE_TURN or bool(
        not named.any() and (np.abs(yaw_deg) < SIDE_ONLY_DEG).all()
    )


def _are_profiles(seen: Evidence) -> bool:
    """Return whether photos without a face show skin so far aside that none is from behind.

    Two faces are needed: an even turn of so few photos shows one.
    """
    bare = np.isnan(seen.yaw_deg)
    if seen.skin is None or np.count_nonzero(~bare) < 2:
        return False
    return bool((np.abs(seen.skin[bare, 1]) >= PROFILE_MOMENT * seen.skin[~bare, 0].max()).all())


def _with_profiles(seen: Evidence) -> Evidence:
    """Return the evidence with photos that show no face as profiles, from the skin's side."""
    if seen.skin is None:
        return seen
    bare = np.isnan(seen.yaw_deg) & (seen.side == 0)
    yaw = np.where(bare, -90.0 * np.sign(seen.skin[:, 1]), seen.yaw_deg)
    return replace(seen, yaw_deg=yaw)


def _by_faces(views: Sequence[View], evidence: Evidence, read: Found) -> Found:
    """Return photos where their names or their faces say; `InputError` for one with neither."""
    told = np.where(evidence.side != 0, SIDE_DEG * evidence.side, evidence.yaw_deg)
    azimuth = np.where(read.named, read.azimuth_deg, told)
    if not np.isfinite(azimuth).all():
        photo = views[int(np.isnan(azimuth).argmax())].photo_name
        raise InputError(
            f"{photo}: no face is found, which tells from where a photo was taken;"
            " call the file left, right or back if that is what it shows"
        )
    pitch = np.array([v.face.pitch_deg if v.face and v.face.sure else np.nan for v in views])
    none = np.zeros_like(read.above)
    pitch = np.where(read.named, read.elevation_deg, pitch)
    level = _elevations(pitch, none, read.named, _level(views))
    return replace(read, azimuth_deg=azimuth, elevation_deg=level, above=none)


def _arrange(views: Sequence[View], seen: Evidence, named: BoolArray) -> list[Found]:
    """Return the best arrangements; views in `named` (V,) stay as they are said to be."""
    azimuth = np.array([view.azimuth_deg for view in views])
    evidence = replace(
        seen,
        yaw_deg=np.where(named, azimuth, seen.yaw_deg),
        spread_deg=np.where(named, NAMED_SPREAD, seen.spread_deg),
    )
    elevation = np.array([view.elevation_deg for view in views])
    pitch = np.array([v.face.pitch_deg if v.face and v.face.sure else np.nan for v in views])
    pitch = np.where(named, elevation, pitch)
    known = np.isfinite(pitch)
    placed = find_arrangements(evidence, known & (pitch > ABOVE_DEG), known, named)
    check_turn(views, placed[0], seen.yaw_deg, seen.skin)
    margins = [margin_of(placed), *(margin_of([placed[0], other]) for other in placed[1:])]
    level, handed_on = _level(views), MOST_HANDED_ON if margins[0] < CERTAIN else 1
    return [
        Found(
            np.where(named, azimuth, each.azimuth_deg),
            _elevations(pitch, each.above, named, level),
            each.above,
            margin,
            named,
            each.above & ~known,
        )
        for each, margin in list(zip(placed, margins, strict=True))[:handed_on]
    ]


def _traced(view: View) -> Outline | None:
    """Return the outline of the person in a photo, None where nobody, or next to nothing, is."""
    if view.person is None or not view.person.alpha.size:
        return None
    outline = trace_outline(silhouette(view))
    return outline if outline and outline.width_px > LEAST_WIDTH * view.width else None


def _gather_evidence(views: Sequence[View], outlines: Sequence[Outline | None]) -> Evidence:
    """Return what the photos show of their places; those without an outline only by faces."""
    faces = [view.face or Face.absent() for view in views]
    rows = [i for i, outline in enumerate(outlines) if outline is not None]
    known = [outline for outline in outlines if outline is not None]
    if len(known) < WHOLE_TURN:
        return Evidence.of(faces)
    seen = [views[i] for i in rows]
    check_one_person(seen, measure_clothes(seen, known))
    alike, mirrored = compare_outlines(known)
    odd = measure_oddness(known, alike, mirrored)
    skin = measure_skin(seen, known)
    count, pairs = len(views), np.ix_(rows, rows)
    return Evidence.of(
        faces,
        (_spread(alike, (count, count), pairs), _spread(mirrored, (count, count), pairs)),
        None if skin is None else _spread(skin, (count, skin.shape[1]), rows),
        np.nan_to_num(_spread(odd, (count,), rows)),
        None
        if len(known) < CLOSE
        else _spread(compare_heads([view.image for view in seen], known), (count, count), pairs),
    )


def _spread(values: Float64Array, shape: tuple[int, ...], where: Any) -> Float64Array:
    """Return an array of a shape that holds values at some places, NaN elsewhere."""
    full = np.full(shape, np.nan)
    full[where] = values
    return full


def _level(views: Sequence[View]) -> Float64Array:
    """Return from what elevations (V,) level cameras see heads beside their axes."""
    focal = [view.focal_or(USUAL_LENS_MM) for view in views]
    down = [view.aim[1] - view.centre[1] for view in views]
    return np.asarray(np.degrees(np.arctan2(down, focal)), np.float64)


def _elevations(
    pitch: Float64Array, above: BoolArray, named: BoolArray, level: Float64Array
) -> Float64Array:
    """Return elevations (V,): what names and faces of photos from above say, else the ring's."""
    found = np.where(above, USUAL_ABOVE_DEG, _ring_elevations(pitch, above, level))
    return np.where(named | (above & np.isfinite(pitch)), pitch, found)


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
