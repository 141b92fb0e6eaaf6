"""The protocol of the backends, and the reference backend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from hairkit.arrays import Float32Array, Float64Array

from .embedding import Embedding, drawn_points
from .hair_grid import HairGrid
from .linear_system import System
from .reference import Contact, Load, State, rest_state, substep, transform_points
from .rods import Rods


class Engine(Protocol):
    """A backend: the rods' state and the substeps on it."""

    state: State
    """The present state; setting it moves the rods."""
    torso_from_head: Float64Array
    """(4, 4) from the head axes to the torso's, for the points."""

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        ...

    def apply_hair_grid(
        self, hair_grid: HairGrid, head_step: Float64Array, rates: tuple[float, float, float]
    ) -> None:
        """Apply hair-hair interaction; `rates` are cohesion, pressure, seconds."""
        ...

    def points(self, embedding: Embedding, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        ...


class ReferenceEngine:
    """The reference backend: NumPy, float64."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self._rods, self._contact = rods, contact
        self.state = rest_state(rods)
        self.torso_from_head = np.eye(4)

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        for load in loads:
            self.state = substep(self._rods, system, self.state, load, self._contact, iterations)

    def apply_hair_grid(
        self, hair_grid: HairGrid, head_step: Float64Array, rates: tuple[float, float, float]
    ) -> None:
        """Apply hair-hair interaction."""
        velocity = self.state.velocity.copy()
        hair_grid.mix(self.state.position, velocity, self._rods.mass, head_step, rates)
        self.state = replace(self.state, velocity=velocity)

    def points(self, embedding: Embedding, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        state, torso = self.state, self.torso_from_head
        local = drawn_points(embedding, state.position, state.frames, self._contact, torso)
        return transform_points(head, local).astype(np.float32)
