"""Health of a run: figures that are computed from its results alone and tell whether to trust it.

Every figure has a light: green as on good captures, red as on spoiled ones, amber between them. No
ground truth is needed. `benchmarks/health.py` prints the figures of captures as they are and
of the same captures spoiled in known ways; the limits below were chosen from its table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.cameras.depth_raster import HEAD_TOLERANCE, SPLAT_CELLS, head_depth, point_depth
from hairkit.cameras.landmark_equations import steepness
from hairkit.field.cell_shells import dense_surface
from hairkit.field.growth_prior import PARTED_HAIR
from hairkit.pipeline.drawn_hair import (
    PhotoHair,
    compare_drawing,
    share_of,
    share_oriented,
    with_pieces,
)
from hairkit.pipeline.figure import AMBER, GREEN, RED, Figure, Limits
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.evidence import Evidence
from hairkit.types.groom import Groom
from hairkit.types.head import EYES, JAW_LANDMARKS, Head
from hairkit.types.mask import HAIR, PERSON, Mask
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.strands import SEEN, Strands
from hairkit.types.tie import TiedHair
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import Hull

RASTER_HEIGHT = 240
"""Height in pixels at which hull and masks are compared; a cell of the hull is a pixel or more."""
FACE = [*range(2, 15), *range(28, 68)]
"""The iBUG points of cheeks, jaw, nose, eyes and mouth; their convex hull bears no hair of the
head. Brows and temples lie under fringes."""
FACING_DEG = 60.0
"""Views farther from the front, degrees of azimuth, show too little of the face to judge it."""
MARGIN = Limits(1.25, 1.001, "turn", "margin over the next best")
"""Of 241 turns and parts above the first 10 were wrong, of 46 below 1.1 20; two good captures are
between 1.01 and 1.1, so that only a tie is red."""
GAP_DEG = Limits(100.0, 160.0, "turn", "largest step", "deg", 0)
"""Largest step of a turn: what no photo shows is guessed."""
LANDMARK_VIEWS = Limits(2, 0, "landmarks", "views used", digits=0)
"""Views whose landmarks are known. Without any the head's size is a guess: on the captures it came
out 1.17 to 1.59 times too large."""
LANDMARK_MM = Limits(3.0, 5.5, "cameras", "landmarks off by", "mm", 1)
"""At most 1.4 mm on six captures as they are, 2.3 with landmarks found by `face_mesh`; 2.4 to 11
with moved masks, 8 to 32 with wrong azimuths, 10 to 27 when shuffled."""
OUTLINE_MM = Limits(1.8, 3.0, "cameras", "outlines off by", "mm", 1)
"""At most 0.9 mm on captures as they are, 1.6 with masks made without help, 2.6 where an afro or a
real turn has no sharp outline; 1.3 to 4 with two heads, 8 and more when shuffled."""
PUPIL_MM = Limits(7.5, 13.0, "head", "distance of the pupils", "mm", 1)
"""Off the mean distance of adult pupils: 95 % of adults lie within the first (Dodgson 2004), few
beyond the second; the captures as they are came out 57 to 65 mm apart, shuffled ones below 46."""
ADULT_PUPILS_MM = 63.4
"""Mean distance of the pupils of adults (Dodgson 2004)."""
COVERED = Limits(0.9, 0.8, "masks", "hair that all views agree on, worst view")
"""At least 0.91 on captures as they are; at most 0.86 when shuffled, 0.89 with two heads."""
AGREEMENT = Limits(0.75, 0.68, "hull", "overlap with the masks")
"""At least 0.82 on captures as they are, 0.77 on photos alone; at most 0.62 when
shuffled, 0.65 with wrong azimuths."""
BARE_FACE = Limits(0.1, 0.2, "masks", "face called hair")
"""At most 0.08 with the true masks of 17 turns, where hair hangs before the face; 0.46 with a beard
in the masks, 0.3 to 1 with the face."""
GROWN = Limits(0.98, 0.9, "strands", "roots grown")
"""1.00 on all captures; a warning is logged below the first."""
LENGTH = Limits(0.3, 0.15)
"""Mean length over the longest way through the hair: at least 0.87 on captures as they are; 0.08
to 0.25 on most that were shuffled."""
PARTING_MM = Limits(25.0, 50.0, "parting", "width of the skin", "mm", 0)
"""Width of the middle half of the skin that shows on the crown: 6 to 25 mm around partings, 90 mm
where a bare hairline is all that shows; evenly spread skin is 66 mm wide."""
CROWN = Limits(0.2, 0.0, "parting", "sureness")
"""How well the views' directions agree with the way the crown is combed: 0.25 to 0.92 on drawn
heads."""
TIE = Limits(0.4, 0.0)
"""The weakest sign of a tie, see `hairkit.field.find_ties`: 0.6 at a ponytail."""
ORIENTED = Limits(0.27, 0.2, "orient", "angles as photographed")
"""At least 0.72 with `structure_tensor` on ten captures, 0.30 with `gabor`; 0.22 of directions at
random, below 0.1 where they are wrong. Without confidence 0."""
DIRECTIONS = Limits(0.7, 0.5, "strands", "directions as photographed")
"""0.88 to 0.97 on six captures of straight hair, photos alone, 0.76 on short hair; at most 0.44
with strands turned by 45 degrees, 0.32 with curls, 0.23 where coils came out straight."""
LEAST_JUDGED = 0.1
"""Share of the visible hair whose direction must be known."""
COHERENCE = Limits(0.28, 0.34, "strands", "direction of curly hair")
"""Of photos of hair that came out in steep curls: 0.14 on coils, 0.35 to 0.55 on straight hair."""
ASTRAY = Limits(0.08, 0.15, "strands", "drawn where no photo has hair")
"""At most 0.07 on captures as they are; 0.11 to 0.54 with turned strands, but on short hair."""
BARE_HAIR = Limits(0.09, 0.18, "strands", "hair left bare")
"""At most 0.05 on captures of hair without coils, photos alone, 0.08 with true masks, which have
wisps; 0.24 and more with strands of 0.6 of their length."""
CURL_MM = Limits(15.0, 30.0, "strands", "radius of the curls", "mm", 1)
"""Radius of the curls: 7 mm on the tightest of the captures; locks of wider curls are bends."""


def assess(
    capture: Capture, evidence: Evidence, groom: Groom, roots: int, turn: Turnaround | None = None
) -> tuple[Figure, ...]:
    """Return the figures of a run, in the order of its stages.

    Parameters
    ----------
    capture
        The views, in the order of the turn.
    evidence, groom
        Results of the stages. How the crown is combed counts for nothing in short hair and in hair
        that is combed to a tie.
    roots
        Number of roots that strands were to grow from.
    turn
        How the photos were arranged; None when their names were believed.
    """
    scene = replace(evidence.scene, names=tuple(_label(view) for view in capture.views))
    evidence = replace(evidence, scene=scene)  # notes speak of the user's own files
    masks, hull = evidence.masks, evidence.hull
    shown = [PhotoHair.of(v.image, mask) for v, mask in zip(capture.views, masks, strict=True)]
    hair_length = evidence.scalp_distance.hair_length
    level = hair_length < PARTED_HAIR or evidence.tied.tails or evidence.waves.coiled
    return (
        *assess_turn(None if scene.one_sided else turn),
        *assess_landmarks(capture, scene),
        *assess_cameras(scene),
        *assess_masks(masks, scene),
        *assess_hull(hull, masks, scene),
        *assess_orientations(shown, evidence),
        *(() if level else assess_parting(evidence.parting)),
        *assess_ties(evidence.tied, scene.head),
        *(assess_seen(groom.strands) if scene.one_sided else ()),
        *assess_strands(groom, roots, hair_length),
        *assess_drawing(shown, scene, groom, evidence.waves.slant),
    )


def summarise(figures: Sequence[Figure]) -> list[str]:
    """Return a line that counts the lights, and the lines of the figures that are not green.

    >>> summarise([Figure("strands", "roots grown", 0.5, "", "red"),
    ...            Figure("landmarks", "views used", 3, "", "green", digits=0)])
    ['health: 1 green, 0 amber, 1 red', 'red    strands: roots grown 0.50']
    """
    lights = [figure.light for figure in figures]
    counts = ", ".join(f"{lights.count(light)} {light}" for light in (GREEN, AMBER, RED))
    doubtful = [f.line() for light in (AMBER, RED) for f in figures if f.light == light]
    return [f"health: {counts}", *doubtful]


def assess_turn(turn: Turnaround | None) -> tuple[Figure, ...]:
    """Return by how much the turn fits better than the next best, its largest step, its doubts."""
    if turn is None:
        return ()
    gap, margin, count = turn.largest_step_deg, turn.margin, len(turn.doubts)
    step = GAP_DEG.figure(gap, "take photos from there, too")
    if not np.isfinite(margin):
        return (step,)
    light = AMBER if turn.doubts else GREEN
    return (
        MARGIN.figure(margin, "name the photos"),
        step,
        Figure("turn", "doubts", count, "", light, "; ".join(turn.doubts), 0),
    )


def assess_landmarks(capture: Capture, scene: Scene) -> tuple[Figure, ...]:
    """Return how many views have landmarks, their misfit and the distance of the pupils."""
    known = [
        (v, c) for v, c in zip(capture.views, scene.cameras, strict=True) if v.landmarks is not None
    ]
    count = len(known)
    note = "no face was found, the head's size is a guess; try `hairkit models`, or landmarks.json"
    light = GREEN if count == len(capture.views) else ""
    figures = [LANDMARK_VIEWS.figure(count, note, light)]
    corners = scene.head.landmark_vertices
    if corners is None:
        return tuple(figures)
    points = scene.head.vertices[corners].astype(np.float64)
    steep = steepness([view for view, _ in known])
    known = [each for each, far in zip(known, steep, strict=True) if far == 0]
    gaps = [_misfit_mm(camera, points, view.landmarks) for view, camera in known]
    if gaps and count > 1:  # to those of one view the head is bent
        worst = known[int(np.argmax(gaps))][0]
        figures.append(LANDMARK_MM.figure(max(gaps), f"look at {_label(worst)}"))
    pupils = 1000 * float(np.linalg.norm(np.subtract(*(points[e].mean(axis=0) for e in EYES))))
    light = PUPIL_MM.light(abs(pupils - ADULT_PUPILS_MM))
    note = "not an adult's: lengths in metres are off by as much"
    return (*figures, PUPIL_MM.figure(pupils, note, light))


def assess_cameras(scene: Scene) -> tuple[Figure, ...]:
    """Return the misfit of the outlines, in millimetres at the head and in pixels."""
    if scene.residual_px is None:
        return ()
    off = 1000 * scene.residual_px / np.mean([c.pixels_per_metre for c in scene.cameras]).item()
    note = f"{scene.residual_px:.1f} px; are all photos of one head, in the order of the turn?"
    return (OUTLINE_MM.figure(off, note),)


def assess_masks(masks: Sequence[Mask], scene: Scene) -> tuple[Figure, ...]:
    """Return the share of the face below the brows called hair, of the middle frontal view: seen
    from aside, a third of a face may be behind its hair."""
    corners = scene.head.landmark_vertices
    if corners is None:
        return ()
    points = scene.head.vertices[corners[FACE]]
    shares = {
        name: _hairy_share(mask, camera, points)
        for name, camera, mask in zip(scene.names, scene.cameras, masks, strict=True)
        if abs(camera.azimuth_deg) < FACING_DEG
    }
    if not shares:
        return ()
    name, share = sorted(shares.items(), key=lambda item: item[1])[len(shares) // 2]
    note = f"glasses, beard or skin became hair; look at the mask of {name}"
    return (BARE_FACE.figure(share, note),)


def assess_hull(hull: Hull, masks: Sequence[Mask], scene: Scene) -> tuple[Figure, ...]:
    """Return how well the hull of all views explains the hair of each: the mean and the worst."""
    cells = dense_surface(hull), SPLAT_CELLS * hull.grid.spacing
    views = [
        compare_hull(*cells, mask, camera, scene)
        for mask, camera in zip(masks, scene.cameras, strict=True)
    ]
    inside, overlap = (dict(zip(scene.names, part, strict=True)) for part in np.transpose(views))
    worst = min(inside, key=lambda name: inside[name])
    apart = min(overlap, key=lambda name: overlap[name])
    mean = float(np.mean(list(overlap.values())))
    note = f"the mask of {worst} and those of the other views contradict each other"
    return COVERED.figure(inside[worst], note), AGREEMENT.figure(mean, f"look at {apart}")


def compare_hull(
    surface: Float32Array, radius: float, mask: Mask, camera: Camera, scene: Scene
) -> tuple[float, float]:
    """Return two shares of one view, of the hull drawn into it: its surface as discs.

    Returns
    -------
    inside
        Share of the mask's hair that the hull covers: what the other views leave of it.
    overlap
        Intersection over union of the mask and of the hull that no head hides. Where the person
        stands but no head, clothes may hide the hull; those pixels are left out.
    """
    size = round(RASTER_HEIGHT * camera.width / camera.height), RASTER_HEIGHT
    small = camera.resized(*size)
    labels = np.asarray(cv2.resize(mask.labels, size, interpolation=cv2.INTER_NEAREST))
    depth = point_depth(small, surface, radius)
    head = head_depth(scene.head, small) + np.float32(HEAD_TOLERANCE)
    drawn, hair = np.isfinite(depth), labels == HAIR
    shown = drawn & (depth < head) & ~((labels == PERSON) & np.isinf(head))
    overlap = int((shown & hair).sum()) / max(int((shown | hair).sum()), 1)
    return share_of((drawn & hair).sum(), hair.sum()), overlap


def assess_orientations(shown: Sequence[PhotoHair], evidence: Evidence) -> tuple[Figure, ...]:
    """Return the share of the hair whose 2D orientations are those of the photos."""
    shares = [share_oriented(*row) for row in zip(evidence.orientations, shown, strict=True)]
    share, name = float(np.mean(shares)), _worst(evidence.scene.names, shares)
    note = f"its plugin does not see the strands of the photos, least of all in {name}"
    return (ORIENTED.figure(share, note),)


def assess_parting(parting: Parting) -> tuple[Figure, ...]:
    """Return how sure it is how the crown is combed, and how wide the skin is that shows it.

    Nothing where the user says it.
    """
    note = "add a photo from above, draw a stroke `parting` or give --parting"
    figures = []
    if parting.sureness < 1:
        figures.append(CROWN.figure(parting.sureness, note))
    if parting.spread and parting.places is None:  # directions tell more than such skin
        figures.append(PARTING_MM.figure(1000 * parting.spread, note))
    return tuple(figures)


def assess_ties(tied: TiedHair, head: Head) -> tuple[Figure, ...]:
    """Return where each tie is and how sure it is; nothing of loose hair."""
    note = "hull and directions show a tie weakly; look for it on the contact sheet"
    return tuple(
        Figure(
            "ties", f"{tail.tie.place(head)}, sureness", tail.sureness, "",
            TIE.light(tail.sureness), note,
        )
        for tail in tied.tails
    )  # fmt: skip


def assess_seen(strands: Strands) -> tuple[Figure, ...]:
    """Return the share of the strands that a photo shows, of photos of one side."""
    share = float(np.mean(strands.group == SEEN))
    note = "group 1 is made up from the outline and what is seen; add photos of the other sides"
    return (Figure("strands", "seen in a photo", share, "", AMBER, note),)


def assess_strands(groom: Groom, roots: int, hair_length: float) -> tuple[Figure, ...]:
    """Return the share of roots that grew, the strands' length and the radius of their curls."""
    strands, radius = groom.strands, 1000 * groom.material.curl_radius
    grown, length = len(strands) / roots, float(strands.lengths().mean())
    whole = LENGTH.light(length / max(hair_length, 1e-9))
    return (
        GROWN.figure(grown, "do masks leave out hair?"),
        Figure("strands", "mean length", 100 * length, "cm", whole, "they end within the hair", 1),
        CURL_MM.figure(radius, "wider than locks of hair are; is the head's size right?"),
    )


def assess_drawing(
    shown: Sequence[PhotoHair], scene: Scene, groom: Groom, slant: float
) -> tuple[Figure, ...]:
    """Return how the drawn guides agree with the photos: directions, where hair is, and curls.

    Directions of steep curls are not judged, for their coils are not where those of the photos are:
    but where all turn one way, as a slant says, photos show their axes. Those of hair so short or
    so small in the photos that hardly any lies away from its edges are not, either.
    """
    names, groom = scene.names, with_pieces(groom)
    views = [compare_drawing(groom, *row) for row in zip(scene.cameras, shown, strict=True)]
    steep = groom.material.curl_radius * 2 * np.pi > groom.material.curl_pitch
    length, judged = sum(v.shown for v in views), sum(v.judged for v in views)
    if not steep or slant:
        shares = [share_of(view.right, view.judged) for view in views]
        share = share_of(sum(v.right for v in views), judged)
        note = f"the hair lies otherwise than in the photos, most of all in {_worst(names, shares)}"
        figures = [DIRECTIONS.figure(share, note)] if judged > LEAST_JUDGED * length else []
    else:
        clear = float(np.mean([view.coherence for view in views]))
        note = "the photos show strands that run side by side; set curl_radius_mm = 0 in [hair]"
        figures = [COHERENCE.figure(clear, note)]
    astray = [view.astray / max(view.shown, 1.0) for view in views]
    share = sum(v.astray for v in views) / max(length, 1.0)
    note = f"most of all in {_worst(names, [-each for each in astray])}"
    figures.append(ASTRAY.figure(share, note))
    left = [view.bare / max(view.standing, 1) for view in views]
    bare = sum(v.bare for v in views)
    share = bare / max(sum(v.standing for v in views), bare, 1)
    note = f"strands are too short, most of all in {_worst(names, [-each for each in left])}"
    return (*figures, BARE_HAIR.figure(share, note))


def _worst(names: Sequence[str], values: Sequence[float]) -> str:
    """Return the view with the least value."""
    return names[int(np.argmin(values))]


def _label(view: View) -> str:
    """Return how the user calls a photo, after what it shows."""
    return view.name if view.photo_path is None else f"{view.name} ({view.photo_path.name})"


def _misfit_mm(camera: Camera, points: Float64Array, seen: Float64Array | None) -> float:
    """Return the root mean square distance of the inner landmarks from those seen, at the head."""
    assert seen is not None
    gap = (camera.project(points) - seen)[JAW_LANDMARKS:]
    return 1000 * float(np.sqrt((gap**2).sum(axis=1).mean())) / camera.pixels_per_metre


def _hairy_share(mask: Mask, camera: Camera, points: Float32Array) -> float:
    """Return the share of the convex hull of points (N, 3) in the picture that is hair."""
    corners, inside = camera.project(points), np.zeros(mask.labels.shape, np.uint8)
    cv2.fillConvexPoly(inside, cv2.convexHull(np.rint(corners).astype(np.int32)), 1)
    return share_of((mask.hair & (inside > 0)).sum(), inside.sum())
