"""What runs substeps: the contract of the backends, and the reference behind it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hairkit.arrays import Float32Array, Float64Array

from .hair_grid import Crowd
from .linear_system import System
from .reference import Contact, Load, State, at_rest, moved, substep, uncovered
from .resampling import Riders
from .rods import Rods


class Engine(Protocol):
    """Rods in motion, in whatever form suits the backend."""

    state: State
    """The present state; setting it moves the rods."""

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        ...

    def rub(self, crowd: Crowd, ride: Float64Array, rates: tuple[float, float, float]) -> None:
        """Let hair act on hair: cohesion, pressure, seconds."""
        ...

    def rod(self, rod: int) -> tuple[Float64Array, Float64Array]:
        """Return places and velocities (n, 3) of one rod, head axes."""
        ...

    def points(self, riders: Riders, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        ...


class ReferenceEngine:
    """The plain one: float64 throughout."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self._rods, self._contact = rods, contact
        self.state = at_rest(rods)

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        for load in loads:
            self.state = substep(self._rods, system, self.state, load, self._contact, iterations)

    def rub(self, crowd: Crowd, ride: Float64Array, rates: tuple[float, float, float]) -> None:
        """Let hair act on hair."""
        self.state = crowd.rubbed(self.state, self._rods.mass, ride, rates)

    def rod(self, rod: int) -> tuple[Float64Array, Float64Array]:
        """Return places and velocities (n, 3) of one rod, head axes."""
        return self.state.position[rod], self.state.velocity[rod]

    def points(self, riders: Riders, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        local = riders.points(self.state.position, self.state.frames).astype(np.float64)
        if self._contact is not None and not riders.identity:
            local = uncovered(local, self._contact)
        return moved(head, local).astype(np.float32)
