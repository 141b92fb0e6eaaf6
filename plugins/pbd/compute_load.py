"""What a step asks of the compute backend, as the words that its shaders read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hairkit.simulate import rotation
from hairkit.stored import Float32Array, Float64Array

from .crowd import SPACING, Crowd
from .reference import Contact, Load

ROOM = 0.02
"""Metres around the grid of distances in which nothing is looked up."""
UNITS = 2.0**30
"""Units of mass that all hair has, and of momentum that a cell holds."""
MOST_STEPS = 64
"""Substeps in one run of the shader."""
FULLEST, FASTEST = 32.0, 10.0
"""A cell holds the momentum of the densest captured cell's mass so many times, at so many m/s."""


def step_words(loads: Sequence[Load], step: float) -> Float32Array:
    """Return (MOST_STEPS, 10, 4) words of substeps: see `Step` in the shader."""
    words = np.zeros((MOST_STEPS, 10, 4))
    for k, load in enumerate(loads):
        words[k, :3] = load.ride[:3]
        words[k, 3:6] = drift_rows(load.ride, step)
        words[k, 6:9, :3] = load.turn
        words[k, 6:9, 3] = load.turn @ load.gravity
        words[k, 9] = np.roll(rotation.from_matrix(load.ride[:3, :3]), -1)
    return words.astype(np.float32)


def drift_rows(ride: Float64Array, seconds: float) -> Float64Array:
    """Return (3, 4) that gives the velocity of points which ride on the head, head axes, m/s."""
    result: Float64Array = (np.eye(4) - ride)[:3] / seconds
    return result


def touching(contact: Contact | None) -> dict[str, Any]:
    """Return the uniforms of contacts."""
    if contact is None:
        return {"u_obstacles": False}
    grid = contact.obstacles.grid
    return {
        "u_obstacles": True,
        "u_friction": contact.friction,
        "u_fastest": contact.fastest,
        "u_cells": grid.shape,
        "u_grid": (*(grid.origin + 0.5 * grid.spacing), 1 / grid.spacing),
        "u_room": ROOM,
    }


def faces(contact: Contact | None) -> Float32Array:
    """Return (X, Y, Z, 4) distances of the corners (y, z), (y, z + 1), (y + 1, z), both + 1."""
    if contact is None:
        return np.zeros((1, 1, 1, 4), np.float32)
    distance = contact.obstacles.distance
    full = np.pad(distance, ((0, 0), (0, 1), (0, 1)), mode="edge")
    parts = [full[:, :-1, :-1], full[:, :-1, 1:], full[:, 1:, :-1], full[:, 1:, 1:]]
    return np.stack(parts, axis=-1)


@dataclass(frozen=True, eq=False)
class Units:
    """Whole numbers that a crowd is summed up in: the sum does not depend on the order."""

    crowd: Crowd
    mass: float
    """Units in a kilogram: all hair in one cell does not overflow."""
    momentum: float
    """Units of momentum in a unit of mass at 1 m/s."""
    capacity: float
    """Units of mass whose momentum does not overflow; fuller cells count as at rest."""

    @classmethod
    def of(cls, crowd: Crowd) -> Units:
        """Return the units of a crowd."""
        total = float(crowd.density.sum())
        capacity = min(1.0, FULLEST * float(crowd.density.max()) / total) * UNITS
        return cls(crowd, UNITS / total, UNITS / (capacity * FASTEST), capacity)

    def uniforms(self, ride: Float64Array, rates: tuple[float, float, float]) -> dict[str, Any]:
        """Return what the passes over the crowd's grid need."""
        cohesion, pressure, seconds = rates
        return {
            "u_cells": self.crowd.shape,
            "u_grid": (*self.crowd.origin, 1 / SPACING),
            "u_drift": [tuple(row) for row in drift_rows(ride, seconds)],
            "u_momentum": self.momentum,
            "u_capacity": self.capacity,
            "u_rates": (1 - np.exp(-cohesion * seconds), pressure * seconds),
        }
