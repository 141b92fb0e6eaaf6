"""A head brought onto another of any mesh: a similarity, then a smooth warp of space.

The similarity is found by closest points in both directions, trimmed (Chetverikov et al. 2002), so
that a neck, shoulders or a body that only one of the two has do not count. The warp is a thin-plate
spline whose points are drawn to the other surface in rounds of falling stiffness, as in the
registration of Chui and Rangarajan (2003, "A new point matching algorithm for non-rigid
registration") with closest points for matches. Neither asks anything of the meshes but their shape.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float64Array, Int32Array
from hairkit.cameras.similarity import Similarity, fit_similarity
from hairkit.errors import InputError
from hairkit.head_model.bvh import TriangleTree, build_tree, nearest_on_surface
from hairkit.head_model.spread_vertices import spread_vertices
from hairkit.head_model.thin_plate_spline import ThinPlateSpline
from hairkit.types.head import JAW_LANDMARKS, Head, vertex_normals

SCALES = (0.8, 0.92, 1.05, 1.2)
"""Sizes from which the similarity is sought; heads of children and adults lie between."""
TRIALS, ROUNDS, STILL = 10, 50, 2e-5
"""Rounds of closest points from each size, rounds at most from the best, and the move in metres at
which they end."""
SMALLEST, LARGEST = 0.1, 2.6
"""Metres of height, from a face's to a person's; others are in another unit."""
LEAST_SCALE, MOST_SCALE = 0.5, 2.0
"""Sizes of the other head that are believed, of the groom's."""
SURE = 0.0045
"""Metres of mean distance up to which the direction of the head is not doubted. Heads of a child, a
woman and a man with a long cranium are 3.4 to 3.8 mm off the default head, of which 1.5 are gaps
between the points; turned about they are 5.3 or more."""
CLEARLY = 0.8
"""Share of the distance that another direction must have to be believed instead."""
TURNS = {
    "looks along +X": ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    "looks along -X": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    "looks along -Z": ((-1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "stands along +Z (up: z)": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
}
"""What is wrong with a head, and the rotation that mends it."""
KEPT = 0.85
"""Share of the nearest pairs that a round of closest points uses."""
SAMPLES = 1500
"""Points of each head, at most, that the similarity is fitted to."""
SPREAD = 6_000
"""Points spread over the other head's faces."""
MARGIN = 0.02
"""Metres around the head within which the other's points are matched to it."""
BODY = 0.1
"""Metres around the head from which on a mesh is another part of the body."""
FACING = 0.3
"""Least cosine between the normals of a pair."""
CROWN = 0.12
"""Metres below the highest point whose extent is compared to begin with."""
LOST = 0.05
"""Metres that a point without a match counts as."""
LANDMARK_SHARE = 0.5
"""Weight of all landmarks together in the similarity, of that of all pairs."""
FEWEST = 60
"""Points of the warp that must have a match."""
CONTROLS = 600
"""Points of the warp."""
LOOSENESS = (0.03, 0.01, 0.003, 0.001, 0.0005)
"""The spline's lambda, metres, of each round: it halves bends of about that size."""
REACH = (0.03, 0.02, 0.015, 0.012, 0.01)
"""Metres up to which a point of the warp is drawn to the other surface, in each round."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh that a head is brought onto."""

    vertices: Float64Array
    """(V, 3) metres, +Y up, the face along +Z."""
    faces: Int32Array
    """(F, 3) counter-clockwise from outside."""
    landmarks: Float64Array | None = None
    """(68, 3) iBUG landmarks, where they are known."""


@dataclass(frozen=True, eq=False)
class HeadMap:
    """The map that takes space around one head to space around the other."""

    similarity: Similarity
    """Its rigid part, with scale."""
    bend: ThinPlateSpline | None
    """Displacements in metres that follow it; None for none."""
    distance: float
    """Mean distance of the head from the other surface after the similarity, metres."""

    def __call__(self, points: npt.ArrayLike) -> Float64Array:
        """Return the places (N, 3) of points (N, 3) in the other head's space."""
        moved = self.similarity.apply(points)
        return moved if self.bend is None else moved + self.bend(moved)


def register_head(head: Head, surface: Surface) -> HeadMap:
    """Return the map from the space of a head to that of another surface.

    Raises `InputError` where the other cannot be a head of about the same size and direction.
    """
    _check_size(surface)
    placed = place_on(head, surface)
    _check_direction(head, surface, placed)
    target = _Target(surface)
    skin = np.unique(head.skin_faces())
    controls = spread_vertices(head, skin.astype(np.int64), CONTROLS)
    start = placed.similarity.apply(head.vertices)
    bend: ThinPlateSpline | None = None
    for looseness, reach in zip(LOOSENESS, REACH, strict=True):
        warped = start if bend is None else start + bend(start)
        normals = vertex_normals(warped, head.faces)[controls]
        aims, near = target.closest(warped[controls], normals, reach)
        if np.count_nonzero(near) < FEWEST:
            break
        places, values = start[controls[near]], (aims - start[controls])[near]
        smoothing = np.full(len(places), looseness)
        if head.landmark_vertices is not None and surface.landmarks is not None:
            marks = start[head.landmark_vertices[JAW_LANDMARKS:]]
            places = np.concatenate([places, marks])
            values = np.concatenate([values, surface.landmarks[JAW_LANDMARKS:] - marks])
            smoothing = np.concatenate([smoothing, np.full(len(marks), looseness)])
        bend = ThinPlateSpline(places, values, smoothing)
    return HeadMap(placed.similarity, bend, placed.distance)


def place_on(head: Head, surface: Surface, rounds: int = ROUNDS) -> HeadMap:
    """Return the best similarity alone: from several sizes, the crown of one on the other's."""
    vertices = head.vertices.astype(np.float64)
    fit = _Closest(head, surface)
    if head.landmark_vertices is not None and surface.landmarks is not None:
        starts = [fit_similarity(vertices[head.landmark_vertices], surface.landmarks)]
    else:
        starts = [fit.start(scale) for scale in SCALES]
    trials = [fit.improve(start, TRIALS) for start in starts]
    best = min(trials, key=lambda found: found.distance)
    part = _without_body(head, surface, best.similarity)
    fit = fit if part is surface else _Closest(head, part)
    return fit.improve(best.similarity, rounds)


def _without_body(head: Head, surface: Surface, found: Similarity) -> Surface:
    """Return what of a surface is around the head, so that points spread over it are not lost."""
    local = found.inverse().apply(surface.vertices)
    low, high = head.vertices.min(axis=0) - BODY, head.vertices.max(axis=0) + BODY
    inside = ((local > low) & (local < high)).all(axis=1)[surface.faces].all(axis=1)
    if inside.all() or np.count_nonzero(inside) < FEWEST:
        return surface
    return replace(surface, faces=surface.faces[inside])


def _check_size(surface: Surface) -> None:
    height = float(np.ptp(surface.vertices[np.unique(surface.faces), 1]))
    if not SMALLEST <= height <= LARGEST:
        raise InputError(
            f"the head is {height:.3g} m high, expected {SMALLEST:g} to {LARGEST:g}: give its unit"
        )


def _check_direction(head: Head, surface: Surface, placed: HeadMap) -> None:
    """Raise `InputError` where the other head has an impossible size or fits better turned."""
    scale = placed.similarity.scale
    if not LEAST_SCALE <= scale <= MOST_SCALE:
        raise InputError(f"the head is {scale:.2g} times as large as the groom's: give its unit")
    if placed.distance <= SURE or surface.landmarks is not None:
        return
    found = {}
    for fault, rotation in TURNS.items():
        turned = replace(surface, vertices=surface.vertices @ np.array(rotation, np.float64).T)
        with contextlib.suppress(InputError):  # nothing lies where a head would
            found[fault] = place_on(head, turned, TRIALS).distance
    best = min(found, key=lambda fault: found[fault], default="")
    if best and found[best] < CLEARLY * placed.distance:
        raise InputError(f"the head {best}; it must look along +Z with +Y up")


class _Closest:
    """Samples of both surfaces with normals, and the fit of one to the other."""

    def __init__(self, head: Head, surface: Surface) -> None:
        skin = np.unique(head.skin_faces())
        above = skin[head.vertices[skin, 1] > head.joints[1, 1]]  # the neck's joint
        chosen = above[np.linspace(0, len(above) - 1, min(SAMPLES, len(above))).astype(np.int64)]
        self.points = head.vertices[chosen].astype(np.float64)
        self.normals = head.normals()[chosen]
        self.tree = cKDTree(self.points)
        self.low, self.high = self.points.min(axis=0) - MARGIN, self.points.max(axis=0) + MARGIN
        self.top = self.points[self.points[:, 1].argmax()]
        self.there, self.there_normals = _spread(surface)
        self.there_tree = cKDTree(self.there)
        self.marks: tuple[Float64Array, Float64Array] | None = None
        if head.landmark_vertices is not None and surface.landmarks is not None:
            self.marks = head.vertices[head.landmark_vertices].astype(np.float64), surface.landmarks

    def start(self, scale: float) -> Similarity:
        """Return the similarity of a scale that puts the crown on the other's highest part."""
        highest = self.there[self.there[:, 1] > self.there[:, 1].max() - CROWN * scale]
        middle = 0.5 * (highest.min(axis=0) + highest.max(axis=0))
        own = self.points[self.points[:, 1] > self.top[1] - CROWN]
        at = 0.5 * (own.min(axis=0) + own.max(axis=0))
        return Similarity(scale, np.eye(3), middle - scale * at)

    def improve(self, start: Similarity, rounds: int) -> HeadMap:
        """Return the similarity after closest points in both directions, and its mean distance."""
        found, distance = start, np.inf
        for _ in range(rounds):
            here, there, distance = self._pairs(found)
            weights = np.ones(len(here))
            if self.marks is not None:
                here = np.concatenate([here, self.marks[0]])
                there = np.concatenate([there, self.marks[1]])
                share = LANDMARK_SHARE * len(weights) / len(self.marks[0])
                weights = np.concatenate([weights, np.full(len(self.marks[0]), share)])
            before, found = found, fit_similarity(here, there, weights)
            if np.abs(found.apply(self.points) - before.apply(self.points)).max() < STILL:
                break
        return HeadMap(found, None, distance)

    def _pairs(self, found: Similarity) -> tuple[Float64Array, Float64Array, float]:
        """Return pairs of points (N, 3) of head and surface, and their trimmed mean distance."""
        moved, turned = found.apply(self.points), self.normals @ found.rotation.T
        apart, near = self.there_tree.query(moved)
        facing = (turned * self.there_normals[near]).sum(axis=1) > FACING
        apart = np.where(facing, apart, LOST)
        kept = apart <= np.quantile(apart, KEPT)
        back = found.inverse()
        local = back.apply(self.there)
        close = ((local > self.low) & (local < self.high)).all(axis=1)
        local, index = local[close], np.flatnonzero(close)
        away, own = self.tree.query(local)
        agree = ((self.there_normals[index] @ found.rotation) * self.normals[own]).sum(1) > FACING
        inner = agree & (away <= np.quantile(away, KEPT)) if len(away) else agree
        distance = float(apart[kept].mean()) + (
            found.scale * float(away[inner].mean()) if inner.any() else LOST
        )
        here = np.concatenate([self.points[kept], self.points[own[inner]]])
        there = np.concatenate([self.there[near[kept]], self.there[index[inner]]])
        return here, there, 0.5 * distance


class _Target:
    """The other surface, to find closest points on."""

    def __init__(self, surface: Surface) -> None:
        self.tree: TriangleTree = build_tree(surface.vertices, surface.faces)
        self.corners = surface.vertices[surface.faces]
        self.normals = _face_normals(self.corners)

    def closest(
        self, points: Float64Array, normals: Float64Array, reach: float
    ) -> tuple[Float64Array, BoolArray]:
        """Return the closest points (N, 3), and which are within reach and face the same way."""
        face, weights, distance = nearest_on_surface(self.tree, points)
        places = np.einsum("nk,nkd->nd", weights, self.corners[face])
        facing = (self.normals[face] * normals).sum(axis=1) > FACING
        return places, facing & (distance < reach)


def _spread(surface: Surface) -> tuple[Float64Array, Float64Array]:
    """Return points (N, 3) spread evenly over the faces, and the faces' normals there."""
    corners = surface.vertices[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    generator = np.random.default_rng(0)
    face = generator.choice(len(area), SPREAD, p=area / area.sum())
    weights = generator.dirichlet(np.ones(3), SPREAD)
    return np.einsum("nk,nkd->nd", weights, corners[face]), _face_normals(corners)[face]


def _face_normals(corners: Float64Array) -> Float64Array:
    """Return the unit normals (F, 3) of triangles (F, 3, 3); 0 of those without area."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.maximum(length, 1e-300))
