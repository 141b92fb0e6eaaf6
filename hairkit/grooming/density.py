"""Density: guides added between others, hair planted on the face, and guides removed.

Both brushes act about the roots, on the skin below the brush. What they paint is the density of the
hair: guides come and go, and the head's density, by which full hair grows, follows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array, Int64Array, across, unit_vectors
from hairkit.grooming.brushed_hair import MIRROR, Hair, Stroke
from hairkit.grooming.densify import NEIGHBOURS, densify
from hairkit.head_model.scalp import evaluate, even_places, face_areas, roots_at
from hairkit.head_model.spread_vertices import spread_points
from hairkit.types.head import Head, Roots
from hairkit.types.strands import PLANTED, Strands

TRIED = 8
"""Places tried for each strand that is added."""
MOST = 5000
"""Strands that a stroke adds at most, or takes in the order of their distances: all are compared
with all."""
FACE = 0.01
"""Metres that the corners of a face lie beyond the brush at most."""
SHORTER = 0.3
"""Share by which planted strands are shorter than the longest of them at most."""
GOLDEN = (np.sqrt(5) - 1) / 2
"""Multiples of it, less their whole parts, are spread evenly over [0, 1)."""


class Planted(NamedTuple):
    """Hair of a group as it usually grows."""

    per_m2: float
    """Strands planted on a square metre by an amount of 1, where the stroke acts most."""
    length: float
    """Of the longest strands, metres."""
    lift_deg: tuple[float, float]
    """Angle from the skin at the root and at the tip."""
    way: tuple[float, float, float]
    """Its own direction on the subject's left."""
    follow: float
    """Share of the stroke's way in the strands' direction; the rest is the group's own."""


USUAL = {
    "brows": Planted(250_000.0, 0.009, (30.0, 5.0), (1, 0, 0), 0.7),
    "lashes": Planted(300_000.0, 0.010, (75.0, 15.0), (0, 1, 0), 0.25),
    "beard": Planted(120_000.0, 0.015, (45.0, 10.0), (0, -1, 0), 0.6),
}
"""Lengths: brows and upper lashes of adults reach 1 cm; a beard of two weeks."""


def add(hair: Hair, strokes: list[Stroke]) -> None:
    """Add guides, `amount` times as many on an area as the head has in the mean.

    On the scalp their shape is mixed from their neighbours'; brows, lashes and beard are planted as
    they usually grow, along the stroke.
    """
    others = hair.others(strokes[0].group)
    for stroke in strokes:
        roots = _new_roots(others, stroke)
        if len(roots) and (len(others.points) or stroke.group in USUAL):
            grow = _grown if stroke.group in USUAL else _mixed
            hair.plant(grow(others, stroke, roots), roots, PLANTED.get(stroke.group, 0))
    if strokes[0].group == "hair" and hair.density is not None:
        more = sum(each.amount * each.reach(hair.room.head.vertices)[0] for each in strokes)
        hair.density = np.clip(hair.density + more, 0, 1).astype(np.float32)


def thin(hair: Hair, strokes: list[Stroke]) -> None:
    """Remove a share `amount` of the guides, evenly; with 1 all where the stroke acts wholly."""
    for stroke in strokes:
        share = stroke.amount * stroke.reach(hair.points[:, 0])[0]
        under = np.flatnonzero(share > 0)
        rank = np.empty(len(under))  # the same for every amount: more removes these and others
        rank[_in_order(hair.points[under, 0])] = (np.arange(len(under)) + 0.5) / len(under)
        hair.kept[under] &= rank <= 1 - share[under]
    if strokes[0].group == "hair":
        places = hair.room.head.vertices
        left = [1 - np.clip(each.amount * each.reach(places)[0], 0, 1) for each in strokes]
        full = np.ones(len(places)) if hair.density is None else hair.density
        hair.density = (full * np.prod(left, axis=0)).astype(np.float32)


def _in_order(roots: Float64Array) -> Int64Array:
    """Return an even order (N,) of roots, whose middle comes late: it may become bald."""
    if not 0 < len(roots) <= MOST:
        return np.arange(len(roots))  # guides are in such an order
    return spread_points(roots, len(roots), ((roots - roots.mean(axis=0)) ** 2).sum(axis=1))


def _new_roots(others: Hair, stroke: Stroke) -> Roots:
    """Return roots where the stroke acts, apart from each other and from those of other hair.

    Of places tried in an even sequence the one is taken that is farthest from all roots, in the
    spacing that is wanted there. Both sides of the head try mirrored places.
    """
    head, usual = others.room.head, USUAL.get(stroke.group)
    side = np.where(stroke.path[:, :1].sum() < 0, MIRROR, 1.0)
    wide = stroke._replace(path=stroke.path * side, radius=stroke.radius + FACE)
    every, near = face_areas(head), (wide.reach(head.vertices)[0][head.faces] > 0).any(axis=1)
    scalp = every @ (head.scalp[head.faces].mean(axis=1) > 0.5)
    area = every * near * (usual is None or len(stroke.path) > 0)  # no beard everywhere
    wanted = stroke.amount * area.sum() * (usual.per_m2 if usual else len(others.points) / scalp)
    tried = TRIED * min(int(np.ceil(wanted)), MOST)
    face, weights = even_places(area, np.arange(tried), np.zeros(3, np.uint64))
    face, weights = others.room.bind(evaluate(head, face, weights) * side)
    places = evaluate(head, face, weights)
    share = stroke.reach(places)[0]
    if usual is None:
        share = share * ((head.scalp[head.faces[face]] * weights).sum(axis=1) > 0.5)
    count = min(int(np.ceil(wanted * share.sum() / max(tried, 1))), MOST)
    apart = cKDTree(others.points[:, 0]).query(places)[0] ** 2 if len(others.points) else 1.0
    taken = spread_points(places, min(count, int((share > 0).sum())), apart, share)
    return roots_at(head, face[taken], weights[taken])


def _mixed(others: Hair, stroke: Stroke, roots: Roots) -> Float64Array:
    """Return strands (N, M, 3) from roots, mixed from the guides around each."""
    count, many = min(NEIGHBOURS, len(others.points)), others.points.shape[1]
    near = np.unique(cKDTree(others.points[:, 0]).query(roots.positions, count)[1])
    points = others.points[near].reshape(-1, 3).astype(np.float32)
    guides = Strands(points, np.arange(len(near) + 1) * many)
    every = densify(guides, len(near) + len(roots), roots=roots, locks=None)
    new = every.select(np.arange(len(near), len(every))).resampled(many)
    return new.points.reshape(-1, many, 3).astype(np.float64)


def _grown(others: Hair, stroke: Stroke, roots: Roots) -> Float64Array:
    """Return strands (N, M, 3) from roots, of the group's usual length and way off the skin."""
    usual, many = USUAL[stroke.group], others.points.shape[1]
    normal, start = roots.normals.astype(np.float64), roots.positions.astype(np.float64)
    way = _own_way(others.room.head, roots, stroke.group)
    if len(stroke.path) > 1:
        drawn = np.gradient(stroke.path, axis=0)[stroke.reach(start)[1]]
        way = usual.follow * unit_vectors(drawn) + (1 - usual.follow) * unit_vectors(way)
    along = unit_vectors(across(normal, way))
    lift = np.radians(np.linspace(*usual.lift_deg, many - 1))[:, None]
    turned = np.cos(lift) * along[:, None] + np.sin(lift) * normal[:, None]
    length = usual.length * (1 - SHORTER * np.modf(GOLDEN * np.arange(len(roots)))[0])
    steps = turned * (length / (many - 1))[:, None, None]
    return np.asarray(start[:, None] + np.pad(steps.cumsum(axis=1), ((0, 0), (1, 0), (0, 0))))


def _own_way(head: Head, roots: Roots, group: str) -> Float64Array:
    """Return the direction (N, 3) that hair of a group has by itself, on either side."""
    places, eyes = roots.positions.astype(np.float64), head.eye_centres()
    if group == "lashes" and eyes is not None:  # away from the middle of their eye
        return np.asarray((places - eyes[cKDTree(eyes).query(places)[1]]) * [1, 1, 0])
    return np.array(USUAL[group].way) * np.where(places[:, :1] < 0, MIRROR, 1.0)
