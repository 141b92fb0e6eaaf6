"""Wind tracked strands into the waves that the photos show (`hairkit.imaging.waves`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, across
from hairkit.types.strands import Strands
from hairkit.types.waves import Waves

WAVELENGTHS = (0.11, 0.07, 0.05, 0.02, 0.01, 0.006)
"""Metres over which the phase varies on the scalp. The shortest is a wisp that stays in phase:
without the last three, F at 4 mm falls from 81 to 77 on wavy hair."""
POINTS_PER_TURN, LONG_AXIS, MOST_POINTS = 10, 0.4, 255
"""Points that show a turn of a helix to 5 % of its radius, on strands up to this length before they
are wound, metres; the most that every format can take."""
PHASE_AMPLITUDE = 2.5
"""Radians by which the phase varies over each wavelength."""
RADIUS_SPREAD, PITCH_SPREAD = 0.2, 0.1
"""Standard deviations between wisps, as shares: 0.21 and 0.22, 0.07 and 0.14 on wavy and curly
heads. They leave F at 4 mm within 1 of what it is without."""
LARGEST_RADIUS = 1 + np.sqrt(2) * RADIUS_SPREAD
"""Of the widest wisps, as a share of the mean: a sine's amplitude is root 2 of its spread."""
RAMP = 0.03
"""Metres from the root over which the radius grows from 0, in hair whose turns are longer. Over a
whole one of shorter turns F at 4 mm is a point higher on coils."""


def add_waves(strands: Strands, waves: Waves, seed: int = 0, spread: float = 1.0) -> Strands:
    """Wind strands of equal point counts into helices around their own axes.

    The radius grows from 0 at the root. The phase is a function of the root's
    position, so a strand does not depend on how many others there are. It varies slowly over the
    scalp and again from wisp to wisp; hair within a wisp is in phase. Without a handedness, wisps
    turn either way. Radius and pitch vary from wisp to wisp, by `spread` times the usual share.
    """
    if waves.radius <= 0 or waves.pitch <= 0 or len(strands) == 0:
        return strands
    needed = min(int(np.ceil(POINTS_PER_TURN * LONG_AXIS / waves.pitch)), MOST_POINTS)
    if needed > len(strands.points) // len(strands):
        strands = strands.resampled(needed)
    points = strands.points.reshape(len(strands), -1, 3).astype(np.float64)
    arc = strands.arc_lengths().reshape(len(strands), -1)
    first, second = _transport_frames(points)
    rng = np.random.RandomState(seed)  # its stream never changes (NEP 19)
    phase, side, wide, long = (_wisp_phase(points[:, 0], rng) for _ in range(4))
    turn = waves.handedness or np.where(np.sin(side) > 0, 1, -1)[:, None]
    share = np.sqrt(2) * spread  # a sine's standard deviation is 1 over sqrt(2)
    pitch = waves.pitch * (1 + share * PITCH_SPREAD * np.sin(long))[:, None]
    radius = waves.radius * (1 + share * RADIUS_SPREAD * np.sin(wide))[:, None]
    radius = radius * grown_share(arc, waves)
    angle = phase[:, None] + turn * 2 * np.pi * arc / pitch
    offset = np.cos(angle)[..., None] * first + np.sin(angle)[..., None] * second
    wound = points + radius[..., None] * offset
    return replace(strands, points=wound.reshape(-1, 3).astype(np.float32))


def grown_share(arc: Float32Array | Float64Array, waves: Waves) -> Float64Array:
    """Return the share of the radius that waves have at these lengths from the root, metres.

    >>> grown_share(np.array([0, 0.01]), Waves(0.004, 0.01)).tolist()
    [0.0, 1.0]
    """
    return np.asarray(np.clip(arc / min(RAMP, waves.pitch), 0, 1))


def _transport_frames(points: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return two unit normals (S, M, 3) that do not twist along the strands (Bishop 1975)."""
    tangent = np.gradient(points, axis=1)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=2, keepdims=True), 1e-12)
    normal = np.empty_like(points)
    side = np.cross(tangent[:, 0], [0.0, 0.0, 1.0]) + 1e-3 * np.cross(
        tangent[:, 0], [1.0, 0.0, 0.0]
    )
    for k in range(points.shape[1]):
        side = across(tangent[:, k], side)
        side = side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
        normal[:, k] = side
    return normal, np.cross(tangent, normal)


def _wisp_phase(roots: Float64Array, rng: np.random.RandomState) -> Float64Array:
    """Return phases (S,) of roots (S, 3): plane waves of all `WAVELENGTHS` through space."""
    phase = np.full(len(roots), rng.uniform(0, 2 * np.pi))
    for wavelength in WAVELENGTHS:
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        shift = rng.uniform(0, 2 * np.pi)
        phase += PHASE_AMPLITUDE * np.sin(2 * np.pi * (roots @ direction) / wavelength + shift)
    return phase
