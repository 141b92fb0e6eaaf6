"""Obstacles of hair: the head and capsules as one signed distance on a grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, frozen_array
from hairkit.head_model.signed_distance import signed_distance
from hairkit.storage import Stored
from hairkit.types.head import Capsules, Head
from hairkit.types.volume import VoxelGrid

SPACING = 0.005
"""Spacing of the grid, metres."""
MARGIN = 0.03
"""Margin of the grid around head and capsules, metres."""


@dataclass(frozen=True, eq=False)
class Obstacles(Stored):
    """Signed distance to the obstacles, head frame, negative inside."""

    grid: VoxelGrid
    distance: Float32Array
    """(X, Y, Z) metres, at the cells' centres."""

    def __post_init__(self) -> None:
        values = frozen_array(self.distance, np.float32, self.grid.shape, "obstacle distance")
        object.__setattr__(self, "distance", values)

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


def head_obstacles(head: Head, spacing: float = SPACING) -> Obstacles:
    """Return the obstacles of a head: its surface, closed over holes, and its capsules.

    The capsules model the shoulders below the mesh; they move with the head.
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
