"""The content of an .apx file, and the way between it and a groom."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError

MaterialValue = bool | int | float | str | tuple[float, ...]
Material = MappingProxyType[str, MaterialValue]


@dataclass(frozen=True, eq=False)
class ApxAsset:
    """Content of a HairWorks file, in the file's own units, axes and numbering.

    Making one checks what HairWorks checks when it loads a file; `FormatError` says what is wrong.
    """

    vertices: Float64Array
    """(G k, 3) guides root to tip, one after the other, k points each."""
    end_indices: Int64Array
    """(G,) index of each guide's last point."""
    faces: Int64Array
    """(F, 3) guides at the corners of the growth mesh."""
    face_uvs: Float64Array
    """(F, 3, 2) texture coordinates of the corners, v downwards."""
    bone_indices: Float64Array
    """(G, 4)."""
    bone_weights: Float64Array
    """(G, 4)."""
    bone_names: tuple[str, ...]
    bind_poses: Float64Array
    """(B, 4, 4) bone to model, row vectors: the place is in the last row."""
    bone_parents: Int64Array
    """(B,) -1 for a root."""
    spheres: Float64Array
    """(N, 5) bone, radius, centre in the bone's frame."""
    capsules: Int64Array
    """(C, 2) spheres at the ends."""
    scene_unit: float
    """Centimetres in one unit."""
    up_axis: int
    """0 unknown, 1 Y, 2 Z."""
    handedness: int
    """0 unknown, 1 right, 2 left."""
    materials: tuple[Material, ...]
    info: tuple[str, ...] = ("1.1", "", "", "", "")
    """fileVersion, toolVersion, sourcePath, authorName, lastModified."""
    textures: tuple[str, ...] = ("",) * 16
    pins: Float64Array = field(default_factory=lambda: np.zeros((0, 5)))
    """(N, 5) pin constraints: bone, radius, centre in the bone's frame."""

    def __post_init__(self) -> None:
        self._check_guides()
        self._check_mesh()
        self._check_bones()
        if not (np.isfinite(self.scene_unit) and self.scene_unit > 0):
            raise FormatError(f"sceneUnit is {self.scene_unit}, expected centimetres above 0")
        if self.up_axis not in (0, 1, 2) or self.handedness not in (0, 1, 2):
            raise FormatError(
                f"upAxis {self.up_axis} and handedness {self.handedness}, expected 0, 1 or 2 each"
            )
        if not self.materials:
            raise FormatError("the file has no material, expected four")

    @property
    def guides(self) -> int:
        """Number of guides."""
        return len(self.end_indices)

    @property
    def points_per_guide(self) -> int:
        """Points of every guide."""
        return len(self.vertices) // self.guides

    def _check_guides(self) -> None:
        count = len(self.end_indices)
        if not count or not len(self.vertices):
            raise FormatError("the file has no guides")
        points = len(self.vertices) // count
        wanted = (np.arange(count) + 1) * points - 1
        if points < 2 or not np.array_equal(self.end_indices, wanted):
            raise FormatError(
                f"endIndices do not part {len(self.vertices)} vertices into {count} guides of "
                "equally many points, two or more, as HairWorks demands"
            )

    def _check_mesh(self) -> None:
        if not len(self.faces):
            raise FormatError("the growth mesh has no faces, expected at least one")
        _check_range("faceIndices", self.faces, 0, self.guides)
        if self.face_uvs.shape != (len(self.faces), 3, 2):
            raise FormatError(f"faceUVs do not match {len(self.faces)} faces")

    def _check_bones(self) -> None:
        count = len(self.bone_names)
        if len(self.bind_poses) != count or len(self.bone_parents) != count:
            raise FormatError(f"bindPoses or boneParents do not match {count} bones")
        if count:
            if len(self.bone_indices) != self.guides or len(self.bone_weights) != self.guides:
                raise FormatError(f"boneIndices or boneWeights do not match {self.guides} guides")
            _check_range("boneIndices", self.bone_indices, 0, count)
            _check_range("boneParents", self.bone_parents, -1, count)
            _check_range("boneSphereIndex", self.spheres[:, 0], 0, count)
            _check_range("pinConstraints", self.pins[:, 0], 0, count)
        elif len(self.spheres) or len(self.pins):
            raise FormatError("collision spheres and pins need bones, the file has none")
        if len(self.spheres) and self.spheres[:, 1].min() < 0:
            raise FormatError("a collision sphere has a radius below 0")
        _check_range("boneCapsuleIndices", self.capsules, 0, len(self.spheres))


def _check_range(name: str, values: npt.NDArray[np.generic], low: int, high: int) -> None:
    numbers = np.asarray(values, np.float64)
    if (
        numbers.size
        and not ((numbers >= low) & (numbers < high) & (numbers == np.round(numbers))).all()
    ):
        raise FormatError(f"{name} holds a number outside {low} to {high - 1}")
