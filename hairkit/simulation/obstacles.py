"""Obstacles of hair: signed distances on grids, one that moves with the head, one with the torso.

The head's has its surface and its capsules. The torso's is that of the bust that pictures show,
which gives way to the captured hair; a mesh that does not end at its neck has none of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Float64Array, freeze
from hairkit.head_model.bust import bust_under
from hairkit.head_model.signed_distance import signed_distance
from hairkit.parallel import parallel_for
from hairkit.storage import Stored
from hairkit.types.groom import Groom
from hairkit.types.head import Capsules, Head
from hairkit.types.volume import VoxelGrid

from .obstacle_kernels import NO_FIELDS, WORTH, Field, Fields, depths

SPACING = 0.005
"""Spacing of the grid, metres."""
SHOULDER = 0.005
"""Metres above the root joint that a capsule reaches at least which is not a shoulder's."""
MARGIN = 0.03
"""Margin of a grid around what it is of, metres."""


@dataclass(frozen=True, eq=False)
class Obstacles(Stored):
    """Signed distance to the obstacles, head frame, negative inside."""

    grid: VoxelGrid
    distance: Float32Array
    """(X, Y, Z) metres, at the cells' centres."""

    def __post_init__(self) -> None:
        freeze(self, "distance", np.float32, self.grid.shape, "obstacle distance")

    def at(self, points: npt.ArrayLike) -> tuple[Float64Array, Float64Array]:
        """Return distance (N,) and outward unit direction (N, 3) at points (N, 3), head frame.

        The distance is trilinear, the direction its exact gradient; outside the grid the distance
        is 1 m.
        """
        at = (np.asarray(points, np.float64) - self.grid.origin) / self.grid.spacing - 0.5
        top = np.array(self.grid.shape) - 1
        outside = ((at < 0) | (at > top)).any(axis=-1)
        low = np.clip(np.floor(at), 0, top - 1).astype(np.int64)
        t = np.clip(at - low, 0.0, 1.0)
        value = np.zeros(at.shape[:-1])
        slope = np.zeros(at.shape)
        for corner in range(8):
            bits = np.array([corner >> 2 & 1, corner >> 1 & 1, corner & 1])
            found = self.distance[tuple(np.moveaxis(low + bits, -1, 0))].astype(np.float64)
            part = np.where(bits == 1, t, 1 - t)
            value += found * part.prod(axis=-1)
            for axis in range(3):
                others = part[..., (axis + 1) % 3] * part[..., (axis + 2) % 3]
                slope[..., axis] += found * others * (2 * bits[axis] - 1)
        length = np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-12)
        return np.where(outside, 1.0, value), slope / length

    def field(self) -> Field:
        """Return the distances as compiled code takes them."""
        return Field(
            self.grid.origin + 0.5 * self.grid.spacing, self.grid.spacing, self.distance.copy()
        )


@dataclass(frozen=True, eq=False)
class Bodies:
    """What hair touches: the head, and the torso, whose place against the head varies."""

    head: Obstacles
    """Head axes."""
    torso: Obstacles | None = None
    """Axes that are the head's at rest; None where there is none."""
    joint: Float64Array = field(default_factory=lambda: np.zeros(3))
    """(3,) the neck joint, about which the head turns against the torso, metres, rest."""

    def at(
        self, points: npt.ArrayLike, torso_from_head: Float64Array | None = None
    ) -> tuple[Float64Array, Float64Array, BoolArray]:
        """Return distance (N,), direction (N, 3) and whether (N,) the torso is the nearer one.

        `points` (N, 3) and directions are in head axes; `torso_from_head` (4, 4) brings head axes
        to the torso's; None: at rest.
        """
        at = np.asarray(points, np.float64)
        distance, normal = self.head.at(at)
        if self.torso is None:
            return distance, normal, np.zeros(distance.shape, np.bool_)
        pose = np.eye(4) if torso_from_head is None else torso_from_head
        beside, away = self.torso.at(at @ pose[:3, :3].T + pose[:3, 3])
        nearer = beside < distance
        normal = np.where(nearer[..., None], away @ pose[:3, :3], normal)
        return np.where(nearer, beside, distance), normal, nearer

    def deepest(
        self, points: Float64Array, torso_from_head: Float64Array, least: Float64Array
    ) -> float:
        """Return by how much a point (P, 3), head axes, is nearer than `least` (P,) or 0."""
        depth = np.zeros(len(points))
        least = np.minimum(least, 0.0)
        parallel_for(
            depths, len(points), self.fields, torso_from_head, points, least, depth, min_chunk=WORTH
        )
        return float(depth.max(initial=0.0))

    @cached_property
    def fields(self) -> Fields:
        """Return the distances as compiled code takes them; an absent torso has no values."""
        torso = NO_FIELDS.torso if self.torso is None else self.torso.field()
        return Fields(self.head.field(), torso)


_NOWHERE = VoxelGrid(np.zeros(3), SPACING, (2, 2, 2))
NO_BODIES = Bodies(Obstacles(_NOWHERE, np.ones(_NOWHERE.shape, np.float32)))
"""Where there is nothing to touch: everything is 1 m away."""


def groom_bodies(groom: Groom, spacing: float = SPACING) -> Bodies:
    """Return what a groom's hair touches.

    Under a head that ends at its neck there is a torso, and the head's capsules that lie below its
    root joint, shoulders, are left out.
    """
    root, joint = groom.head.joints[:2].astype(np.float64)
    bust = bust_under(groom.head, groom.strands)
    if bust is None:
        return Bodies(head_obstacles(groom.head, spacing), None, joint)
    grid = VoxelGrid.around(
        bust.vertices.min(axis=0) - MARGIN, bust.vertices.max(axis=0) + MARGIN, spacing
    )
    torso = Obstacles(grid, signed_distance(bust, grid))
    shapes = groom.head.capsules
    above = np.maximum(shapes.first[:, 1], shapes.second[:, 1]) > root[1] + SHOULDER
    kept = Capsules(shapes.first[above], shapes.second[above], shapes.radius[above])
    return Bodies(head_obstacles(replace(groom.head, capsules=kept), spacing), torso, joint)


def head_obstacles(head: Head, spacing: float = SPACING) -> Obstacles:
    """Return the obstacles of a head: its surface, closed over holes, and its capsules.

    They move with the head.
    """
    shapes = head.capsules
    balls = np.concatenate([shapes.first, shapes.second])
    radius = shapes.radius.T.reshape(-1, 1)
    low = np.concatenate([head.vertices, balls - radius]).min(axis=0) - MARGIN
    high = np.concatenate([head.vertices, balls + radius]).max(axis=0) + MARGIN
    grid = VoxelGrid.around(low, high, spacing)
    distance = signed_distance(head, grid)
    centres = grid.centres().reshape(-1, 3)
    for capsule in range(len(radius) // 2):
        one = Capsules(
            shapes.first[capsule : capsule + 1],
            shapes.second[capsule : capsule + 1],
            shapes.radius[capsule : capsule + 1],
        )
        distance = np.minimum(distance, capsule_distance(one, centres).reshape(grid.shape))
    return Obstacles(grid, distance)


def capsule_distance(capsules: Capsules, points: npt.ArrayLike) -> Float32Array:
    """Return the distance (N,) of points (N, 3) to the nearest capsule, negative inside.

    The radius of a capsule is linear along its axis.
    """
    at = np.asarray(points, np.float32)
    best = np.full(len(at), np.inf, np.float32)
    for first, second, radius in zip(capsules.first, capsules.second, capsules.radius, strict=True):
        axis = second - first
        share = (at - first) @ axis / max(float(axis @ axis), 1e-12)
        share = np.clip(share, 0.0, 1.0)[:, None]
        gap = np.linalg.norm(at - first - share * axis, axis=1)
        mixed = radius[0] * (1 - share[:, 0]) + radius[1] * share[:, 0]
        best = np.minimum(best, (gap - mixed).astype(np.float32))
    return best
