"""Hair under a brush: strands of equal point counts on their head, and strokes over them.

A strand is its root, the directions of its segments and their lengths. Brushes turn the segments,
scale the lengths, remove strands or plant new ones; strands that were moved into the head glide
along it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.colour import linear_from_hex
from hairkit.field.growth_prior import gradient
from hairkit.grooming.head_collision import push_out_of_head
from hairkit.head_model.bvh import TriangleTree, build_tree, nearest_on_surface
from hairkit.head_model.scalp import evaluate, roots_at
from hairkit.head_model.signed_distance import signed_distance
from hairkit.types.edits import Edit
from hairkit.types.groom import Groom
from hairkit.types.head import Head, Roots
from hairkit.types.strand_blocks import colours
from hairkit.types.strands import PLANTED, Strands
from hairkit.types.volume import VoxelGrid

STEP, MOST_STEPS = 0.25, 2000
"""Distance, in radii, of the places along its path at which a brush acts, and how many at most."""
CLEARANCE, ROUNDS = 0.001, 6
"""Metres that hair keeps from the head, and times that it is moved out and set to its lengths."""
CELL, MARGIN = 0.004, 0.02
"""Edge of the cells of a head's distances, and the room around the head, metres."""
STUB = 0.01
"""Share of a strand that is shown of one that a stroke under way removes."""
UNMOVED = 1e-7
"""Metres by which a strand must move to count as changed."""
MIRROR = np.array([-1.0, 1.0, 1.0])
_EACH = ("points", "triangle", "barycentric", "source", "number", "group", "colours")


class HeadRoom(NamedTuple):
    """A head's skin, and how far every place near the head is from it."""

    head: Head
    grid: VoxelGrid
    distance: Float32Array
    """(X, Y, Z) metres, negative inside."""
    skin: TriangleTree
    faces: Int64Array
    """(F',) numbers of the head's faces that are skin, not eyes."""

    @classmethod
    def around(cls, head: Head) -> HeadRoom:
        """Return the room around a head; that of the last head is kept, whatever its density."""
        if id(head.vertices) not in _ROOMS:
            _ROOMS.clear()
            _ROOMS[id(head.vertices)] = cls._measured(head)
        return _ROOMS[id(head.vertices)]

    @classmethod
    def _measured(cls, head: Head) -> HeadRoom:
        low, high = head.vertices.min(axis=0), head.vertices.max(axis=0)
        grid = VoxelGrid.around(low - MARGIN, high + MARGIN, CELL)
        eyes = () if head.eye_vertices is None else head.eye_vertices
        faces = np.flatnonzero(~np.isin(head.faces, eyes).any(axis=1))
        tree = build_tree(head.vertices, head.faces[faces])
        return cls(head, grid, signed_distance(head, grid), tree, faces)

    def bind(self, places: npt.ArrayLike) -> tuple[Int32Array, Float64Array]:
        """Return the faces (N,), and weights (N, 3) on them, of the skin nearest to places."""
        face, weights, _ = nearest_on_surface(self.skin, places)
        return self.faces[face].astype(np.int32), weights

    def on_skin(self, places: Float64Array) -> Float64Array:
        """Return the places (N, 3) of the skin that are nearest to others."""
        return evaluate(self.head, *self.bind(places)) if len(places) else places


_ROOMS: dict[int, HeadRoom] = {}
"""By the vertices, which they hold."""


class Stroke(NamedTuple):
    """Where a brush goes, and how much it does there."""

    path: Float64Array
    """(N, 3) places `STEP` radii apart or less, in long paths more, metres; none: everywhere."""
    radius: float
    amount: float
    pitch: float
    group: str
    colour: Float32Array
    """(3,) linear RGB."""

    def reach(self, points: npt.NDArray[np.floating]) -> tuple[Float64Array, Int64Array]:
        """Return how much (...) the stroke acts at points (..., 3), 0 to 1, and its place there."""
        amount, place = np.ones(points.shape[:-1]), np.zeros(points.shape[:-1], int)
        if len(self.path):
            near, tree = self.near(points), cKDTree(self.path)
            away, at = tree.query(points[near], distance_upper_bound=self.radius)
            amount[~near], amount[near] = 0, falloff(away / self.radius)
            place[near] = np.minimum(at, len(self.path) - 1)
        return amount, place

    def near(self, points: npt.NDArray[np.floating]) -> BoolArray:
        """Return which points (..., 3) are in a box about the stroke."""
        if not len(self.path):
            return np.ones(points.shape[:-1], np.bool_)
        low, high = self.path.min(axis=0) - self.radius, self.path.max(axis=0) + self.radius
        x, y, z = (
            (low[k] < points[..., k]) & (points[..., k] < high[k]) for k in range(points.shape[-1])
        )
        return np.asarray(x & y & z)


@dataclass(eq=False)
class Hair:
    """Strands of equal point counts under a brush."""

    points: Float64Array
    """(S, M, 3) metres, head frame."""
    triangle: Int32Array
    """(S,) face of the head that carries each root."""
    barycentric: Float32Array
    """(S, 3) weights of that face's corners."""
    source: Int64Array
    """(S,) strand of the groom that gives each its looks."""
    number: Int64Array
    """(S,) place of each in the hair that this is a copy of, -1 for new strands."""
    group: Int32Array
    """(S,) group number."""
    colours: Float32Array
    """(S, M, 3) linear RGB."""
    room: HeadRoom
    density: Float32Array | None
    """(V,) of the head; None: full hair."""
    dyed: bool = False
    """Whether a brush gave colours, so that they are no longer those of the groom."""
    around: Hair | None = None
    """The hair that these strands were taken from."""

    def __post_init__(self) -> None:
        self.moved = np.zeros(len(self.points), bool)
        """(S,) strands that may be in the head."""
        self.kept = np.ones(len(self.points), bool)
        """(S,) false for strands that are removed."""

    @classmethod
    def of(cls, groom: Groom) -> Hair:
        """Return the strands of a groom, resampled where their point counts differ."""
        strands, head = groom.strands, groom.head
        most = max(int(strands.counts.max(initial=2)), 2)
        even = strands if (strands.counts == most).all() else strands.resampled(most)
        group = np.zeros(len(even), np.int32) if even.group is None else even.group
        points = even.points.reshape(-1, most, 3).astype(np.float64)
        bound = groom.root_triangle, groom.root_barycentric
        number, room = np.arange(len(even)), HeadRoom.around(head)
        own = colours(groom.material, even).at().reshape(points.shape)
        return cls(points, *bound, number, number, group, own, room, head.density)

    def onto(self, groom: Groom) -> Groom:
        """Return the groom with these strands in the place of its own."""
        strands, many = groom.strands, self.points.shape[1]
        even = strands if (strands.counts == many).all() else strands.resampled(many)
        look, head = even.select(self.source), groom.head
        own = (self.barycentric == groom.root_barycentric[self.source]).all(axis=1)  # not planted
        uv = look.root_uv
        if uv is not None:
            uv = np.where(own[:, None], uv, roots_at(head, self.triangle, self.barycentric).uv)
        group = self.group if look.group is not None or self.group.any() else None
        points = self.points.reshape(-1, 3).astype(np.float32)
        own = self.colours.reshape(-1, 3) if self.dyed or strands.colours is not None else None
        return replace(
            groom,
            strands=replace(look, points=points, root_uv=uv, group=group, colours=own),
            head=head if self.density is head.density else replace(head, density=self.density),
            root_triangle=self.triangle,
            root_barycentric=self.barycentric,
        )

    @cached_property
    def lengths(self) -> Float64Array:
        """(S, M - 1) of the segments, metres."""
        return np.asarray(np.linalg.norm(np.diff(self.points, axis=1), axis=2))

    @property
    def arcs(self) -> Float64Array:
        """(S, M) metres from the root."""
        return np.concatenate([np.zeros((len(self.points), 1)), self.lengths.cumsum(axis=1)], 1)

    def over(self, before: Hair) -> tuple[Float64Array, Float32Array]:
        """Return points and colours (S, M, 3) of what a stroke makes of the strands before it.

        Those that it removed are stubs; those that it added are not among them.
        """
        if np.array_equal(self.number, before.number):
            return self.points, self.colours
        points, colours = before.points.copy(), before.colours.copy()
        points += (1 - STUB) * (points[:, :1] - points)
        old = self.number >= 0
        points[self.number[old]], colours[self.number[old]] = self.points[old], self.colours[old]
        return points, colours

    def in_group(self, name: str) -> BoolArray:
        """Return which strands (S,) are of a group of `PLANTED`, or of none of them: `hair`."""
        if name in PLANTED:
            return np.asarray(self.group == PLANTED[name])
        return ~np.isin(self.group, [*PLANTED.values()])

    def others(self, group: str) -> Hair:
        """Return all strands of a group, those under the brush as they were before."""
        return self if self.around is None else self.around.take(self.around.in_group(group))

    def copy(self) -> Hair:
        """Return hair that brushes can change while this stays."""
        number = np.arange(len(self.points))
        return replace(self, points=self.points.copy(), colours=self.colours.copy(), number=number)

    def take(self, index: npt.NDArray[Any]) -> Hair:
        """Return some strands, by numbers or a mask, around which are all of these."""
        some = {name: getattr(self, name)[index] for name in _EACH}
        return replace(self, **some, around=self)

    def put(self, index: Int64Array, some: Hair) -> None:
        """Take back the strands that `take` gave, without those removed, and what is planted."""
        old = len(index)
        self.points[index], self.density = some.points[:old], some.density
        self.colours[index], self.dyed = some.colours[:old], some.dyed
        if some.kept.all() and len(some.points) == old:
            return
        kept = np.ones(len(self.points), bool)
        kept[index] = some.kept[:old]
        if not kept.any() and len(some.points) == old:
            return  # a groom has hair
        for name in _EACH:
            parts = getattr(self, name)[kept], getattr(some, name)[old:]
            setattr(self, name, np.concatenate(parts))

    def move(self, shift: Float64Array) -> None:
        """Move points (S, M, 3); the segments keep their lengths and take the new directions."""
        some = (np.abs(shift) > UNMOVED).any(axis=(1, 2))
        points, lengths = self.points[some], self.lengths[some]
        ways = np.diff(points + shift[some], axis=1)
        size = np.linalg.norm(ways, axis=2, keepdims=True)
        ways = np.where(size > 1e-12, ways / np.maximum(size, 1e-12), 0.0)
        steps = (ways * lengths[..., None]).cumsum(axis=1)
        self.points[some] = np.concatenate([points[:, :1], points[:, :1] + steps], axis=1)
        self.moved |= some

    def scale(self, factor: Float64Array) -> None:
        """Make strands (S,) longer along their last direction, or cut what is beyond, again even
        in their points."""
        some = factor != 1
        points, arcs = self.points[some], self.arcs[some]
        share = np.linspace(0, 1, points.shape[1])
        wanted = share * (factor[some] * arcs[:, -1])[:, None]
        after = np.clip((arcs[:, None] <= wanted[..., None]).sum(axis=2), 1, arcs.shape[1] - 1)
        row = np.arange(len(points))[:, None]
        start, end = arcs[row, after - 1], arcs[row, after]
        t = ((wanted - start) / np.maximum(end - start, 1e-12))[..., None]
        self.points[some] = points[row, after - 1] * (1 - t) + points[row, after] * t
        t, own = t.clip(0, 1).astype(np.float32), self.colours[some]
        self.colours[some] = own[row, after - 1] * (1 - t) + own[row, after] * t
        del self.lengths
        self.moved |= some

    def plant(self, points: Float64Array, roots: Roots, group: int) -> None:
        """Add strands (N, M, 3) of a group, with the looks of those that grow nearest."""
        if self.around is not None and len(points):
            near = cKDTree(self.around.points[:, 0]).query(roots.positions)[1]
            of, colours = self.around.source[near], self.around.colours[near]
            number, groups = (np.full(len(points), value, np.int32) for value in (-1, group))
            new = points, roots.triangle, roots.barycentric, of, number, groups, colours
            for name, values in zip(_EACH, new, strict=True):
                setattr(self, name, np.concatenate([getattr(self, name), values]))
            self.__dict__.pop("lengths", None)
            self.moved, self.kept = (
                np.concatenate([flags, np.ones(len(points), bool)])
                for flags in (self.moved, self.kept)
            )

    def outside(self) -> None:
        """Move strands that were moved out of the head; their lengths stay."""
        for _ in range(ROUNDS):
            if not self.moved.any():
                break
            points = self.points[self.moved]
            count, many = points.shape[:2]
            offsets = np.arange(count + 1) * many
            inside = Strands(points.reshape(-1, 3).astype(np.float32), offsets)
            pushed = push_out_of_head(inside, self.room.grid, self.room.distance, CLEARANCE)
            shift = np.zeros_like(self.points)
            shift[self.moved] = (pushed.points - inside.points).reshape(points.shape)
            self.moved[:] = False
            self.move(shift)  # marks those that were inside

    def outwards(self, places: Float64Array) -> Float64Array:
        """Return the directions (N, 3) off the head at places (N, 3)."""
        return gradient(self.room.grid, self.room.distance, places)


def falloff(away: Float64Array) -> Float64Array:
    """Return what a brush does at distances in radii: 1 in its middle, 0 at its edge."""
    return np.asarray(np.clip(1 - np.minimum(away, 1) ** 2, 0, 1) ** 2)


def strokes_of(edit: Edit, usual: float) -> list[Stroke]:
    """Return a stroke along an edit's path and, where it is mirrored, along the other one."""
    setting, path = edit.setting, edit.path.astype(np.float64)
    if len(path) > 1:
        way = np.concatenate([[0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()])
        count = int(np.clip(np.ceil(way[-1] / (STEP * setting.radius)), 1, MOST_STEPS)) + 1
        path = np.stack([np.interp(np.linspace(0, way[-1], count), way, x) for x in path.T], 1)
    amount = usual if setting.amount is None else setting.amount
    sides = [path, path * MIRROR] if setting.mirror and len(path) else [path]
    rest = setting.pitch, setting.group, linear_from_hex(setting.colour, "colour")
    return [Stroke(side, setting.radius, amount, *rest) for side in sides]
