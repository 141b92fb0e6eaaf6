"""Shoulders under a head: a lofted torso, so that long hair has something to fall on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import distance_transform_edt, gaussian_filter

from hairkit.head import Head
from hairkit.head_distance import signed_distance
from hairkit.stored import Float32Array, Float64Array, Int32Array
from hairkit.volume import VoxelGrid

# height above the root joint, half breadth, half depth, centre behind the joint; mm, an adult
_RINGS = np.array(
    [
        [62, 46, 46, 0],
        [52, 60, 58, 0],
        [32, 72, 66, 1],
        [10, 108, 76, 3],
        [-12, 150, 86, 6],
        [-38, 182, 96, 9],
        [-75, 203, 106, 11],
        [-140, 212, 114, 12],
        [-400, 205, 122, 10],
    ]
)
_EXPONENT = 2.3
_AROUND, _RINGS_DRAWN = 96, 72
_CELL = 0.006


@dataclass(frozen=True)
class Bust:
    """A torso: a mesh to draw and a body to bump into."""

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
        height = np.linspace(float(_RINGS[0, 0]), float(_RINGS[-1, 0]), _RINGS_DRAWN)
        breadth, depth, back = _profile(height)
        angle = np.arange(_AROUND) * 2 * np.pi / _AROUND
        x = _power(np.sin(angle)) * breadth[:, None]
        z = _power(np.cos(angle)) * depth[:, None] - back[:, None]
        rings = np.stack([x, np.broadcast_to(height[:, None], x.shape), z], axis=-1) * 1e-3 + joint
        faces = _loft(_RINGS_DRAWN, _AROUND)
        vertices = rings.reshape(-1, 3)
        return cls(vertices.astype(np.float32), faces, _smooth_normals(vertices, faces), joint)

    def contains(self, points: Float64Array) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return (...,) whether points (..., 3) lie inside."""
        local = (points - self.joint) * 1e3
        low, high = _RINGS[-1, 0], _RINGS[0, 0]
        breadth, depth, back = _profile(np.clip(local[..., 1], low, high))
        across = np.abs(local[..., 0] / breadth) ** _EXPONENT
        along = np.abs((local[..., 2] + back) / depth) ** _EXPONENT
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
        grid = VoxelGrid.around(points.min(axis=0) - 0.06, points.max(axis=0) + 0.06, _CELL)
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


def _profile(height: Float64Array) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return half breadth, half depth and backward shift at heights, millimetres."""
    rings = _RINGS[::-1].astype(np.float64)
    values = PchipInterpolator(rings[:, 0], rings[:, 1:])(height)
    return values[..., 0], values[..., 1], values[..., 2]


def _power(wave: Float64Array) -> Float64Array:
    result: Float64Array = np.sign(wave) * np.abs(wave) ** (2 / _EXPONENT)
    return result


def _loft(rings: int, around: int) -> Int32Array:
    """Return the faces between rings that run downwards."""
    ring, step = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a = ring * around + step
    b = ring * around + (step + 1) % around
    c, d = a + around, b + around
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)])
    return faces.reshape(-1, 3).astype(np.int32)


def _smooth_normals(vertices: Float64Array, faces: Int32Array) -> Float32Array:
    corners = vertices[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, faces[:, corner], flat)
    length = np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)
    return np.asarray(total / length, np.float32)
