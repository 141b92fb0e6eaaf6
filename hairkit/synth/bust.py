"""Shoulders under a head: a lofted torso, on which long hair lies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from hairkit.arrays import Float32Array, Float64Array, Int32Array
from hairkit.head_model.signed_distance import signed_distance
from hairkit.head_model.torso import EXPONENT, RINGS, loft, power, profile
from hairkit.types.head import Head, vertex_normals
from hairkit.types.volume import VoxelGrid

_AROUND, _RINGS_DRAWN = 96, 72
_CELL = 0.006
"""Edge of the obstacle's cells, metres."""
_MARGIN = 0.06
"""Metres around head and torso in which the distance is known; strands farther off are free."""


@dataclass(frozen=True)
class Bust:
    """A torso: a mesh to draw and an obstacle for hair."""

    vertices: Float32Array
    """(V, 3) metres, head frame."""
    faces: Int32Array
    """(F, 3), counter-clockwise seen from outside."""
    normals: Float32Array
    """(V, 3) outward unit normals."""
    joint: Float64Array
    """(3,) the head's root joint, on which the torso is placed."""

    @classmethod
    def under(cls, head: Head) -> Bust:
        """Return the torso that belongs under a head."""
        joint = head.joints[0].astype(np.float64)
        height = np.linspace(float(RINGS[0, 0]), float(RINGS[-1, 0]), _RINGS_DRAWN)
        breadth, depth, back = profile(height)
        angle = np.arange(_AROUND) * 2 * np.pi / _AROUND
        x = power(np.sin(angle)) * breadth[:, None]
        z = power(np.cos(angle)) * depth[:, None] - back[:, None]
        rings = np.stack([x, np.broadcast_to(height[:, None], x.shape), z], axis=-1) * 1e-3 + joint
        faces = loft(_RINGS_DRAWN, _AROUND)
        vertices = rings.reshape(-1, 3)
        normals = vertex_normals(vertices, faces).astype(np.float32)
        return cls(vertices.astype(np.float32), faces, normals, joint)

    def contains(self, points: Float64Array) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return (...,) whether points (..., 3) lie inside."""
        local = (points - self.joint) * 1e3
        low, high = RINGS[-1, 0], RINGS[0, 0]
        breadth, depth, back = profile(np.clip(local[..., 1], low, high))
        across = np.abs(local[..., 0] / breadth) ** EXPONENT
        along = np.abs((local[..., 2] + back) / depth) ** EXPONENT
        return np.asarray((across + along < 1) & (local[..., 1] <= high))


@dataclass(frozen=True)
class Obstacle:
    """Signed distance to head and torso with its gradient, for growing hair around them."""

    grid: VoxelGrid
    field: Float32Array
    """(X, Y, Z, 4) distance in metres, negative inside, and its unit gradient."""

    @classmethod
    def of(cls, head: Head, bust: Bust) -> Obstacle:
        """Return the distance to both bodies on a grid of 6 mm cells."""
        points = np.concatenate([head.vertices, bust.vertices])
        grid = VoxelGrid.around(points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN, _CELL)
        inside = bust.contains(grid.centres().astype(np.float64))
        outer = distance_transform_edt(~inside) - 0.5
        inner = distance_transform_edt(inside) - 0.5
        torso = gaussian_filter(np.where(inside, -inner, outer).astype(np.float32) * _CELL, 1.0)
        distance = np.minimum(torso, signed_distance(head, grid))
        gradient = np.stack(np.gradient(distance, _CELL), axis=-1)
        gradient /= np.maximum(np.linalg.norm(gradient, axis=-1, keepdims=True), 1e-6)
        return cls(grid, np.concatenate([distance[..., None], gradient], -1).astype(np.float32))

    def at(self, points: Float32Array) -> tuple[Float32Array, Float32Array]:
        """Return distances (N, 1) and gradients (N, 3) at points (N, 3)."""
        values = self.grid.sample(self.field, points)
        return values[:, :1], values[:, 1:]
