"""What the shaders are given: constants, obstacles, points, integer units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import RenderError
from hairkit.rendering.context import on_graphics_card
from hairkit.simulation.obstacles import Obstacles

from .block import constants, drift_rows
from .embedding import Embedding
from .hair_grid import SPACING, HairGrid
from .linear_system import System
from .reference import Contact
from .rods import Rods

UNITS = 2.0**30
"""Units of the mass of all hair, and of the largest momentum of a cell."""
MOST_STEPS = 64
"""Most substeps in one dispatch of the shader."""
UNROLLED = 16
"""Nodes up to which compilers unroll the shader's loops, see `pbd_layout.glsl`."""
MOST_TURNS = 64_000
"""Most loop iterations in one dispatch: Mesa's llvmpipe leaves all loops after 65536 in all."""
FULLEST, FASTEST = 32.0, 10.0
"""A cell can hold the momentum of FULLEST times the densest captured mass at FASTEST m/s."""
ROOM, NOWHERE = 0.02, -1e9
"""Least distance outside the grids of obstacles, and of points without a limit, metres."""


def constant_rows(rods: Rods, system: System, contact: Contact | None) -> Float32Array:
    """Return (S, R, 4) rows of a rod as `pbd_constants.glsl` reads them."""
    nodes, metric = constants(rods, system, contact)
    short = -metric.shape[1] % 4
    parts = [nodes.reshape(len(nodes), -1), np.pad(metric, ((0, 0), (0, short)))]
    return np.concatenate(parts, axis=1).reshape(len(nodes), -1, 4)


def steps_at_once(nodes: int, iterations: int) -> int:
    """Return how many substeps the shader may do in one dispatch.

    Raises `RenderError` if a software renderer cannot do one.
    """
    if nodes <= UNROLLED:
        return MOST_STEPS
    segments = nodes - 1
    # the factor of the lengths takes four entries in a turn, a row for each segment before
    turns = iterations * (segments**3 // 24 + segments**2 + 5 * segments) + 20 * nodes
    if turns > MOST_TURNS and not on_graphics_card():
        raise RenderError(
            f"{nodes} nodes with {iterations} iterations take {turns} loop iterations, expected at"
            f" most {MOST_TURNS} on a software renderer; lower either, or set pbd.backend=fast"
        )
    return min(max(MOST_TURNS // turns, 1), MOST_STEPS)


def contact_uniforms(contact: Contact | None) -> dict[str, Any]:
    """Return the uniforms of contacts."""
    if contact is None:
        return {"u_obstacles": False}
    torso = contact.bodies.torso
    grids = [body.grid for body in (contact.bodies.head, torso or contact.bodies.head)]
    return {
        "u_obstacles": True,
        "u_torso": torso is not None,
        "u_friction": contact.friction,
        "u_fastest": contact.fastest,
        "u_rounds": contact.rounds,
        "u_cells": [grid.shape for grid in grids],
        "u_grid": [(*(grid.origin + 0.5 * grid.spacing), 1 / grid.spacing) for grid in grids],
        "u_room": ROOM,
    }


def faces(body: Obstacles | None) -> Float32Array:
    """Return (X, Y, Z, 4) distances of the corners (y, z), (y, z + 1), (y + 1, z), both + 1."""
    if body is None:
        return np.zeros((1, 1, 1, 4), np.float32)
    full = np.pad(body.distance, ((0, 0), (0, 1), (0, 1)), mode="edge")
    parts = [full[:, :-1, :-1], full[:, :-1, 1:], full[:, 1:, :-1], full[:, 1:, 1:]]
    return np.stack(parts, axis=-1)


def point_words(embedding: Embedding, deepest: Float64Array | None) -> Float32Array:
    """Return (P, 8): offset in the rod's frame, share; segment, least distance, length, 0."""
    least = np.full(len(embedding.rod), NOWHERE) if deepest is None else deepest
    parts = (*embedding.offset.T, embedding.share, embedding.segment, least, embedding.length)
    return np.stack([*parts, 0 * least], axis=1).astype(np.float32)


def between_words(
    before: npt.NDArray[np.integer[Any]], part: npt.NDArray[np.floating[Any]]
) -> npt.NDArray[np.int32]:
    """Return (N, 2): the point before; the bits of the float32 fraction."""
    parts = np.ascontiguousarray(part, np.float32).view(np.int32)
    return np.stack([before.ravel().astype(np.int32), parts.ravel()], axis=1)


@dataclass(frozen=True, eq=False)
class Units:
    """Integer units of the hair grid: integer sums do not depend on their order."""

    hair_grid: HairGrid
    mass: float
    """Units in a kilogram: all hair in one cell does not overflow."""
    momentum: float
    """Units of momentum in a unit of mass at 1 m/s."""
    capacity: float
    """Units of mass whose momentum does not overflow; fuller cells count as at rest."""

    @classmethod
    def of(cls, hair_grid: HairGrid) -> Units:
        """Return the units of a hair grid."""
        total = float(hair_grid.density.sum())
        capacity = min(1.0, FULLEST * float(hair_grid.density.max()) / total) * UNITS
        return cls(hair_grid, UNITS / total, UNITS / (capacity * FASTEST), capacity)

    def uniforms(
        self, head_step: Float64Array, rates: tuple[float, float, float]
    ) -> dict[str, Any]:
        """Return the uniforms of the hair-grid passes."""
        cohesion, pressure, seconds = rates
        return {
            "u_cells": self.hair_grid.density.shape,
            "u_grid": (*self.hair_grid.origin, 1 / SPACING),
            "u_drift": [tuple(row) for row in drift_rows(head_step, seconds)],
            "u_momentum": self.momentum,
            "u_capacity": self.capacity,
            "u_rates": (1 - np.exp(-cohesion * seconds), pressure * seconds),
        }
