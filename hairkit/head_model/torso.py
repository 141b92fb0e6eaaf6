"""A torso by few numbers: superelliptic sections from the neck down, placed under a head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit, prange

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from hairkit.types.head import Head
from hairkit.types.volume import VoxelGrid

RINGS = np.array(
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
"""Height above the root joint, half breadth, half depth, centre behind the joint; mm, an adult."""
EXPONENT = 2.3
"""e of the sections' outlines |x / breadth|^e + |z / depth|^e = 1."""
NECK, CHEST = 0.052, -0.038
"""Heights between which the neck, which has the head's size, becomes the torso; metres."""
KNEE = -0.075
"""Height down to which `slope` stretches the shoulders, metres."""
JOINTS_APART = 0.184
"""Metres from the root joint to the head joint of the head to which `RINGS` belong."""
_TABLE = 256


@dataclass(frozen=True, eq=False)
class Torso:
    """Neck, shoulders and chest of a person; ratios are to an adult's, lengths to the head's."""

    joint: Float64Array
    """(3,) the head's root joint, metres, head frame."""
    scale: float = 1.0
    """Size of the head."""
    breadth: float = 1.0
    """Ratio, of shoulders and chest."""
    depth: float = 1.0
    """Ratio, of shoulders and chest."""
    drop: float = 0.0
    """Metres that the torso lies lower."""
    slope: float = 1.0
    """Ratio of the way down from the neck to the shoulders' ends."""
    forward: float = 0.0
    """Metres that the chest lies further in front."""
    lean: float = 0.0
    """Metres further in front for each metre up."""
    sideways: float = 0.0
    """Metres that the chest lies further to the subject's left."""
    roll: float = 0.0
    """Metres that the shoulders rise for each metre to the left."""
    yaw: float = 0.0
    """Radians that the chest is turned to the subject's left."""

    @classmethod
    def under(cls, head: Head) -> Torso:
        """Return an adult's torso under a head, in the head's size."""
        joints = head.joints.astype(np.float64)
        apart = float(np.linalg.norm(joints[2] - joints[0]))
        return cls(joints[0], apart / JOINTS_APART if apart > 0 else 1.0)

    @property
    def top(self) -> float:
        """Height of its upper end, metres in the head frame."""
        return float(self.joint[1] + self.scale * (RINGS[0, 0] * 1e-3 - self.drop))

    def surface(self, heights: npt.ArrayLike, around: int) -> Float64Array:
        """Return points (R, around, 3) of the sections at heights (R,) of an adult's torso, metres
        above the joint; each section runs from the chest over the subject's left."""
        breadth, depth, ahead, left, level = self._sections(np.asarray(heights, np.float64))
        angle = np.arange(around) * 2 * np.pi / around
        x = power(np.sin(angle)) * breadth[:, None] + left[:, None]
        z = power(np.cos(angle)) * depth[:, None] + ahead[:, None]
        y = level[:, None] + self.roll * x
        cosine, sine = np.cos(self.yaw), np.sin(self.yaw)
        local = np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=-1)
        return self.joint + self.scale * local

    def mesh(self, rings: int = 48, around: int = 48) -> tuple[Float32Array, Int32Array]:
        """Return vertices (V, 3) and faces (F, 3), counter-clockwise from outside, ends open."""
        heights = np.linspace(RINGS[0, 0], RINGS[-1, 0], rings) * 1e-3
        return self.surface(heights, around).reshape(-1, 3).astype(np.float32), loft(rings, around)

    def inside(self, grid: VoxelGrid, depth: float = 0.0) -> BoolArray:
        """Return (X, Y, Z) the cells that lie deeper than `depth` metres in the torso.

        Sections are made smaller, and lie lower, by `depth`; the torso goes on below its last one.
        """
        heights = np.linspace(RINGS[-1, 0], RINGS[0, 0], _TABLE) * 1e-3
        breadth, deep, ahead, left, level = self._sections(heights)
        even = np.linspace(level[0], level[-1], _TABLE)
        less = depth / self.scale
        table = [np.interp(even, level, part) for part in (breadth, deep, ahead, left)]
        table[:2] = [np.maximum(part - less, 1e-6) for part in table[:2]]
        first = (grid.origin + 0.5 * grid.spacing - self.joint) / self.scale
        turn = np.array([np.cos(self.yaw), np.sin(self.yaw), self.roll])
        found: BoolArray = _inside(
            first, grid.spacing / self.scale, grid.shape, turn, even - less, np.stack(table, 1)
        )
        return found

    def _sections(self, height: Float64Array) -> tuple[Float64Array, ...]:
        """Return half breadth, half depth, middle along z and x, and level (R,) at heights (R,)."""
        breadth, depth, back = (part * 1e-3 for part in profile(height * 1e3))
        share = np.clip((NECK - height) / (NECK - CHEST), 0.0, 1.0)
        top = RINGS[0, 0] * 1e-3
        steep, below = np.maximum(height, KNEE) - top, np.minimum(height - KNEE, 0.0)
        level = top + self.slope * steep + below - self.drop
        return (
            breadth * (1 + (self.breadth - 1) * share),
            depth * (1 + (self.depth - 1) * share),
            self.forward * share + self.lean * level - back,
            self.sideways * share,
            level,
        )


def profile(height: Float64Array) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return half breadth, half depth and backward shift of an adult at heights, millimetres."""
    from scipy.interpolate import PchipInterpolator  # as slow to load as NumPy

    rings = RINGS[::-1].astype(np.float64)
    values = PchipInterpolator(rings[:, 0], rings[:, 1:])(height)
    return values[..., 0], values[..., 1], values[..., 2]


def power(wave: Float64Array) -> Float64Array:
    """Return a sine or cosine as it runs around a superellipse instead of a circle."""
    result: Float64Array = np.sign(wave) * np.abs(wave) ** (2 / EXPONENT)
    return result


def loft(rings: int, around: int) -> Int32Array:
    """Return the faces (F, 3) between rings that run downwards."""
    ring, step = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a = ring * around + step
    b = ring * around + (step + 1) % around
    c, d = a + around, b + around
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)])
    return faces.reshape(-1, 3).astype(np.int32)


@njit(cache=True, parallel=True)
def _inside(first, spacing, shape, turn, levels, table):  # type: ignore[no-untyped-def]
    found = np.zeros(shape, np.bool_)
    last = len(levels) - 1
    rise = (levels[last] - levels[0]) / last
    for i in prange(shape[0]):
        for k in range(shape[2]):
            x0, z0 = first[0] + i * spacing, first[2] + k * spacing
            x = turn[0] * x0 - turn[1] * z0
            z = turn[0] * z0 + turn[1] * x0
            for j in range(shape[1]):
                at = (first[1] + j * spacing - turn[2] * x - levels[0]) / rise
                if at > last:
                    break
                at = min(max(at, 0.0), last - 1e-9)
                low = int(at)
                t = at - low
                across = abs(x - table[low, 3] - t * (table[low + 1, 3] - table[low, 3]))
                along = abs(z - table[low, 2] - t * (table[low + 1, 2] - table[low, 2]))
                across /= table[low, 0] + t * (table[low + 1, 0] - table[low, 0])
                along /= table[low, 1] + t * (table[low + 1, 1] - table[low, 1])
                if across < 1 and along < 1:
                    found[i, j, k] = across**EXPONENT + along**EXPONENT < 1
    return found
