"""Volumes in the head frame: the grid, the hull that hair fills, the orientations in it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import cast

import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Float64Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored
from hairkit.types.torso_shape import TorsoShape

SAMPLED_AT_ONCE = 2**17
"""Points at which a grid is sampled at a time."""
MAX_CELLS = 400**3
"""Largest number of cells a grid may have."""


@dataclass(frozen=True, eq=False)
class VoxelGrid(Stored):
    """A box of cubic cells, indexed [x, y, z]; values sit at cell centres."""

    origin: Float64Array
    """(3,) lowest corner of cell (0, 0, 0), metres."""
    spacing: float
    """Edge length of a cell, metres."""
    shape: tuple[int, ...]
    """Number of cells along x, y, z."""

    def __post_init__(self) -> None:
        freeze(self, "origin", np.float64, (3,), "grid origin")
        object.__setattr__(self, "shape", tuple(int(n) for n in self.shape))
        if not (0 < self.spacing < np.inf and len(self.shape) == 3 and min(self.shape) > 0):
            raise DataError(
                f"grid needs spacing and three sizes above 0, got {self.spacing}, {self.shape}"
            )
        cells = float(np.prod(np.array(self.shape, dtype=np.float64)))
        if cells > MAX_CELLS:
            fitting = self.spacing * (cells / MAX_CELLS) ** (1 / 3)
            raise DataError(
                f"grid {self.shape} has more than {MAX_CELLS} cells; use a larger voxel size,"
                f" above {fitting:.2g} m"
            )

    @classmethod
    def around(cls, low: npt.ArrayLike, high: npt.ArrayLike, spacing: float) -> VoxelGrid:
        """Return the smallest grid of `spacing` over the box from `low` (3,) to `high` (3,)."""
        lowest, highest = np.asarray(low, np.float64), np.asarray(high, np.float64)
        shape = np.maximum(np.ceil((highest - lowest) / spacing), 1).astype(int)
        return cls(lowest, spacing, tuple(shape.tolist()))

    def centres(self) -> Float32Array:
        """Return the cell centres, (X, Y, Z, 3) float32, metres."""
        return np.stack(np.meshgrid(*self.axes(), indexing="ij"), axis=-1)

    def axes(self) -> list[Float32Array]:
        """Return where cell centres lie along x, y and z, metres."""
        steps = [np.arange(count) + 0.5 for count in self.shape]
        axes = zip(self.origin, steps, strict=True)
        return [(start + along * self.spacing).astype(np.float32) for start, along in axes]

    def centres_of(self, cells: BoolArray) -> Float32Array:
        """Return the centres (N, 3) of the cells that a mask (X, Y, Z) marks, in C order."""
        index = np.nonzero(cells)
        result = np.empty((len(index[0]), 3), np.float32)
        for i, (axis, along) in enumerate(zip(self.axes(), index, strict=True)):
            result[:, i] = axis[along]
        return result

    def index_from_head(self, points: npt.ArrayLike) -> Float64Array:
        """Return continuous indices (..., 3) of points: whole numbers fall on cell centres."""
        return (np.asarray(points, np.float64) - self.origin) / self.spacing - 0.5

    def nearest_cell(self, points: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Return the cell (..., 3) that holds each point, clamped to the grid."""
        index = np.rint(self.index_from_head(points)).astype(np.int64)
        return np.clip(index, 0, np.array(self.shape) - 1)

    def sample(self, values: npt.NDArray[np.float32], points: npt.ArrayLike) -> Float32Array:
        """Interpolate `values` (X, Y, Z) or (X, Y, Z, C) trilinearly at points (N, 3).

        Outside the grid the nearest border value holds.
        """
        if len(at := np.asarray(points)) > SAMPLED_AT_ONCE:  # what is computed of each is large
            parts = (at[k : k + SAMPLED_AT_ONCE] for k in range(0, len(at), SAMPLED_AT_ONCE))
            return np.concatenate([self.sample(values, part) for part in parts])
        index = np.clip(self.index_from_head(points), 0, np.array(self.shape) - 1)
        low = np.minimum(index.astype(np.int64), np.maximum(np.array(self.shape) - 2, 0))
        t = (index - low).astype(np.float32).T
        shares = [(1 - share, share) for share in t]
        _, ny, nz = self.shape
        strides = np.array([ny * nz, nz, 1])
        first = low @ strides
        steps = np.where(np.array(self.shape) > 1, strides, 0)  # one cell is its own neighbour
        flat = values.reshape(-1, *values.shape[3:])
        result = np.zeros((len(index), *values.shape[3:]), np.float32)
        for corner in product((0, 1), repeat=3):
            x, y, z = corner
            weight = shares[0][x] * shares[1][y] * shares[2][z]
            picked = flat[first + steps @ corner]
            result += weight.reshape(-1, *[1] * (values.ndim - 3)) * picked
        return result


@dataclass(frozen=True, eq=False)
class Hull(Stored):
    """Volume of the hair: its dense body, the looser volume that may hold strands, and the head."""

    grid: VoxelGrid
    dense: BoolArray
    """(X, Y, Z) cells that are full of hair."""
    loose: BoolArray
    """(X, Y, Z) cells that may hold hair; contains `dense`."""
    head_distance: Float32Array
    """(X, Y, Z) signed distance to the head in metres, negative inside."""
    torso: TorsoShape | None = None
    """The torso that the photos show under the hair, or None."""

    def __post_init__(self) -> None:
        shape = self.grid.shape
        dense = freeze(self, "dense", np.bool_, shape, "hull dense")
        loose = freeze(self, "loose", np.bool_, shape, "hull loose")
        if not dense.any():
            raise DataError(
                "the hull is empty: the masks of the views do not overlap in space;"
                " check masks and cameras"
            )
        if (dense & ~loose).any():
            raise DataError("hull: every dense cell must be a loose cell")
        freeze(self, "head_distance", np.float32, shape, "hull head_distance")


@dataclass(frozen=True, eq=False)
class ScalpDistance(Stored):
    """Distance of the cells of a hull from the scalp along paths through the hair."""

    values: Float32Array
    """(X, Y, Z) length of the shortest path, metres; 0 where there is none."""
    hair_length: float
    """Longest such path but for outliers, metres: how long hair can be."""

    def __post_init__(self) -> None:
        freeze(self, "values", np.float32, (None, None, None), "scalp distance")


TENSOR_INDICES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Order of the six stored components of a symmetric 3x3 tensor: xx, yy, zz, xy, xz, yz."""
XX, YY, ZZ, XY, XZ, YZ = range(len(TENSOR_INDICES))
"""Columns of the components in that order."""


@dataclass(frozen=True, eq=False)
class OrientationField(Stored):
    """3D orientation in the hull: a symmetric tensor or a direction per cell, with confidence."""

    grid: VoxelGrid
    tensor: Float32Array | None
    """(X, Y, Z, 6) xx, yy, zz, xy, xz, yz; the strand runs along the main eigenvector. None where
    `direction` says all: `tensors()` returns either."""
    confidence: Float32Array
    """(X, Y, Z) in [0, 1]; 0 where nothing is known."""
    growth: Float32Array
    """(X, Y, Z) potential, growing with the distance from the scalp through the hair: the sign."""
    direction: Float32Array | None = None
    """(X, Y, Z, 3) root to tip, where the method finds signs of its own; lengths mean nothing."""
    internal_distance: Float32Array | None = None
    """(X, Y, Z) 0 in the head, 1 at the hair's surface, beyond it 1 more than metres away over
    the cell's edge; None where the method has none."""

    def __post_init__(self) -> None:
        shape = self.grid.shape
        freeze(self, "direction", np.float32, (*shape, 3), "field direction")
        freeze(self, "internal_distance", np.float32, shape, "field internal_distance")
        freeze(self, "tensor", np.float32, (*shape, 6), "field tensor")
        if self.tensor is None and self.direction is None:
            raise DataError("the field has neither tensor nor direction")
        confidence = freeze(self, "confidence", np.float32, shape, "field confidence")
        if confidence.min() < 0 or confidence.max() > 1:
            raise DataError(
                f"field confidence lies in [{confidence.min()}, {confidence.max()}],"
                " expected [0, 1]"
            )
        freeze(self, "growth", np.float32, shape, "field growth")

    def tensors(self) -> Float32Array:
        """Return `tensor`, or d d^T (X, Y, Z, 6) of unit vectors d along `direction`.

        Cells of no direction have a tensor of zeros.
        """
        if self.tensor is not None:
            return self.tensor
        direction = cast(Float32Array, self.direction)  # one of them is there
        known = direction.any(axis=3)
        along = direction[known]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        tensor = np.zeros((*self.grid.shape, 6), np.float32)
        tensor[known] = outer_products(along)
        return tensor


def symmetric_matrices(components: npt.ArrayLike) -> Float64Array:
    """Return the (..., 3, 3) matrices of (..., 6) components in the order of `TENSOR_INDICES`."""
    six = np.asarray(components, np.float64)
    matrices = np.empty((*six.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(TENSOR_INDICES):
        matrices[..., i, j] = matrices[..., j, i] = six[..., k]
    return matrices


def outer_products(directions: npt.ArrayLike) -> Float64Array:
    """Return the (..., 6) components of d d^T for directions (..., 3)."""
    d = np.asarray(directions, np.float64)
    return np.stack([d[..., i] * d[..., j] for i, j in TENSOR_INDICES], axis=-1)


def cell_slopes(values: Float32Array, cells: BoolArray | None = None) -> Float32Array:
    """Return (X, Y, Z, 3) central differences of values (X, Y, Z), per cell.

    With `cells` (X, Y, Z), those of marked cells alone, (N, 3).
    """
    if cells is None:
        slopes = np.empty((*values.shape, 3), np.float32)
        for axis in range(3):
            slopes[..., axis] = np.gradient(values, axis=axis)
        return slopes
    at, flat = np.flatnonzero(cells), values.ravel()
    result = np.empty((len(at), 3), np.float32)
    stride = values.size
    for axis, size in enumerate(values.shape):
        stride //= size
        place = at // stride % size
        after, before = place < size - 1, place > 0
        rise = flat[at + stride * after] - flat[at - stride * before]
        result[:, axis] = rise / np.maximum(np.add(after, before, dtype=np.int8), 1)
    return result
