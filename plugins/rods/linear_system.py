"""The linear system of a substep, constant for a constant time step.

An implicit step for nodes with mass, drag, bending and shape springs solves `A delta = force`, with

    A = M / t^2 + C / t + K_bend + K_shape,  t = 2 h / 3,

one banded matrix for all three coordinates, since the bending energy is quadratic. Lengths are
constraints with multipliers along the directions d; their Schur complement is the elementwise
product (D A^-1 D^T) * (d d^T), of which only d changes between substeps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float64Array

from .rods import Rods

IMPLICIT = 2 / 3
"""Weight of the new acceleration in the velocity, that of the old one being the rest: backward
differences of second order (Curtiss and Hirschfelder 1952). Stiff motion halves in a step."""
COMPLIANCE = 1e-6
"""Relative increase of the diagonal of the length system, which keeps it definite in float32."""


@dataclass(frozen=True, eq=False)
class Rates:
    """Drag, damping and pull to the captured shape."""

    drag: Float64Array
    """(S, n) rate of air drag, 1/s."""
    damping: float
    """Rate of damping of motion relative to the head, 1/s."""
    shape: Float64Array
    """(S, n) squared frequency of the pull to the captured shape, 1/s^2."""


@dataclass(frozen=True, eq=False)
class System:
    """Matrices of a substep for each rod."""

    step: float
    """Seconds h."""
    matrix: Float64Array
    """(S, n - 1, n - 1) A, kg/s^2, for the free nodes 1 to n - 1: two bands below its diagonal."""
    metric: Float64Array
    """(S, n - 1, n - 1) D A^-1 D^T of the segments' vectors, with the compliance."""
    rates: Rates


def assemble(rods: Rods, rates: Rates, step: float) -> System:
    """Return the system of substeps of `step` seconds."""
    count = rods.nodes - 1
    difference = np.eye(count) - np.eye(count, k=-1)
    bending = (difference / rods.length[:, None, :]) @ difference
    inner = IMPLICIT * step
    firm = 1 / inner**2 + (rates.drag + rates.damping) / inner + rates.shape
    diagonal = (rods.mass * firm)[:, 1:]
    matrix = np.einsum("sij,si,sik->sjk", bending, rods.bend, bending)
    # a rigid bar has thirds and sixths of its mass
    matrix -= difference.T @ (rods.bars[..., None] / (6 * inner**2) * difference)
    matrix[:, np.arange(count), np.arange(count)] += diagonal
    metric = difference @ np.linalg.inv(matrix) @ difference.T
    metric[:, np.arange(count), np.arange(count)] *= 1 + COMPLIANCE
    return System(step, matrix, metric, rates)
