"""The head: a triangle mesh with scalp, uv, landmarks, skin, shapes, skeleton and capsules."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int32Array, UInt8Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored
from hairkit.types.preview import Previewed, draw_turn
from hairkit.types.skin import Blendshape, SkinMaps
from hairkit.types.torso_shape import TorsoShape

LANDMARKS = 68
"""Landmarks of a face, in the order of iBUG (Sagonas et al. 2013)."""
JAW_LANDMARKS = 17
"""The first landmarks trace the jaw; detectors place them less surely."""
BROWS, EYES = slice(17, 27), (slice(36, 42), slice(42, 48))
"""Landmarks of the brows, and of the right and the left eye; their mean stands for the pupil."""


@dataclass(frozen=True, eq=False)
class Capsules(Stored):
    """Collision capsules: two spheres and what lies between them."""

    first: Float32Array
    """(C, 3) centres of the first spheres, metres."""
    second: Float32Array
    """(C, 3) centres of the second spheres."""
    radius: Float32Array
    """(C, 2) radii of the two spheres, metres."""

    def __post_init__(self) -> None:
        first = freeze(self, "first", np.float32, (None, 3), "capsule first")
        freeze(self, "second", np.float32, first.shape, "capsule second")
        freeze(self, "radius", np.float32, (len(first), 2), "capsule radius")


@dataclass(frozen=True, eq=False)
class Head(Previewed, Stored):
    """A head mesh in the head frame, faces counter-clockwise seen from outside."""

    vertices: Float32Array
    """(V, 3) metres."""
    faces: Int32Array
    """(F, 3) vertex indices."""
    uv: Float32Array
    """(V, 2) texture coordinates in [0, 1], injective over the scalp."""
    scalp: Float32Array
    """(V,) 1 where hair grows, 0 elsewhere, in between at the hairline."""
    landmark_vertices: Int32Array | None
    """(68,) vertices of the iBUG landmarks, or None on a head that has none."""
    joints: Float32Array
    """(3, 3) root, neck and head joint positions, metres."""
    capsules: Capsules
    density: Float32Array | None = None
    """(V,) density of the hair on the scalp, of that of full hair, 0 to 1; None: full hair."""
    maps: SkinMaps | None = None
    """Pictures over the texture coordinates; None: plain skin."""
    blendshapes: tuple[Blendshape, ...] = ()
    """Shapes of the head's own vertices, such as expressions."""
    eye_vertices: Int32Array | None = None
    """(2, E) vertices of the left and the right eyeball, None on a head without eyeballs."""
    torso: TorsoShape | None = None
    """The torso below; None: an average adult's."""

    def __post_init__(self) -> None:
        vertices = freeze(self, "vertices", np.float32, (None, 3), "head vertices")
        faces = freeze(self, "faces", np.int32, (None, 3), "head faces")
        if not len(faces) or faces.min() < 0 or faces.max() >= len(vertices):
            raise DataError("head faces are missing or name vertices that do not exist")
        scalp = freeze(self, "scalp", np.float32, (len(vertices),), "head scalp")
        if not (scalp > 0.5).any():
            raise DataError(
                "the head has no scalp: mark it by a vertex group, a mask texture or vertex colours"
            )
        freeze(self, "uv", np.float32, (len(vertices), 2), "head uv")
        freeze(self, "joints", np.float32, (3, 3), "head joints")
        density = freeze(self, "density", np.float32, (len(vertices),), "head density")
        if density is not None and (density.min() < 0 or density.max() > 1):
            raise DataError("head density lies outside [0, 1]")
        marks = freeze(self, "landmark_vertices", np.int32, (LANDMARKS,), "head landmark_vertices")
        if marks is not None and (marks.min() < 0 or marks.max() >= len(vertices)):
            raise DataError("head landmark_vertices name vertices that do not exist")
        self._check_shapes()

    def _check_shapes(self) -> None:
        count = len(self.vertices)
        for shape in self.blendshapes:
            if len(shape.offsets) != count:
                raise DataError(
                    f"blendshape {shape.name!r} has {len(shape.offsets)} vertices, the head {count}"
                )
        if len({shape.name for shape in self.blendshapes}) < len(self.blendshapes):
            raise DataError("two blendshapes of the head have the same name")
        if self.eye_vertices is not None:
            eyes = freeze(self, "eye_vertices", np.int32, (2, None), "head eye_vertices")
            if not eyes.size or eyes.min() < 0 or eyes.max() >= count:
                raise DataError("head eye_vertices are missing or name vertices that do not exist")

    def __repr__(self) -> str:
        marked = "with" if self.landmark_vertices is not None else "without"
        return f"Head({len(self.vertices)} vertices, {len(self.faces)} faces, {marked} landmarks)"

    def preview(self) -> UInt8Array | None:
        """Return front, left and back, (H, W, 3) uint8 RGB."""
        return draw_turn(self, None)

    def density_at(self, triangle: npt.ArrayLike, barycentric: npt.ArrayLike) -> Float32Array:
        """Return (N,) the density of the hair on faces (N,) at barycentric weights (N, 3)."""
        face, weights = np.asarray(triangle, np.int64), np.asarray(barycentric, np.float32)
        if self.density is None:
            return np.ones(len(face), np.float32)
        density: Float32Array = (self.density[self.faces[face]] * weights).sum(axis=1)
        return np.clip(density, 0, 1)

    def skin_faces(self) -> Int32Array:
        """Return the faces (F', 3) that are not those of eyeballs."""
        if self.eye_vertices is None:
            return self.faces
        return self.faces[~np.isin(self.faces, self.eye_vertices).any(axis=1)]

    def eye_centres(self) -> Float64Array | None:
        """Return (2, 3) the middles of the left and the right eyeball, metres, or None."""
        if self.eye_vertices is None:
            return None
        return np.asarray(self.vertices[self.eye_vertices].mean(axis=1, dtype=np.float64))

    def carried(self, carry: Callable[[Float32Array], Float32Array], scale: float = 1.0) -> Head:
        """Return the head whose points a map moves: vertices, shapes, joints and capsules.

        Parameters
        ----------
        carry
            Returns the new places (N, 3) of points (N, 3).
        scale
            By which the map enlarges; radii of the capsules are multiplied by it.
        """
        vertices, first, second, joints = _carry_all(
            carry, self.vertices, self.capsules.first, self.capsules.second, self.joints
        )
        shapes = tuple(
            replace(shape, offsets=carry(self.vertices + shape.offsets) - vertices)
            for shape in self.blendshapes
        )
        capsules = Capsules(first, second, np.float32(scale) * self.capsules.radius)
        return replace(
            self, vertices=vertices, blendshapes=shapes, joints=joints, capsules=capsules
        )

    def normals(self) -> Float64Array:
        """Return (V, 3) unit vertex normals, outward, weighted by face area."""
        return vertex_normals(self.vertices, self.faces)


def vertex_normals(vertices: npt.ArrayLike, faces: Int32Array) -> Float64Array:
    """Return (V, 3) unit normals of a mesh at its vertices (V, 3), weighted by face area."""
    points = np.asarray(vertices, np.float64)
    corners = points[faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    at, sums = faces.T.ravel(), [np.tile(part, 3) for part in face_normals.T]
    total = np.stack([np.bincount(at, part, len(points)) for part in sums], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(total / np.maximum(length, 1e-20))


def _carry_all(
    carry: Callable[[Float32Array], Float32Array], *groups: Float32Array
) -> list[Float32Array]:
    """Return the groups of points after one call of the map."""
    moved = carry(np.concatenate(groups))
    return np.split(moved, np.cumsum([len(group) for group in groups])[:-1])


@dataclass(frozen=True, eq=False)
class Roots(Stored):
    """Points on the scalp where strands start, and how they are bound to the head."""

    positions: Float32Array
    """(N, 3) metres."""
    normals: Float32Array
    """(N, 3) outward unit normals."""
    uv: Float32Array
    """(N, 2) texture coordinates."""
    triangle: Int32Array
    """(N,) face of the head that carries the root."""
    barycentric: Float32Array
    """(N, 3) weights of that face's corners, sum 1."""

    def __post_init__(self) -> None:
        positions = freeze(self, "positions", np.float32, (None, 3), "root positions")
        count = len(positions)
        freeze(self, "normals", np.float32, (count, 3), "root normals")
        freeze(self, "uv", np.float32, (count, 2), "root uv")
        freeze(self, "triangle", np.int32, (count,), "root triangle")
        freeze(self, "barycentric", np.float32, (count, 3), "root barycentric")

    def __len__(self) -> int:
        return len(self.positions)
