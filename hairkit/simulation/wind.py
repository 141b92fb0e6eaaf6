"""Wind: a mean velocity and turbulent gusts as a function of position and time."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hairkit.arrays import Float32Array, Float64Array

MODES = 16
"""Number of plane waves in the gusts."""
LONGEST, SHORTEST = 0.8, 0.08
"""Longest and shortest wavelength, metres: a few heads, and a lock."""
LIFETIME = 0.5
"""Rate of change of the longest gust in the moving air, cycles per second."""


def air_velocity(
    points: Float64Array | Float32Array,
    time: float,
    wind: Float64Array,
    turbulence: float,
    seed: int = 0,
    axes: Float64Array | None = None,
) -> Float64Array:
    """Return the velocity of the air (..., 3) at points (..., 3), world, metres per second.

    The gusts are a sum of plane waves with amplitudes perpendicular to their wave vectors, which
    makes them divergence-free (Kraichnan 1970), and with Kolmogorov's energy spectrum. They move
    with the mean wind (Taylor's hypothesis) and change slowly. The RMS of a component is
    `turbulence` times the mean speed over the square root of three.

    Parameters
    ----------
    points
        Metres, in `axes`. Gusts have their precision: float32 is enough within a few metres.
    time
        Seconds.
    wind
        (3,) mean velocity, metres per second, world.
    turbulence
        RMS speed of the gusts over the mean speed.
    seed
        Seed of the gusts.
    axes
        (4, 4) rigid motion that brings points to the world; None: they are there.
    """
    mean = np.broadcast_to(np.asarray(wind, np.float64), points.shape)
    strength, kind = turbulence * float(np.linalg.norm(wind)), points.dtype
    if not strength:
        return mean.copy()
    waves, amplitudes, rates, phases = _modes(seed)
    at = np.eye(4) if axes is None else axes
    # reduced in float64: far from the origin float32 has no digits for them
    phases = np.fmod(phases - (waves @ wind + rates) * time + waves @ at[:3, 3], 2 * np.pi)
    angle = points @ (waves @ at[:3, :3]).T.astype(kind) + phases.astype(kind)
    return np.asarray(mean + np.cos(angle) @ (strength * amplitudes).astype(kind))


@lru_cache(maxsize=8)
def _modes(seed: int) -> tuple[Float64Array, Float64Array, Float64Array, Float64Array]:
    """Return wave vectors (M, 3), amplitudes (M, 3) of mean square 1, rates and phases (M,)."""
    rng = np.random.default_rng(seed)
    length = LONGEST * (SHORTEST / LONGEST) ** (np.arange(MODES) / (MODES - 1))
    direction = rng.normal(size=(MODES, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    waves = direction * (2 * np.pi / length)[:, None]
    across = np.cross(direction, rng.normal(size=(MODES, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    # energy k^(-5/3) over wave numbers evenly spaced in log k: amplitude k^(-1/3)
    size = length ** (1.0 / 3.0)
    size *= np.sqrt(2.0 / (size**2).sum())
    rates = 2 * np.pi * LIFETIME * (LONGEST / length) ** (2.0 / 3.0) * rng.uniform(0.5, 1.0, MODES)
    return waves, across * size[:, None], rates, rng.uniform(0, 2 * np.pi, MODES)
