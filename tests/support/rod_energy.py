"""Energies and generalised forces of a super-helix, as in Bertails et al. 2006, section 4."""

from __future__ import annotations

import numpy as np
from hairkit_plugins.super_helix.rods import Rods
from helix_kinematics import Placed

from hairkit.arrays import Float64Array


def mass_matrix(rod: Rods, placed: Placed) -> Float64Array:
    """Return M (3n, 3n), kilograms square metres: 1/2 q' M q' is the kinetic energy."""
    flat = placed.jacobian.reshape(-1, 3 * len(rod.lengths))
    return (flat.T * np.repeat(rod.masses.ravel(), 3)) @ flat


def potential(rod: Rods, q: Float64Array, placed: Placed, gravity: Float64Array) -> float:
    """Return the elastic energy and that of gravity, joules."""
    elastic = 0.5 * (rod.lengths[:, None] * rod.stiffness * (q - rod.natural) ** 2).sum()
    return float(elastic - (rod.masses[..., None] * placed.points * gravity).sum())


def forces(rod: Rods, q: Float64Array, placed: Placed, gravity: Float64Array) -> Float64Array:
    """Return the generalised forces -dV/dq (n, 3) of elasticity and gravity."""
    elastic = rod.lengths[:, None] * rod.stiffness * (rod.natural - q)
    weight = np.einsum("eg,i,egikj->kj", rod.masses, gravity, placed.jacobian)
    return np.asarray(elastic + weight)
