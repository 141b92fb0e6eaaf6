"""Brushes: strands combed, cut and curled by strokes over them.

A strand is its root, the directions of its segments and their lengths. Comb, part, puff, smooth and
curl change directions alone, so that lengths stay; cut, trim and lengthen change lengths alone;
roots stay in all. As in other grooming tools a stroke acts in a ball about the brush, most in its
middle. Strands that a stroke would move into the head glide along it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.errors import InputError
from hairkit.field.growth_prior import gradient
from hairkit.grooming.head_collision import push_out_of_head
from hairkit.head_model.signed_distance import signed_distance
from hairkit.options import unknown_name
from hairkit.types.edits import Edit, Edits
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands
from hairkit.types.volume import VoxelGrid

STEP, MOST_STEPS = 0.25, 2000
"""Distance, in radii, of the places along its path at which a brush acts, and how many at most."""
CLEARANCE, ROUNDS = 0.001, 6
"""Metres that hair keeps from the head, and times that it is moved out and set to its lengths."""
SHORTEST = 0.002
"""Least length of what is left of a strand that is cut, metres."""
RISE = 0.03
"""Metres from the root after which a strand follows a parting or a puff wholly."""
GOLDEN = (np.sqrt(5) - 1) / 2
"""Turns between the curls of one strand and the next, which so begin anywhere."""
NEIGHBOURS = 8
"""Strands whose mean smoothing draws to."""
CELL, MARGIN = 0.004, 0.02
"""Edge of the cells of a head's distances, and the room around the head, metres."""
UNMOVED = 1e-7
"""Metres by which a strand must move to count as changed."""
MIRROR = np.array([-1.0, 1.0, 1.0])


class HeadRoom(NamedTuple):
    """How far every place near the head is from it."""

    grid: VoxelGrid
    distance: Float32Array
    """(X, Y, Z) metres, negative inside."""

    @classmethod
    def around(cls, groom: Groom) -> HeadRoom:
        """Return the room around a groom's head."""
        low, high = groom.head.vertices.min(axis=0), groom.head.vertices.max(axis=0)
        grid = VoxelGrid.around(low - MARGIN, high + MARGIN, CELL)
        return cls(grid, signed_distance(groom.head, grid))


@dataclass(eq=False)
class Hair:
    """Strands of equal point counts under a brush."""

    points: Float64Array
    """(S, M, 3) metres, head frame."""
    room: HeadRoom

    def __post_init__(self) -> None:
        self.lengths = np.linalg.norm(np.diff(self.points, axis=1), axis=2)
        """(S, M - 1) of the segments, metres."""

    @property
    def arcs(self) -> Float64Array:
        """(S, M) metres from the root."""
        return np.concatenate([np.zeros((len(self.points), 1)), self.lengths.cumsum(axis=1)], 1)

    def move(self, shift: Float64Array) -> None:
        """Move points (S, M, 3); the segments keep their lengths and take the new directions."""
        ways = np.diff(self.points + shift, axis=1)
        size = np.linalg.norm(ways, axis=2, keepdims=True)
        ways = np.where(size > 1e-12, ways / np.maximum(size, 1e-12), 0.0)
        steps = (ways * self.lengths[..., None]).cumsum(axis=1)
        self.points = np.concatenate([self.points[:, :1], self.points[:, :1] + steps], axis=1)

    def scale(self, factor: Float64Array) -> None:
        """Make strands (S,) longer along their last direction, or cut what is beyond, again even
        in their points."""
        points, arcs = self.points, self.arcs
        share = np.linspace(0, 1, points.shape[1])
        wanted = share * (factor * arcs[:, -1])[:, None]
        after = np.clip((arcs[:, None] <= wanted[..., None]).sum(axis=2), 1, arcs.shape[1] - 1)
        row = np.arange(len(points))[:, None]
        start, end = arcs[row, after - 1], arcs[row, after]
        t = ((wanted - start) / np.maximum(end - start, 1e-12))[..., None]
        self.points = points[row, after - 1] * (1 - t) + points[row, after] * t
        self.__post_init__()

    def outside(self) -> None:
        """Move all strands out of the head; their lengths stay."""
        count, many = self.points.shape[:2]
        offsets = np.arange(count + 1) * many
        for _ in range(ROUNDS):
            inside = Strands(self.points.reshape(-1, 3).astype(np.float32), offsets)
            moved = push_out_of_head(inside, *self.room, CLEARANCE)
            shift = (moved.points - inside.points).astype(np.float64)
            self.move(shift.reshape(count, many, 3))

    def outwards(self, places: Float64Array) -> Float64Array:
        """Return the directions (N, 3) off the head at places (N, 3)."""
        grid, distance = self.room
        return gradient(grid, distance, places)


class Stroke(NamedTuple):
    """Where a brush goes, and how much it does there."""

    path: Float64Array
    """(N, 3) places `STEP` radii apart or less, in long paths more, metres; none: everywhere."""
    radius: float
    amount: float
    pitch: float

    def reach(self, points: Float64Array) -> tuple[Float64Array, Int64Array]:
        """Return how much (...) the stroke acts at points (..., 3), 0 to 1, and its place there."""
        if not len(self.path):
            return np.ones(points.shape[:-1]), np.zeros(points.shape[:-1], int)
        away, near = cKDTree(self.path).query(points)
        return _falloff(away / self.radius), near


Apply = Callable[[Hair, list[Stroke]], None]
"""Does a stroke and, where it is mirrored, the other one, both to the hair as it was before."""


def comb(hair: Hair, strokes: list[Stroke]) -> None:
    """Pull hair along the way of the brush; `amount` is the share of its way."""
    for k in range(max(len(stroke.path) for stroke in strokes) - 1):
        shift = np.zeros_like(hair.points)
        for stroke in strokes:
            at, way = stroke.path[k], stroke.path[k + 1] - stroke.path[k]
            away = np.linalg.norm(hair.points - at, axis=2) / stroke.radius
            shift += stroke.amount * _falloff(away)[..., None] * way
        hair.move(shift)


def part(hair: Hair, strokes: list[Stroke]) -> None:
    """Part hair along a line that is drawn on the scalp; `amount` is how far it goes aside, m."""
    roots = hair.points[:, 0]
    shift = np.zeros_like(hair.points)
    for stroke in strokes:
        weight, near = stroke.reach(roots)
        if len(stroke.path) > 1:
            line = np.gradient(stroke.path, axis=0)[near]
            side = np.cross(line, hair.outwards(roots))
            side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
            sign = np.sign(((roots - stroke.path[near]) * side).sum(axis=1))
            shift += _rise(hair) * (stroke.amount * weight * sign)[:, None, None] * side[:, None]
    hair.move(shift)


def puff(hair: Hair, strokes: list[Stroke]) -> None:
    """Lift hair off the head by `amount` metres."""
    weight = sum(stroke.amount * stroke.reach(hair.points)[0] for stroke in strokes)
    out = hair.outwards(hair.points[:, 0])[:, None]
    hair.move(_rise(hair) * np.asarray(weight)[..., None] * out)


def smooth(hair: Hair, strokes: list[Stroke]) -> None:
    """Draw strands to the mean shape of those around them; `amount` is the share of the way."""
    count = min(NEIGHBOURS, len(hair.points))
    near = cKDTree(hair.points[:, 0]).query(hair.points[:, 0], count)[1].reshape(-1, count)
    shape = hair.points - hair.points[:, :1]
    shape /= np.maximum(hair.arcs[:, -1:, None], 1e-9)
    mean = shape[near].mean(axis=1) * hair.arcs[:, -1:, None] + hair.points[:, :1]
    weight = sum(stroke.amount * stroke.reach(hair.points)[0] for stroke in strokes)
    hair.move(np.clip(weight, 0, 1)[..., None] * (mean - hair.points))


def curl(hair: Hair, strokes: list[Stroke]) -> None:
    """Wind strands to helices of radius `amount` metres; a turn takes `pitch` of the axis."""
    weight = sum(stroke.amount * stroke.reach(hair.points)[0] for stroke in strokes)
    way = np.gradient(hair.points, axis=1)
    way /= np.maximum(np.linalg.norm(way, axis=2, keepdims=True), 1e-12)
    across = np.cross(way, hair.outwards(hair.points[:, 0])[:, None])
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-9)
    turn = 2 * np.pi / np.hypot(strokes[0].pitch, 2 * np.pi * strokes[0].amount)
    begin = 2 * np.pi * np.modf(GOLDEN * np.arange(len(hair.points)))[0]
    angle = turn * hair.arcs + begin[:, None]
    winding = np.cos(angle)[..., None] * across + np.sin(angle)[..., None] * np.cross(way, across)
    hair.move(_rise(hair) * np.asarray(weight)[..., None] * winding)


def cut(hair: Hair, strokes: list[Stroke]) -> None:
    """Cut strands where the brush first meets them; what is beyond falls away."""
    arcs = hair.arcs
    inside = np.any([stroke.reach(hair.points)[0] > 0 for stroke in strokes], axis=0)
    last = np.where(inside[:, 1:], arcs[:, :-1], np.inf).min(axis=1)  # outside of the ball
    hair.scale(np.clip(np.maximum(last, SHORTEST) / np.maximum(arcs[:, -1], 1e-12), 0, 1))


def trim(hair: Hair, strokes: list[Stroke]) -> None:
    """Cut strands that the brush touches to a length of `amount` metres."""
    length, most = hair.arcs[:, -1], max(strokes[0].amount, SHORTEST)
    shorter = np.minimum(most / np.maximum(length, 1e-12), 1.0)
    hair.scale(np.where(_touched(hair, strokes) > 0, shorter, 1.0))


def lengthen(hair: Hair, strokes: list[Stroke]) -> None:
    """Make strands that the brush touches longer by `amount` metres."""
    longer = strokes[0].amount * _touched(hair, strokes)
    hair.scale(1 + longer / np.maximum(hair.arcs[:, -1], 1e-12))


BRUSHES: dict[str, tuple[Apply, float]] = {
    "comb": (comb, 1.0), "part": (part, 0.03), "puff": (puff, 0.01), "smooth": (smooth, 0.5),
    "curl": (curl, 0.006), "cut": (cut, 0.0), "trim": (trim, 0.03), "lengthen": (lengthen, 0.02),
}  # fmt: skip
"""Brushes by name, with their usual amounts."""


def brush_strands(
    strands: Strands, edits: Edits, room: HeadRoom, brushes: Mapping[str, tuple[Apply, float]]
) -> tuple[Strands, tuple[bool, ...]]:
    """Return strands after strokes, of equal point counts, and which strokes reached any hair.

    Raises `InputError` for a brush that there is not.
    """
    for number, edit in enumerate(edits.strokes, start=1):
        name = edit.setting.brush
        if name not in brushes:
            raise InputError(f"stroke {number}: {unknown_name('brush', name, brushes)}")
    if not edits or not len(strands):
        return strands, (False,) * len(edits.strokes)
    most = max(int(strands.counts.max()), 2)
    even = strands if (strands.counts == most).all() else strands.resampled(most)
    hair = Hair(even.points.reshape(len(even), -1, 3).astype(np.float64), room)
    reached = []
    for edit in edits.strokes:
        apply, usual = brushes[edit.setting.brush]
        strokes = _strokes(edit, usual)
        reached.append(bool(_touched(hair, strokes).any()))
        if reached[-1]:
            before = hair.points
            apply(hair, strokes)
            changed = np.abs(hair.points - before).max(axis=(1, 2)) > UNMOVED
            some = Hair(hair.points[changed], room)
            some.outside()
            points = before.copy()
            points[changed] = some.points
            hair = Hair(points, room)
    made = hair.points.reshape(-1, 3).astype(np.float32)
    return replace(even, points=made), tuple(reached)


def edit_groom(groom: Groom, edits: Edits) -> Groom:
    """Return a groom after strokes; raises `InputError` for a brush that there is not."""
    room = HeadRoom.around(groom)
    return replace(groom, strands=brush_strands(groom.strands, edits, room, BRUSHES)[0])


def _strokes(edit: Edit, usual: float) -> list[Stroke]:
    """Return a stroke along an edit's path and, where it is mirrored, along the other one."""
    setting, path = edit.setting, edit.path.astype(np.float64)
    if len(path) > 1:
        way = np.concatenate([[0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()])
        count = int(np.clip(np.ceil(way[-1] / (STEP * setting.radius)), 1, MOST_STEPS)) + 1
        path = np.stack([np.interp(np.linspace(0, way[-1], count), way, x) for x in path.T], 1)
    amount = usual if setting.amount is None else setting.amount
    sides = [path, path * MIRROR] if setting.mirror and len(path) else [path]
    return [Stroke(side, setting.radius, amount, setting.pitch) for side in sides]


def _touched(hair: Hair, strokes: list[Stroke]) -> Float64Array:
    """Return how much (S,) strokes reach of strands, at the most."""
    return np.asarray(np.max([stroke.reach(hair.points)[0].max(axis=1) for stroke in strokes], 0))


def _falloff(away: Float64Array) -> Float64Array:
    """Return what a brush does at distances in radii: 1 in its middle, 0 at its edge."""
    return np.clip(1 - away**2, 0, 1) ** 2


def _rise(hair: Hair) -> Float64Array:
    """Return (S, M, 1) how much of a shift points take: none at the root."""
    return np.clip(hair.arcs / RISE, 0, 1)[..., None]
