"""Axes and unit of length of files: every conversion from and to the head frame.

The head frame is right-handed, +X the subject's left, +Y up, +Z out of the face, in metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.options import option

_ROTATIONS = {
    "y_up": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "z_up": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "unreal": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
}
"""Rows are the file's axes in the head frame. z_up looks along -Y as Blender's heads do; unreal is
left-handed and looks along +Y as a head does that Unreal imported from an FBX file."""

SPACES = {
    "y_up_metres": ("y_up", 1.0),
    "y_up_centimetres": ("y_up", 0.01),
    "z_up_metres": ("z_up", 1.0),
    "z_up_centimetres": ("z_up", 0.01),
    "unreal": ("unreal", 0.01),
}
"""Values of `axis`: the axes and the metres per unit of each."""


@dataclass(frozen=True)
class FileSpace:
    """Transform between a file's coordinates and the head frame."""

    axes: str = "y_up"
    """`y_up`, `z_up` (both right-handed) or `unreal` (left-handed, Z up)."""
    metres: float = 1.0
    """Metres in one unit of the file."""
    file_from_head: Float64Array = field(init=False, repr=False, compare=False)
    """(3, 3) orthogonal; lengths are not changed by it."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "file_from_head", np.array(_ROTATIONS[self.axes]))

    @cached_property
    def mirrored(self) -> bool:
        """True when faces have to be turned over, because the file is left-handed."""
        return bool(np.linalg.det(self.file_from_head) < 0)

    def points_to_file(self, points: npt.ArrayLike) -> Float32Array:
        """Return points (..., 3) of the head frame in the file's axes and unit."""
        return self.directions_to_file(points, 1.0 / self.metres)

    def points_to_head(self, points: npt.ArrayLike) -> Float32Array:
        """Return points (..., 3) of the file in the head frame, metres."""
        return _turn_vectors(points, self.file_from_head.T, self.metres)

    def directions_to_file(self, directions: npt.ArrayLike, factor: float = 1.0) -> Float32Array:
        """Return vectors (..., 3) in the file's axes, their lengths times `factor`."""
        return _turn_vectors(directions, self.file_from_head, factor)

    def faces_to_file(self, faces: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
        """Return triangles (F, 3) that still face outward in the file (and back again)."""
        return np.ascontiguousarray(faces[:, ::-1]) if self.mirrored else faces

    def transform_to_file(self, matrix: npt.ArrayLike) -> Float64Array:
        """Return a head frame transform (..., 4, 4) of column vectors as one of the file's."""
        turn = np.eye(4)
        turn[:3, :3] = self.file_from_head / self.metres
        return turn @ np.asarray(matrix, np.float64) @ np.linalg.inv(turn)


def _turn_vectors(vectors: npt.ArrayLike, turn: Float64Array, factor: float) -> Float32Array:
    """Signed permutations are written out: no rounding but that of the unit, and fast."""
    with np.errstate(over="ignore"):  # readers refuse what is not finite, in their own words
        source = np.asarray(vectors, np.float32)
        if np.array_equal(turn, np.eye(3)):
            # a read-only array may be shared
            alike = factor == 1.0 and not source.flags.writeable
            return source if alike else source * np.float32(factor)
        result = np.empty_like(source)
        for row in range(3):
            column = int(np.abs(turn[row]).argmax())
            scale = np.float32(factor * turn[row, column])
            np.multiply(source[..., column], scale, out=result[..., row])
    return result


@dataclass(frozen=True)
class SpaceOptions:
    """Options of every format that has no axes and unit of its own; plugins inherit them."""

    axis: str = option(
        "y_up_metres", choices=tuple(SPACES), doc="Axes and unit of the file, written or read."
    )
    scale: float = option(
        0.0, low=0.0, doc="Metres in one unit of the file; 0 takes the unit of `axis`.", unit="m"
    )

    @property
    def space(self) -> FileSpace:
        """The file's space."""
        axes, metres = SPACES[self.axis]
        chosen = self.scale if self.scale > 0 and math.isfinite(self.scale) else metres
        return FileSpace(axes, chosen)
