"""Find how the crown is combed: as the user says, as skin shows a parting, or as directions tell.

Level views see the crown at a grazing angle, so that the 2D orientation of the strands there tells
little of where a parting is. Skin that shows inside the hair does: its median is the parting; a
photo from above says whether there is one, and counts as much as all level ones. What the user
says counts first: `parting` in capture.toml or on the command line, then a stroke labelled
`parting`. Where no skin shows, and of a fringe, the directions of all views tell
(`hairkit.field.scalp_comb`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.field.growth_prior import growth_potential
from hairkit.field.scalp_comb import comb_beside_parting, comb_scalp, see_front
from hairkit.field.scalp_sight import look_at, see_scalp
from hairkit.io.strokes import read_view_strokes
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.head import Head
from hairkit.types.mask import PERSON, Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.tie import TiedHair
from hairkit.types.volume import Hull, ScalpDistance

CROWN_DEPTH = 0.045
"""Height of the crown below the top of the head, metres."""
SCALP_EDGE = 0.01
"""Skin nearer than this to the edge of the scalp may be the forehead's or the temples', metres."""
LEAST_FACING = 0.15
"""Cosine between a normal and the ray to the camera below which a view does not see the place."""
LEAST_SKIN = 0.004
"""Share of the crown that is skin from which there is a parting; 0.006 to 0.06 on heads that have
one, 0.000 on curls."""
LEAST_SKIN_ABOVE = 0.03
"""The same in photos from above: 0.08 to 0.15 on heads that have a parting, 0.01 on curls."""
SAME_PARTING = 0.015
"""Metres between the parting from above and that of level views up to which these count: twice the
largest difference on the heads of `FROM_ABOVE`."""
QUARTILES = (0.25, 0.5, 0.75)
WIDEST_SKIN = 0.05
"""Distance in metres between the quartiles of the skin's x from which it is no line but a hairline
whose hair is tied back: 9 cm there, at most 3.5 cm on partings, 6.6 cm if spread evenly."""
FROM_ABOVE = 30.0
"""Degrees of elevation from which a view looks down into the parting. On six heads
(docs/benchmarks.md) it alone finds a parting to 3.1 mm, eight level views to 3.3 mm, the mean of
both to 1.5 mm: what limits either is the pose of its own cameras."""


def measure_parting(
    capture: Capture,
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    cameras: Sequence[Camera],
    head: Head,
    tied: TiedHair,
    hull: Hull,
    scalp_distance: ScalpDistance,
) -> Parting:
    """Return the parting that the user gives, or how the views show the crown to be combed.

    Tied hair is combed to its ties, so only skin tells its parting. Masks, maps and cameras are in
    the order of the capture's views; a stroke's file is read. Raises
    `InputError` where strokes cannot be read.
    """
    if capture.parting is not None:
        return capture.parting
    for view, camera in zip(capture.views, cameras, strict=True):
        line = _drawn_line(view, camera, head)
        if line is not None:
            return Parting(line, source="stroke")
    if not all(mask.person_known for mask in masks):
        return Parting()
    skin = parting_from_skin(masks, cameras, head)
    if tied.tails:
        return skin
    sight = see_scalp(masks, orientations, cameras, head)
    front = see_front(sight, masks, cameras, head)
    if skin.seen:
        return comb_beside_parting(skin, front)
    growth = growth_potential(hull, scalp_distance)
    return comb_scalp(skin, front, sight, head, hull, growth)


def parting_from_skin(masks: Sequence[Mask], cameras: Sequence[Camera], head: Head) -> Parting:
    """Return the parting that skin shows on the crown.

    A photo from above says whether there is one; where level views see it near there, too, its
    place is the mean of both.
    """
    above: list[tuple[Mask, Camera]] = []
    beside: list[tuple[Mask, Camera]] = []
    for mask, camera in zip(masks, cameras, strict=True):
        elevation = np.degrees(np.arcsin(-camera.view_direction(np.zeros(3))[1]))
        (above if elevation > FROM_ABOVE else beside).append((mask, camera))
    level = _measure_skin(beside, head, LEAST_SKIN)
    if not above:
        return level
    found = _measure_skin(above, head, LEAST_SKIN_ABOVE)
    if not (found.seen and level.seen) or abs(found.x - level.x) > SAME_PARTING:
        return found
    return Parting.at(0.5 * (found.x + level.x), found.skin_share, found.spread)


def _measure_skin(views: Sequence[tuple[Mask, Camera]], head: Head, least: float) -> Parting:
    """Return the median of the skin on the crown, each place weighted by how it faces the views.

    There is no parting where the share of skin is below `least`.
    """
    at, normals = _crown(head)
    if not len(at):
        return Parting()
    skin, faced = np.zeros(len(at)), np.zeros(len(at))
    for mask, camera in views:
        weight, row, column = look_at(mask, camera, at, normals, LEAST_FACING)
        skin += weight * (mask.labels[row, column] == PERSON)
        faced += weight
    share = float(skin.sum() / max(faced.sum(), LEAST_FACING))
    if share < least:
        return Parting(skin_share=share)
    order = np.argsort(at[:, 0])
    quarters = skin.sum() * np.array(QUARTILES)
    low, middle, high = at[order[np.searchsorted(np.cumsum(skin[order]), quarters)], 0]
    if high - low >= WIDEST_SKIN:
        return Parting(skin_share=share, spread=float(high - low))
    return Parting.at(float(middle), share, float(high - low))


def _drawn_line(view: View, camera: Camera, head: Head) -> Float64Array | None:
    """Return points x, z (N, 2) of the scalp under the view's stroke `parting`, front to back."""
    strokes = read_view_strokes(view, view.width, view.height)
    drawn = () if strokes is None else strokes.labelled("parting")
    if not drawn:
        return None
    pixels = np.concatenate([stroke.sampled() for stroke in drawn])
    facing = -np.einsum("ij,ij->i", camera.view_direction(head.vertices), head.normals())
    seen = np.flatnonzero((head.scalp > 0.5) & (facing > LEAST_FACING))
    if not len(seen):
        return None
    nearest = cKDTree(camera.project(head.vertices[seen])).query(pixels)[1]
    line = np.unique(head.vertices[seen[nearest]][:, [0, 2]].astype(np.float64), axis=0)
    return line[np.argsort(-line[:, 1])] if len(line) > 1 else None


def _crown(head: Head) -> tuple[Float64Array, Float64Array]:
    """Return points (N, 3) and normals (N, 3) of the scalp on top of the head."""
    vertices, normals = head.vertices.astype(np.float64), head.normals().astype(np.float64)
    bare = vertices[head.scalp <= 0.5]
    inner = head.scalp > 0.5
    if len(bare):
        inner &= cKDTree(bare).query(vertices)[0] > SCALP_EDGE
    top = vertices[:, 1].max() - CROWN_DEPTH
    chosen = inner & (vertices[:, 1] > top) & (normals[:, 1] > 0)
    return vertices[chosen], normals[chosen]
