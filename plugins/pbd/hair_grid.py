"""Hair among hair: density and velocity of all nodes on a grid around the head.

Nodes are spread to a grid in the head frame and read back (Petrovic, Henne and Anderson 2005;
particle-in-cell): velocities are drawn to those of the neighbours, which is friction between hairs,
and where hair is denser than it was when captured, nodes are pushed to thinner places. At rest the
grid has no say: nothing moves, and nothing is denser than captured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import Float64Array, Int64Array

from .reference import State, moved

SPACING = 0.02
"""Metres between the grid's values: some distances between guides."""
ROOM = 0.1
"""How far the grid goes beyond the captured hair, metres."""
_BITS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])


@dataclass(frozen=True, eq=False)
class Crowd:
    """The grid and what it held at rest."""

    origin: Float64Array
    """(3,) place of the first value, head frame."""
    shape: tuple[int, int, int]
    density: Float64Array
    """(C,) kilograms a value at rest."""

    @property
    def usual(self) -> Float64Array:
        """(X, Y, Z) what counts as not crowded: as captured, or a quarter of the densest."""
        least = max(0.25 * float(self.density.max(initial=0.0)), 1e-30)
        return np.maximum(self.density, least).reshape(self.shape)

    def rubbed(
        self,
        state: State,
        mass: Float64Array,
        ride: Float64Array,
        rates: tuple[float, float, float],
    ) -> State:
        """Return the state with velocities after hair has acted on hair; roots keep theirs.

        `ride` (4, 4) is how the head moves meanwhile, `rates` are cohesion, pressure, seconds.
        """
        cohesion, pressure, seconds = rates
        riding = (state.position - moved(ride, state.position)) / seconds
        relative = state.velocity - riding
        new = self.velocities(
            state.position.reshape(-1, 3), relative.reshape(-1, 3), mass.reshape(-1),
            cohesion, pressure, seconds,
        ).reshape(relative.shape)  # fmt: skip
        new[:, 0] = relative[:, 0]
        return replace(state, velocity=new + riding)

    def velocities(
        self,
        position: Float64Array,
        velocity: Float64Array,
        mass: Float64Array,
        cohesion: float,
        pressure: float,
        seconds: float,
    ) -> Float64Array:
        """Return velocities (N, 3) after `seconds` among each other.

        Parameters
        ----------
        position, velocity, mass
            (N, 3), (N, 3) relative to the head, and (N,) of the nodes.
        cohesion
            1/s, at which a node takes on its neighbours' velocity.
        pressure
            m/s^2 of push at twice the captured density, over one cell's distance.
        seconds
            How long.
        """
        corner, weight = self._corners(position)
        share = weight * mass[:, None]
        filled = self._summed(corner, share)
        result = velocity
        if cohesion > 0:
            cells = (
                np.stack(
                    [self._summed(corner, share * velocity[:, k, None]) for k in range(3)], axis=-1
                )
                / np.maximum(filled, 1e-30)[:, None]
            )
            mean = np.einsum("nc,nck->nk", weight, cells[corner])
            result = velocity + (1 - np.exp(-cohesion * seconds)) * (mean - velocity)
        if pressure > 0:
            usual = self.usual.reshape(-1)
            crowded = np.maximum(filled - usual, 0.0) / usual
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

    def _summed(self, corner: Int64Array, value: Float64Array) -> Float64Array:
        cells = int(np.prod(self.shape))
        return np.bincount(corner.ravel(), value.ravel(), cells).astype(np.float64)


def crowd_of(position: Float64Array, mass: Float64Array) -> Crowd:
    """Return the grid of nodes (N, 3) at rest."""
    origin = position.min(axis=0) - ROOM
    size = np.ceil((position.max(axis=0) + ROOM - origin) / SPACING).astype(int) + 1
    shape = (int(size[0]), int(size[1]), int(size[2]))
    empty = Crowd(origin, shape, np.zeros(int(np.prod(size))))
    corner, weight = empty._corners(position)
    return Crowd(origin, shape, empty._summed(corner, weight * mass[:, None]))
