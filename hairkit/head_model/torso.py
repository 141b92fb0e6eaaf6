"""A parametric torso under a head: superelliptic sections from the neck down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from functools import cache

import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from hairkit.types.head import Head
from hairkit.types.torso_shape import TorsoShape
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
"""Heights between which the neck, scaled with the head, turns into the torso; metres."""
KNEE = -0.075
"""Height down to which `slope` stretches the shoulders, metres."""
JOINTS_APART = 0.184
"""Metres from the root joint to the head joint of the head to which `RINGS` belong."""
_TABLE = 256
"""Levels of the sections that `inside` interpolates."""
_THINNEST = 1e-6
"""Metres; least half breadth and depth of a section that `depth` makes smaller."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Torso(TorsoShape):
    """Neck, shoulders and chest of a person, in their place under a head."""

    joint: Float64Array
    """(3,) the head's root joint, metres, head frame."""
    scale: float = 1.0
    """Size of the head."""

    @classmethod
    def under(cls, head: Head) -> Torso:
        """Return the torso under a head, in its size: the person's, or an average adult's."""
        joints = head.joints.astype(np.float64)
        apart = float(np.linalg.norm(joints[2] - joints[0]))
        shape = {} if head.torso is None else asdict(head.torso)
        return cls(joint=joints[0], scale=apart / JOINTS_APART if apart > 0 else 1.0, **shape)

    def shape(self) -> TorsoShape:
        """Return its shape without its place."""
        return TorsoShape(**{field.name: getattr(self, field.name) for field in fields(TorsoShape)})

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
        less = depth / self.scale
        centres = (np.arange(size) + 0.5 for size in grid.shape)
        x0, y0, z0 = (
            (low + at * grid.spacing - joint) / self.scale
            for low, at, joint in zip(grid.origin, centres, self.joint, strict=True)
        )
        cosine, sine = np.cos(self.yaw), np.sin(self.yaw)
        x, z = cosine * x0[:, None] - sine * z0, cosine * z0 + sine * x0[:, None]
        height = y0[:, None] + less - self.roll * x[:, None]
        found: BoolArray = height <= level[-1]
        column = np.nonzero(found)[::2]
        across, along = (
            np.abs(place[column] - np.interp(height[found], level, middle))
            / np.maximum(np.interp(height[found], level, half) - less, _THINNEST)
            for place, middle, half in ((x, left, breadth), (z, ahead, deep))
        )
        found[found] = across**EXPONENT + along**EXPONENT < 1
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
    values = _between_rings()(height)
    return values[..., 0], values[..., 1], values[..., 2]


@cache
def _between_rings() -> Callable[[Float64Array], Float64Array]:
    """Return the function from heights (...) to the numbers (..., 3) of `profile`."""
    from scipy.interpolate import PchipInterpolator  # here, since it takes as long to load as NumPy

    rings = RINGS[::-1].astype(np.float64)
    found: Callable[[Float64Array], Float64Array] = PchipInterpolator(rings[:, 0], rings[:, 1:])
    return found


def power(wave: Float64Array) -> Float64Array:
    """Return the coordinate on a unit superellipse for a sine or cosine on the circle."""
    return np.sign(wave) * np.abs(wave) ** (2 / EXPONENT)


def loft(rings: int, around: int) -> Int32Array:
    """Return the faces (F, 3) between rings that run downwards."""
    ring, step = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a = ring * around + step
    b = ring * around + (step + 1) % around
    c, d = a + around, b + around
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)])
    return faces.reshape(-1, 3).astype(np.int32)
