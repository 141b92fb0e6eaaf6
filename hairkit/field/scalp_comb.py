"""Which way the hair on the scalp is combed, from the directions that all views see there.

A level view sees the crown at a grazing angle, but eight of them together tell the directions on
it to 7 to 18 degrees (medians of five heads). They have no sign. Each should point up the growth
potential, hair above the hairline in front forward where it covers the forehead and else back, and
along with its neighbours (`hairkit.field.relaxed_signs`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, across, unit_vectors
from hairkit.field.growth_prior import gradient
from hairkit.field.parting import FRONT_FADE, comb_from_parting, front_share
from hairkit.field.relaxed_signs import relaxed_signs
from hairkit.field.scalp_sight import LEAST_FACING, ScalpSight, look_at, scalp_places
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.parting import Parting
from hairkit.types.volume import Hull

CROWN = 0.09
"""Height below the top of the head above which directions are measured, metres."""
PLACES = 600
"""Places on the crown at which the comb is kept, 8 mm apart."""
SIGHT_BLUR, SIGN_BLUR = 0.02, 0.015
"""Standard deviations in metres of the neighbourhoods over which directions are averaged, and in
which signs should agree."""
SIGN_WEIGHT = 3.0
"""Weight of a parallel neighbour's sign against the cosine to the way to the tips."""
BLUR_REACH = 2.5
"""Reach of a neighbourhood in standard deviations."""
LEAST_ORDER, FULL_ORDER = 0.5, 0.9
"""Share of the directions in neighbourhoods that agree, from which they count at all and for sure:
0.57 on short hair that stands, 0.78 to 0.90 on hair that is combed, and 0.80 on curls: measured
directions are smooth there, too."""
LEAST_ACROSS, FULL_ACROSS = 0.5, 0.9
"""Mean cosine of twice the angle between the hair above the forehead and the way across the
hairline, from which it crosses at all and for sure: 0.73 to 0.92 on fringes and hair that is combed
back, at most 0.17 elsewhere."""
FOREHEAD, FOREHEAD_WIDTH = 0.03, 0.04
"""Height of the forehead below the hairline that a fringe covers, and half its width, metres."""
LEAST_COVERED, MOST_BARE = 0.5, 0.1
"""Share of it that is hair below a fringe, 0.95 to 1 there, 0 to 0.33 elsewhere; and up to which
hair may be combed back: 0.00 there, 0.20 where it falls to one side over the forehead."""


class Front(NamedTuple):
    """How the hair above the forehead crosses the hairline."""

    forward: float
    """1 over the forehead, -1 back, 0 where it does not cross."""
    sureness: float
    """0 to 1, of the crossing."""


def see_front(
    sight: ScalpSight, masks: Sequence[Mask], cameras: Sequence[Camera], head: Head
) -> Front:
    """Return how the hair above the forehead crosses the hairline."""
    agreement = _across_hairline(sight, head)
    if agreement < LEAST_ACROSS:
        return Front(0.0, 0.0)
    covered = forehead_covered(masks, cameras, head)
    if MOST_BARE < covered < LEAST_COVERED:
        return Front(0.0, 0.0)
    way = 1.0 if covered >= LEAST_COVERED else -1.0
    return Front(way, _share(agreement, LEAST_ACROSS, FULL_ACROSS))


def comb_beside_parting(skin: Parting, front: Front) -> Parting:
    """Return how hair is combed where skin shows a parting.

    Hair combed back shows skin too, along its hairline, so the front counts first.
    """
    if front.forward < 0:
        return Parting(swept_back=True, skin_share=skin.skin_share, sureness=front.sureness)
    return replace(skin, fringe=True, sureness=front.sureness) if front.forward else skin


def comb_scalp(
    skin: Parting, front: Front, sight: ScalpSight, head: Head, hull: Hull, growth: Float32Array
) -> Parting:
    """Return how the crown is combed where no skin shows a parting: as the views see it.

    `growth` (X, Y, Z) is the growth potential in the hull. Where directions do not agree, or no
    scalp lies on the crown, what the skin says is returned. Places that no view sees are combed
    along the potential.
    """
    places, normals = _crown_places(head)
    if not len(places):
        return skin
    near = _neighbours(places, sight.places, SIGHT_BLUR).multiply(sight.weight).tocsr()
    pairs = sight.directions[:, :, None] * sight.directions[:, None, :]
    tensor = (near @ pairs.reshape(-1, 9)).reshape(-1, 3, 3)
    value, vector = np.linalg.eigh(tensor)
    order = (value[:, 2] - value[:, 1]).sum() / max(float(value.sum()), 1e-9)
    if order < LEAST_ORDER:
        return skin
    towards = unit_vectors(across(normals, gradient(hull.grid, growth, places)))
    seen = unit_vectors(across(normals, vector[:, :, 2]))
    main = np.where(value[:, 2:] > 0, seen, towards)
    if front.forward:
        share = front_share(head, places)[:, None]
        ahead = comb_from_parting(Parting(fringe=True), head, places, normals)
        towards = (1 - share) * towards + share * front.forward * ahead
    near = _neighbours(places, places, SIGN_BLUR)
    cosines = SIGN_WEIGHT * near.multiply(main @ main.T).tocsr()
    comb = main * relaxed_signs((main * towards).sum(axis=1), cosines)[:, None]
    return replace(
        skin, places=places, directions=comb, sureness=_share(order, LEAST_ORDER, FULL_ORDER),
        fringe=front.forward > 0,
    )  # fmt: skip


def _crown_places(head: Head) -> tuple[Float64Array, Float64Array]:
    """Return places (M, 3) of the hair on the crown, and normals (M, 3)."""
    places, normals = scalp_places(head)
    crown = places[:, 1] > float(head.vertices[:, 1].max()) - CROWN
    step = max(-(-int(crown.sum()) // PLACES), 1)
    return places[crown][::step], normals[crown][::step]


def _neighbours(at: Float64Array, of: Float64Array, blur: float) -> sparse.csr_matrix:
    """Return Gaussian weights (N, M) of places `of` (M, 3) at places `at` (N, 3)."""
    reach = BLUR_REACH * blur
    near = cKDTree(at).sparse_distance_matrix(cKDTree(of), reach, output_type="coo_matrix").tocsr()
    near.data = np.exp(-0.5 * (near.data / blur) ** 2)
    return near


def _across_hairline(sight: ScalpSight, head: Head) -> float:
    """Return how well the hair above the forehead agrees with a comb forward (or back)."""
    front = sight.at(front_share(head, sight.places) >= 1)
    forward = comb_from_parting(Parting(fringe=True), head, front.places, front.normals)
    return front.agreement(forward)


def fringe_share(masks: Sequence[Mask], cameras: Sequence[Camera], head: Head) -> float:
    """Return 0 where the forehead is bare, 1 where a fringe lies on it: of any length."""
    return _share(forehead_covered(masks, cameras, head), MOST_BARE, LEAST_COVERED)


def forehead_covered(masks: Sequence[Mask], cameras: Sequence[Camera], head: Head) -> float:
    """Return the share of the forehead below the hairline that the views see as hair."""
    scalp = head.vertices[head.scalp > 0.5]
    foremost = float(scalp[:, 2].max())
    hairline = float(scalp[scalp[:, 2] > foremost - FRONT_FADE, 1].min())
    vertices, normals = head.vertices.astype(np.float64), head.normals()
    below = (vertices[:, 1] < hairline) & (vertices[:, 1] > hairline - FOREHEAD)
    chosen = below & (np.abs(vertices[:, 0]) < FOREHEAD_WIDTH) & (normals[:, 2] > LEAST_FACING)
    hair, seen = 0.0, 0.0
    for mask, camera in zip(masks, cameras, strict=True):
        weight, row, column = look_at(mask, camera, vertices[chosen], normals[chosen], LEAST_FACING)
        hair += float((weight * mask.hair[row, column]).sum())
        seen += float(weight.sum())
    return hair / max(seen, 1e-9)


def _share(value: float, least: float, full: float) -> float:
    """Return 0 at the least value, 1 at the full one."""
    return float(np.clip((value - least) / (full - least), 0.0, 1.0))
