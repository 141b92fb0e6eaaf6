"""Small motions of the rods against physics: tones of beams, strings, heavy strings, a rod."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hairkit_plugins.rods.rods import Rods, rest_state
from rods_bench import DENSITY, DOWN, LENGTH, G, inertia_of, rods_of, straight
from rods_modes import linearised
from scipy.special import jn_zeros

from hairkit.arrays import Float64Array

NODES = 41


def tones(rods: Rods, force: Float64Array | None, free: Float64Array | None = None) -> Float64Array:
    """Return the lowest three angular frequencies; each stands for two planes."""
    small = linearised(rods, rest_state(rods), force, free)
    return np.sqrt(small.squares(inertia_of(rods)[0])[:6:2])


def test_a_beam_has_three_tones() -> None:
    """omega = k^2 sqrt(EI / (rho A L^4)) with cos k cosh k = -1: to 0.1, 0.4 and 0.8 %."""
    rods = rods_of(straight(1, NODES), DENSITY, 1e-8, straight=True)
    k = np.array([1.87510407, 4.69409113, 7.85475744])
    error = tones(rods, None) / (k**2 * np.sqrt(1e-8 / DENSITY / LENGTH**4)) - 1
    assert (np.abs(error) < [0.001, 0.004, 0.008]).all()


def test_a_heavy_string_has_bessels_tones() -> None:
    """omega = j / 2 sqrt(g / L), j the zeros of J_0: to 0.05, 0.3 and 1.1 %.

    Tension w x from the tip: (x u')' + omega^2 u / g = 0, u = J_0(2 omega sqrt(x / g)).
    """
    rods = rods_of(straight(1, NODES, (0, -1, 0)), DENSITY, 1e-18, straight=True)
    error = tones(rods, rods.mass[0][:, None] * DOWN) / (jn_zeros(0, 3) / 2 * np.sqrt(G / LENGTH))
    assert (np.abs(error - 1) < [0.0005, 0.003, 0.011]).all()


def test_a_taut_string_has_harmonic_tones() -> None:
    """omega = n pi / L sqrt(T / rho A), the tip led along the string: to 0.5 %."""
    tension = 1e-4
    rods = rods_of(straight(1, NODES), DENSITY, 1e-16, straight=True)
    force = np.zeros((NODES, 3))
    force[-1, 0] = tension
    law = np.arange(1, 4) * np.pi / LENGTH * np.sqrt(tension / DENSITY)
    found = tones(rods, force, np.eye(3 * NODES)[:, 3:-2])
    np.testing.assert_allclose(found, law, rtol=0.005)


def test_a_rigid_rod_swings_on_a_hinge() -> None:
    """T = 2 pi sqrt(2 L / 3 g): weight at L / 2, inertia rho A L^3 / 3; to 0.1 %."""
    rods = rods_of(straight(1, NODES, (0, -1, 0)), DENSITY, 1e-4, straight=True)
    hinged = rods.bend.copy()
    hinged[:, 0] = 0.0
    rods = replace(rods, bend=hinged)
    period = 2 * np.pi / tones(rods, rods.mass[0][:, None] * DOWN)[0]
    np.testing.assert_allclose(period, 2 * np.pi * np.sqrt(2 * LENGTH / (3 * G)), rtol=1e-3)
