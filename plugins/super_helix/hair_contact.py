"""Contact between strands: friction with the hair around and a push out of crowded places.

Hair's own points are spread on a grid as density and velocity (after Hadap and Magnenat-Thalmann,
"Modeling dynamic hair as a continuum", 2001, and McAdams et al., "Detail preserving continuum
simulation of straight hair", 2009). A point is drawn to the velocity of the hair in its cell, which
is implicit like air drag, and pushed down the slope of density where it is denser than at rest.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled
from hairkit.simulation.hair_cells import Cells, around, cell_of, spread_nodes

CELL = 0.01
"""Edge of a cell in metres: about the width of a lock."""
ROOM = 0.3
"""Metres around the hair at rest that the grid covers."""
WIDEST = 256
"""Cells along an edge of the grid at most; points beyond are clamped to its border."""


class Neighbours:
    """The hair around every point, compared with rest."""

    def __init__(self, rest: Float64Array, masses: Float64Array) -> None:
        """Keep the density at rest: `rest` (E, NODES, 3) in the head frame."""
        self._masses = np.ascontiguousarray(masses.ravel())
        points = np.ascontiguousarray(rest.reshape(-1, 3))
        low = points.min(axis=0) - ROOM
        size = np.minimum((points.max(axis=0) + ROOM - low) / CELL, WIDEST).astype(np.int64) + 2
        self._cells, self._corners = Cells(low, 1 / CELL), np.zeros((*size, 4))
        found = self._around(points, np.zeros_like(points), 1.0)
        self._rest = found[:, 0]
        self._floor = float(np.median(self._rest))

    def act(
        self,
        points: Float64Array,
        velocity: Float64Array,
        drag: Float64Array,
        air: Float64Array,
        friction: float,
        push: float,
        head: Float64Array,
    ) -> tuple[Float64Array, Float64Array]:
        """Return a drag (E, NODES) and the velocity (E, NODES, 3) it pulls to, the hair's included.

        Parameters
        ----------
        points, velocity
            (E, NODES, 3) of the Gauss points now.
        drag, air
            (E, NODES) kilograms per second and (E, NODES, 3) metres per second, of the air.
        friction
            Rate, per second, at which a point in hair as dense as the median at rest takes on the
            speed of its neighbours.
        push
            Acceleration, metres per second squared, at twice the density of rest.
        head
            (4, 4) from the head frame to the world. Cells go with the head: in cells that stand
            elsewhere at each step hair would never come to rest.
        """
        flat = (points.reshape(-1, 3) - head[:3, 3]) @ head[:3, :3]
        found = self._around(flat, velocity.reshape(-1, 3), self._floor)
        density, around, away = found[:, 0], found[:, 1:4], found[:, 4:]
        rate = friction * np.minimum(density / self._floor, 1.0) * self._masses
        crowded = np.clip(density / np.maximum(self._rest, self._floor) - 1.0, 0.0, 1.0)
        force = (push * crowded * self._masses)[:, None] * (away @ head[:3, :3].T)
        total = drag + rate.reshape(drag.shape)
        pulled = (rate[:, None] * around + force).reshape(air.shape) + drag[..., None] * air
        return total, pulled / np.maximum(total, 1e-30)[..., None]

    def _around(self, points: Float64Array, velocity: Float64Array, floor: float) -> Float64Array:
        """Return (P, 7) density, mean velocity, and the direction of falling density.

        The direction is shorter than 1 where the density hardly falls: within a cell by less than
        `floor`.
        """
        result = np.empty((len(points), 7))
        nodes = points[None, None], velocity[None, None], self._masses[None, None]
        spread_nodes(0, 1, *nodes, np.zeros((3, 4)), self._cells, self._corners[None])
        gather(points, self._cells, self._corners, floor, result)
        clear(points, self._cells, self._corners)
        return result


@compiled
def gather(
    points: Float64Array, cells: Cells, corners: Float64Array, floor: float, result: Float64Array
) -> None:
    """Write density, mean velocity and the direction of falling density at the points."""
    for p in range(len(points)):
        density, momentum, slope = around(cell_of(points[p], cells, corners), corners)
        size = np.sqrt(slope[0] ** 2 + slope[1] ** 2 + slope[2] ** 2 + floor**2)
        result[p, 0] = density
        for axis in range(3):
            result[p, 1 + axis] = momentum[axis] / max(density, 1e-30)
            result[p, 4 + axis] = -slope[axis] / max(size, 1e-30)


@compiled
def clear(points: Float64Array, cells: Cells, corners: Float64Array) -> None:
    """Set the corners (X, Y, Z, 4) of the points' cells to 0: far fewer than the grid has."""
    for p in range(len(points)):
        i, j, k, _ = cell_of(points[p], cells, corners)
        corners[i : i + 2, j : j + 2, k : k + 2] = 0.0
