"""Kinematics of a super-helix: the readable NumPy form, one strand at a time.

The frame travels as F' = F [q]x with q = (twist, curvature, curvature) constant on an element, the
point as r' = F e1 (Bertails et al. 2006, equations 3 to 5). A change dq of an element turns all
that follows by F_e l A(l q) dq, A the mean rotation, and moves its point at s by F_e D(s) dq.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hairkit_plugins.super_helix.rods import SHARES, Rods
from helix_slopes import mean_rotation_slope

from hairkit.arrays import Float64Array
from hairkit.helices.helix import mean_rotation, rotation

_TANGENT = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class Placed:
    """A strand of n elements in the world."""

    points: Float64Array
    """(n, NODES, 3) Gauss points."""
    ends: Float64Array
    """(n + 1, 3) ends of the elements, the root first."""
    frames: Float64Array
    """(n + 1, 3, 3) frames there."""
    jacobian: Float64Array
    """(n, NODES, 3, n, 3) derivative of the Gauss points by the coordinates."""


def place(rod: Rods, q: Float64Array, root: Float64Array, frame: Float64Array) -> Placed:
    """Return a single strand with coordinates q (n, 3), clamped at root (3,) with frame (3, 3)."""
    length, count = rod.lengths, len(q)
    frames, ends = np.empty((count + 1, 3, 3)), np.empty((count + 1, 3))
    frames[0], ends[0] = frame, root
    turn, step = rotation(length[:, None] * q), moves(q, length)
    for e in range(count):
        frames[e + 1] = frames[e] @ turn[e]
        ends[e + 1] = ends[e] + frames[e] @ step[e]
    s = length[:, None] * SHARES
    local = moves(q[:, None], s)
    points = ends[:-1, None] + (frames[:-1, None] @ local[..., None])[..., 0]
    return Placed(points, ends, frames, _jacobian(q, length, points, ends, frames))


def moves(q: Float64Array, s: Float64Array) -> Float64Array:
    """Return (..., 3) the point at arc length s in the element's first frame."""
    return s[..., None] * mean_rotation(s[..., None] * q)[..., 0]


def move_slopes(q: Float64Array, s: Float64Array) -> Float64Array:
    """Return (..., 3, 3) the derivative D(s) of `moves` by q."""
    slope = mean_rotation_slope(s[..., None] * q, _TANGENT)
    return (s * s)[..., None, None] * slope


def _jacobian(
    q: Float64Array,
    length: Float64Array,
    points: Float64Array,
    ends: Float64Array,
    frames: Float64Array,
) -> Float64Array:
    count = len(q)
    spin = frames[:-1] @ (length[:, None, None] * mean_rotation(length[:, None] * q))
    shift = frames[:-1] @ move_slopes(q, length)
    inside = frames[:-1, None] @ move_slopes(q[:, None], length[:, None] * SHARES)
    result = np.zeros((*points.shape, count, 3))
    for e in range(count):
        result[e, :, :, e] = inside[e]
        for before in range(e):
            arm = points[e] - ends[before + 1]
            result[e, :, :, before] = shift[before] + np.cross(
                spin[before].T[None], arm[:, None]
            ).swapaxes(1, 2)
    return result
