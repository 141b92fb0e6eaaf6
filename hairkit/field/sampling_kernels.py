"""Compiled look-ups in volumes, for everything that walks through a field."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, inline="always")
def sample_at(origin, spacing, values, p, result):  # type: ignore[no-untyped-def]
    """Write the trilinear sample of values (X, Y, Z, C) at p (3,) into result (C,).

    The compiled twin of `VoxelGrid.sample` for one point; clamped at the border.
    """
    nx, ny, nz, channels = values.shape
    fx = min(max((p[0] - origin[0]) / spacing - 0.5, 0.0), nx - 1.001)
    fy = min(max((p[1] - origin[1]) / spacing - 0.5, 0.0), ny - 1.001)
    fz = min(max((p[2] - origin[2]) / spacing - 0.5, 0.0), nz - 1.001)
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


@njit(cache=True)
def gradient_at(origin, spacing, values, p, result):  # type: ignore[no-untyped-def]
    """Write the unit gradient of values (X, Y, Z, 1) at p into result (3,); zero where flat."""
    at = np.empty(3)
    one = np.empty(1)
    for axis in range(3):
        at[:] = p
        at[axis] = p[axis] + spacing
        sample_at(origin, spacing, values, at, one)
        high = one[0]
        at[axis] = p[axis] - spacing
        sample_at(origin, spacing, values, at, one)
        result[axis] = high - one[0]
    make_unit(result)


@njit(cache=True, inline="always")
def make_unit(vector):  # type: ignore[no-untyped-def]
    """Scale vector (3,) to length 1 in place; returns False, and leaves it, where it vanishes."""
    norm = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if norm < 1e-9:
        return False
    for axis in range(3):
        vector[axis] /= norm
    return True


@njit(cache=True)
def principal_direction(tensor, direction, result):  # type: ignore[no-untyped-def]
    """Write the tensor's (6,) largest eigenvector nearest to `direction` into result (3,).

    Six rounds of power iteration from `direction`, which picks the sign and, where the tensor is
    undecided, keeps the way straight. Returns False where the tensor vanishes.
    """
    x, y, z = direction[0], direction[1], direction[2]
    for _ in range(6):
        a = tensor[0] * x + tensor[3] * y + tensor[4] * z
        b = tensor[3] * x + tensor[1] * y + tensor[5] * z
        c = tensor[4] * x + tensor[5] * y + tensor[2] * z
        norm = np.sqrt(a * a + b * b + c * c)
        if norm < 1e-6:
            return False
        x, y, z = a / norm, b / norm, c / norm
    sign = -1.0 if x * direction[0] + y * direction[1] + z * direction[2] < 0 else 1.0
    result[0], result[1], result[2] = sign * x, sign * y, sign * z
    return True
