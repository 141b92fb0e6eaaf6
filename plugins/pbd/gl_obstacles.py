"""The obstacles in the layout of the compute backend's shaders."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.simulation.obstacles import Obstacles

from .reference import Contact

ROOM = 0.02
"""Least distance outside the grid, metres."""


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
    distance = body.distance
    full = np.pad(distance, ((0, 0), (0, 1), (0, 1)), mode="edge")
    parts = [full[:, :-1, :-1], full[:, :-1, 1:], full[:, 1:, :-1], full[:, 1:, 1:]]
    return np.stack(parts, axis=-1)
