"""Contact between strands: friction with the hair around and a push out of crowded places.

Hair's own points are spread on a grid as density and velocity (after Hadap and Magnenat-Thalmann,
"Modeling dynamic hair as a continuum", 2001, and McAdams et al., "Detail preserving continuum
simulation of straight hair", 2009). A point is drawn to the velocity of the hair in its cell, which
is implicit like air drag, and pushed down the slope of density where it is denser than at rest.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates

from hairkit.stored import Float64Array, Int64Array

from .recursion import Motion

CELL = 0.01
"""Metres; a lock's width."""
_BITS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


class Neighbours:
    """The hair around every point, compared with rest."""

    def __init__(self, rest: Float64Array, masses: Float64Array) -> None:
        """Keep the density at rest: `rest` (E, NODES, 3) in the head frame."""
        self._masses = masses.ravel()
        flat = rest.reshape(-1, 3)
        low = flat.min(axis=0, initial=0.0)
        grid = _Grid(flat, low)
        density, _ = grid.spread(self._masses, np.zeros_like(flat))
        self._rest = grid.gather(density)
        self._floor = float(np.median(self._rest)) if len(self._rest) else 1.0

    def act(
        self,
        motion: Motion,
        head: Float64Array,
        drag: Float64Array,
        air: Float64Array,
        masses: Float64Array,
        friction: float,
        push: float,
    ) -> tuple[Float64Array, Float64Array]:
        """Return drag (E, NODES) and the velocity it pulls to (E, NODES, 3), with the hair's part.

        `friction` is the rate, per second, at which a point in hair as dense as the median at rest
        takes on its neighbours' velocity; `push` the acceleration, metres per second squared, at
        twice the rest's density.
        """
        flat = motion.points.reshape(-1, 3)
        own = (flat - head[:3, 3]) @ head[:3, :3]
        grid = _Grid(own, own.min(axis=0, initial=0.0))
        velocity = motion.velocity.reshape(-1, 3)
        density, momentum = grid.spread(self._masses, velocity)
        here = grid.gather(density)
        around = np.stack([grid.gather(momentum[..., i]) for i in range(3)], axis=-1)
        around /= np.maximum(here, 1e-30)[:, None]
        share = np.minimum(here / self._floor, 1.0)
        rate = (friction * share * self._masses).reshape(drag.shape)
        crowded = np.maximum(here / np.maximum(self._rest, self._floor) - 1.0, 0.0)
        away = -np.stack([grid.slope(density, i) for i in range(3)], axis=-1)
        size = np.linalg.norm(away, axis=1, keepdims=True)
        away = (away / np.maximum(size, 1e-30)) @ head[:3, :3].T
        force = push * np.minimum(crowded, 1.0)[:, None] * away * self._masses[:, None]
        total = drag + rate
        pulled = drag[..., None] * air + rate[..., None] * around.reshape(air.shape)
        pulled += force.reshape(air.shape)
        return total, pulled / np.maximum(total, 1e-30)[..., None]


class _Grid:
    """Values on cell corners around points, trilinear."""

    def __init__(self, points: Float64Array, low: Float64Array) -> None:
        self.at: Float64Array = (points - low) / CELL + 1.0
        high = self.at.max(axis=0, initial=0.0)
        self.shape = tuple(np.minimum(high.astype(np.int64) + 3, 400))
        self.at = np.clip(self.at, 0, np.array(self.shape) - 1.001)

    def spread(
        self, masses: Float64Array, velocity: Float64Array
    ) -> tuple[Float64Array, Float64Array]:
        """Return mass (X, Y, Z) and momentum (X, Y, Z, 3) on the corners."""
        corner = self.at.astype(np.int64)
        t = self.at - corner
        density = np.zeros(int(np.prod(self.shape)))
        momentum = np.zeros((3, len(density)))
        for bits in _BITS:
            index: Int64Array = np.ravel_multi_index((corner + bits).T, self.shape)
            part = np.where(bits, t, 1 - t).prod(axis=1) * masses
            density += np.bincount(index, part, len(density))
            for axis in range(3):
                momentum[axis] += np.bincount(index, part * velocity[:, axis], len(density))
        return density.reshape(self.shape), np.moveaxis(momentum.reshape(3, *self.shape), 0, -1)

    def gather(self, values: Float64Array) -> Float64Array:
        """Return the values at the points, trilinear."""
        found: Float64Array = map_coordinates(values, self.at.T, order=1, mode="nearest")
        return found

    def slope(self, values: Float64Array, axis: int) -> Float64Array:
        """Return the derivative along an axis at the points, per cell."""
        return self.gather(np.gradient(values, axis=axis))
