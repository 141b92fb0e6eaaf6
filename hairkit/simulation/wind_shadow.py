"""What head and hair leave of the wind behind them.

Air gives hair the momentum that it loses: where drag accelerates hair at the rate c to the air's
speed U, rho_air U dU/dx = -c rho_hair U. So it is in a canopy of plants, whose drag is quadratic
(Belcher, Jerram and Hunt 2003). With c of 2/s 8 cm of long hair take all of a wind of 6 m/s.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled_with
from hairkit.simulation.hair_cells import Cells, cell_of
from hairkit.simulation.hair_grid import SPACING, HairGrid
from hairkit.simulation.obstacles import Bodies
from hairkit.simulation.vectors import ONE, ZERO, Floats

AIR, HAIRS, SOLID = 1.2, 1e5, 1e6
"""Density of air, kg/m^3; hairs of a head, for which guides stand; loss in it, m/s: none passes."""


def wind_losses(hair: HairGrid, strands: int, strand: float, bodies: Bodies) -> Floats:
    """Return what a wind loses in cells (X, Y, Z), m/s for a drag of 1/s, to hair and head.

    A strand, of mass `strand` in a cell, takes none from itself: hair counts beyond one strand.
    """
    mass = np.maximum(hair.density - strand, 0.0) * HAIRS / max(strands, 1)
    at = hair.origin + SPACING * np.moveaxis(np.indices(hair.density.shape), 0, -1)
    inside = np.clip(0.5 - bodies.head.at(at)[0] / SPACING, 0.0, 1.0)
    return (mass / (AIR * SPACING**2) + SOLID * inside).astype(np.float32)


def passing_wind(
    loss: Floats, origin: Float64Array, place: Floats, wind: Float64Array, drag: float
) -> Floats:
    """Return the share (N,) of a wind (3,), m/s, not 0, that reaches places (N, 3), head axes.

    `loss` is that of `wind_losses`, in cells from `origin` (3,); `drag` that of the hair, 1/s.
    """
    axis = int(np.abs(wind).argmax())
    turn = [axis, (axis + 1) % 3, (axis + 2) % 3]
    speed, side = abs(wind[axis]), slice(None, None, 1 if wind[axis] > 0 else -1)
    lost = np.ascontiguousarray(loss.transpose(turn)[side] * np.float32(drag / speed))
    left = march_downwind(lost, (wind[turn] / speed).astype(np.float32))[side]
    cells = Cells(origin, 1 / SPACING)
    return look_up(place, cells, np.ascontiguousarray(left.transpose(np.argsort(turn))))


@compiled_with(allocates=True, fastmath=True)
def march_downwind(lost: Floats, shift: Floats) -> Floats:
    """Return the share (X, Y, Z) of a wind along +X that reaches each corner, slice by slice.

    `lost` goes at each corner; `shift` (3,), up to 1, is the way to the next slice, in cells.
    """
    slices, rows, columns = lost.shape
    left, beyond = np.ones_like(lost), np.ones((rows + 2, columns + 2), lost.dtype)
    y, z = 0 if shift[1] > ZERO else 1, 0 if shift[2] > ZERO else 1
    b, c = ONE - np.float32(y) - shift[1], ONE - np.float32(z) - shift[2]
    for i in range(1, slices):
        beyond[1:-1, 1:-1] = np.maximum(left[i - 1] - lost[i - 1], ZERO)
        near = (ONE - b) * beyond[y : y + rows] + b * beyond[y + 1 : y + 1 + rows]
        left[i] = (ONE - c) * near[:, z : z + columns] + c * near[:, z + 1 : z + 1 + columns]
    return left


@compiled_with(allocates=True, fastmath=True)
def look_up(place: Floats, cells: Cells, left: Floats) -> Floats:
    """Return what is `left` at places (N, 3), trilinear."""
    shares = np.zeros(len(place), place.dtype)
    for n in range(len(place)):
        i, j, k, (a, b, c) = cell_of(place[n], cells, left)
        for bit in range(8):
            up, over, on = bit >> 2, bit >> 1 & 1, bit & 1
            part = (a if up else ONE - a) * (b if over else ONE - b) * (c if on else ONE - c)
            shares[n] += part * left[i + up, j + over, k + on]
    return shares
