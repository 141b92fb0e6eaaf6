"""Pack a substep's inputs for the shaders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import RenderError
from hairkit.rendering.context import on_graphics_card
from hairkit.simulation import quaternion

from .hair_grid import SPACING, HairGrid
from .reference import Load, TorsoStep

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

AirWaves: TypeAlias = tuple[Float64Array, Float64Array, Float64Array]
"""Vectors (M, 3), amplitudes (M, 3) and phases (M,) of `hairkit.simulation.wind.gust_waves`."""


def step_words(loads: Sequence[Load], step: float) -> Float32Array:
    """Return (MOST_STEPS, 16, 4) words of substeps: see `Step` in the shader."""
    words = np.zeros((MOST_STEPS, 16, 4))
    for k, load in enumerate(loads):
        words[k, :3] = load.head_step[:3]
        words[k, 3:6] = drift_rows(load.head_step, step)
        words[k, 6:9, :3] = load.turn
        words[k, 6:9, 3] = load.turn @ load.gravity
        words[k, 9] = np.roll(quaternion.from_matrix(load.head_step[:3, :3]), -1)
        torso = load.torso or TorsoStep(np.eye(4), load.head_step)
        words[k, 10:13] = torso.from_head[:3]
        words[k, 13:16] = drift_rows(torso.step, step)
    return words.astype(np.float32)


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


def air_uniforms(waves: AirWaves, wind: Float64Array, head: Float64Array) -> dict[str, Any]:
    """Return the uniforms of gusts on a head at `head`: waves in its axes, the air in the world."""
    vectors, amplitudes, phases = waves
    # reduced here in float64; float32 would lose digits
    turned = np.fmod(phases + vectors @ head[:3, 3], 2 * np.pi)
    local = np.concatenate([vectors @ head[:3, :3], turned[:, None]], axis=1)
    return {
        "u_mean": tuple(wind),
        "u_waves": [tuple(wave) for wave in local],
        "u_amplitudes": [(*amplitude, 0.0) for amplitude in amplitudes],
    }


def drift_rows(head_step: Float64Array, seconds: float) -> Float64Array:
    """Return rows (3, 4) that map a point to the velocity of the head there, head axes, m/s."""
    result: Float64Array = (np.eye(4) - head_step)[:3] / seconds
    return result


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
            "u_cells": self.hair_grid.shape,
            "u_grid": (*self.hair_grid.origin, 1 / SPACING),
            "u_drift": [tuple(row) for row in drift_rows(head_step, seconds)],
            "u_momentum": self.momentum,
            "u_capacity": self.capacity,
            "u_rates": (1 - np.exp(-cohesion * seconds), pressure * seconds),
        }
