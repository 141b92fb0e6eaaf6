"""Compiled look-ups in volumes, for everything that follows a field."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.parallel import compiled, compiled_with
from hairkit.types.volume import XX, XY, XZ, YY, YZ, ZZ

BORDER_CELLS = 1.001
"""Samples are taken at most this many cells before the last, so that the next cell exists."""
SHORTEST_VECTOR = 1e-9
"""Vectors below this length have no direction."""
SMALLEST_TENSOR = 1e-6
"""Tensors that shrink a unit vector below this length have no direction."""
POWER_ROUNDS = 6
"""Power iterations; each divides the error by the ratio of the two largest eigenvalues."""


@compiled
def sample_at(
    origin: Float64Array,
    spacing: float,
    values: Float32Array,
    p: Float64Array,
    result: Float64Array,
) -> None:
    """Write the trilinear sample of values (X, Y, Z, C) at p (3,) into result (C,).

    The compiled twin of `VoxelGrid.sample` for one point; clamped at the border. `origin` (3,) is
    the grid's corner and `spacing` the edge of a cell, metres.
    """
    nx, ny, nz, channels = values.shape
    fx = min(max((p[0] - origin[0]) / spacing - 0.5, 0.0), nx - BORDER_CELLS)
    fy = min(max((p[1] - origin[1]) / spacing - 0.5, 0.0), ny - BORDER_CELLS)
    fz = min(max((p[2] - origin[2]) / spacing - 0.5, 0.0), nz - BORDER_CELLS)
    ix, iy, iz = int(fx), int(fy), int(fz)
    tx, ty, tz = fx - ix, fy - iy, fz - iz
    for c in range(channels):  # along z, then y, then x: seven mixes instead of eight products
        v00, v01 = values[ix, iy, iz, c], values[ix, iy + 1, iz, c]
        v10, v11 = values[ix + 1, iy, iz, c], values[ix + 1, iy + 1, iz, c]
        v00 += (values[ix, iy, iz + 1, c] - v00) * tz
        v01 += (values[ix, iy + 1, iz + 1, c] - v01) * tz
        v10 += (values[ix + 1, iy, iz + 1, c] - v10) * tz
        v11 += (values[ix + 1, iy + 1, iz + 1, c] - v11) * tz
        v00 += (v01 - v00) * ty
        v10 += (v11 - v10) * ty
        result[c] = v00 + (v10 - v00) * tx


@compiled_with(inside=True)
def copy_point(point: npt.NDArray[np.floating[Any]], target: npt.NDArray[np.floating[Any]]) -> None:
    """Write a point (3,) into another.

    An assignment of one slice to another compiles Numba's checks of their shapes, and with them its
    strings: five seconds of a first run.
    """
    for axis in range(3):
        target[axis] = point[axis]


@compiled_with(allocates=True)
def gradient_at(
    origin: Float64Array,
    spacing: float,
    values: Float32Array,
    p: Float64Array,
    result: Float64Array,
) -> None:
    """Write the unit gradient of values (X, Y, Z, 1) at p into result (3,); zero where flat."""
    at = np.empty(3)
    one = np.empty(1)
    for axis in range(3):
        copy_point(p, at)
        at[axis] = p[axis] + spacing
        sample_at(origin, spacing, values, at, one)
        high = one[0]
        at[axis] = p[axis] - spacing
        sample_at(origin, spacing, values, at, one)
        result[axis] = high - one[0]
    make_unit(result)


@compiled
def make_unit(vector: Float64Array) -> bool:
    """Scale vector (3,) to length 1 in place; returns False, and leaves it, where it vanishes."""
    norm = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if norm < SHORTEST_VECTOR:
        return False
    for axis in range(3):
        vector[axis] /= norm
    return True


@compiled
def principal_direction(
    tensor: Float64Array, direction: Float64Array, result: Float64Array
) -> bool:
    """Write the tensor's (6,) largest eigenvector nearest to `direction` into result (3,).

    Power iteration from `direction`, which picks the sign and, where the two largest eigenvalues
    agree, the direction. Returns False where the tensor vanishes.
    """
    x, y, z = direction[0], direction[1], direction[2]
    for k in range(POWER_ROUNDS):
        x, y, z = (
            tensor[XX] * x + tensor[XY] * y + tensor[XZ] * z,
            tensor[XY] * x + tensor[YY] * y + tensor[YZ] * z,
            tensor[XZ] * x + tensor[YZ] * y + tensor[ZZ] * z,
        )
        if k == 0 and x * x + y * y + z * z < SMALLEST_TENSOR * SMALLEST_TENSOR:
            return False
    norm = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / norm, y / norm, z / norm
    sign = -1.0 if x * direction[0] + y * direction[1] + z * direction[2] < 0 else 1.0
    result[0], result[1], result[2] = sign * x, sign * y, sign * z
    return True
