"""Hair-hair interaction: density and velocity of all nodes on a grid around the head.

Nodes are splatted to a grid in the head frame and interpolated back (Petrovic, Henne and Anderson
2005; particle-in-cell): velocities relax to the local mean, which models friction between hairs,
and nodes move out of cells that are denser than in the captured hair. At rest the grid has no
effect: nothing moves, and no cell is denser than captured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import Float64Array, Int64Array

from .reference import State, transform_points

SPACING = 0.02
"""Edge of a cell, metres: several distances between guides."""
ROOM = 0.1
"""Margin around the captured hair, metres."""
_BITS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])


@dataclass(frozen=True, eq=False)
class HairGrid:
    """The grid and its mass at rest."""

    origin: Float64Array
    """(3,) position of the first cell, head frame."""
    shape: tuple[int, int, int]
    density: Float64Array
    """(C,) mass of each cell at rest, kilograms."""

    @property
    def uncrowded_mass(self) -> Float64Array:
        """(X, Y, Z) mass up to which a cell is not crowded: at rest, or 1/4 of the densest cell."""
        least = max(0.25 * float(self.density.max(initial=0.0)), 1e-30)
        return np.maximum(self.density, least).reshape(self.shape)

    def mix_velocities(
        self,
        state: State,
        mass: Float64Array,
        head_step: Float64Array,
        rates: tuple[float, float, float],
    ) -> State:
        """Return the state after hair-hair interaction; roots keep their velocity.

        `head_step` (4, 4) is the head motion of the step, `rates` are cohesion, pressure, seconds.
        """
        cohesion, pressure, seconds = rates
        head_velocity = (state.position - transform_points(head_step, state.position)) / seconds
        relative = state.velocity - head_velocity
        new = self.velocities(
            state.position.reshape(-1, 3), relative.reshape(-1, 3), mass.reshape(-1),
            cohesion, pressure, seconds,
        ).reshape(relative.shape)  # fmt: skip
        new[:, 0] = relative[:, 0]
        return replace(state, velocity=new + head_velocity)

    def velocities(
        self,
        position: Float64Array,
        velocity: Float64Array,
        mass: Float64Array,
        cohesion: float,
        pressure: float,
        seconds: float,
    ) -> Float64Array:
        """Return velocities (N, 3) after `seconds` of interaction.

        Parameters
        ----------
        position, velocity, mass
            (N, 3), (N, 3) relative to the head, and (N,) of the nodes.
        cohesion
            1/s, rate of relaxation to the mean velocity around.
        pressure
            m/s^2 at twice the captured density, over the distance of one cell.
        seconds
            Duration.
        """
        corner, weight = self._corners(position)
        share = weight * mass[:, None]
        filled = self._splat(corner, share)
        result = velocity
        if cohesion > 0:
            cells = (
                np.stack(
                    [self._splat(corner, share * velocity[:, k, None]) for k in range(3)], axis=-1
                )
                / np.maximum(filled, 1e-30)[:, None]
            )
            mean = np.einsum("nc,nck->nk", weight, cells[corner])
            result = velocity + (1 - np.exp(-cohesion * seconds)) * (mean - velocity)
        if pressure > 0:
            uncrowded_mass = self.uncrowded_mass.reshape(-1)
            crowded = np.maximum(filled - uncrowded_mass, 0.0) / uncrowded_mass
            field = np.minimum(crowded, 4.0).reshape(self.shape)
            push = np.einsum("nck,nc->nk", self._slopes(position), field.reshape(-1)[corner])
            result = result - pressure * seconds * push
        return result

    def _slopes(self, position: Float64Array) -> Float64Array:
        """(N, 8, 3) weights whose sum with the corners' values is the gradient within the cell."""
        at = np.clip((position - self.origin) / SPACING, 0.0, np.array(self.shape) - 1.001)
        t = (at - np.floor(at))[:, None]
        part = np.where(_BITS, t, 1 - t)
        sign = 2.0 * _BITS - 1.0
        pairs = [(1, 2), (0, 2), (0, 1)]
        return np.stack(
            [sign[:, k] * part[..., a] * part[..., b] for k, (a, b) in enumerate(pairs)], axis=-1
        )

    def _corners(self, position: Float64Array) -> tuple[Int64Array, Float64Array]:
        """Numbers (N, 8) of the cells about each node and their weights (N, 8)."""
        at = (position - self.origin) / SPACING
        at = np.clip(at, 0.0, np.array(self.shape) - 1.001)
        low = at.astype(np.int64)
        t = at - low
        weight = np.where(_BITS, t[:, None], 1 - t[:, None]).prod(axis=-1)
        stride = np.array([self.shape[1] * self.shape[2], self.shape[2], 1])
        return (low[:, None] + _BITS) @ stride, weight

    def _splat(self, corner: Int64Array, value: Float64Array) -> Float64Array:
        cells = int(np.prod(self.shape))
        return np.bincount(corner.ravel(), value.ravel(), cells).astype(np.float64)


def make_hair_grid(position: Float64Array, mass: Float64Array) -> HairGrid:
    """Return the grid of nodes (N, 3) at rest."""
    origin = position.min(axis=0) - ROOM
    size = np.ceil((position.max(axis=0) + ROOM - origin) / SPACING).astype(int) + 1
    shape = (int(size[0]), int(size[1]), int(size[2]))
    empty = HairGrid(origin, shape, np.zeros(int(np.prod(size))))
    corner, weight = empty._corners(position)
    return HairGrid(origin, shape, empty._splat(corner, weight * mass[:, None]))
