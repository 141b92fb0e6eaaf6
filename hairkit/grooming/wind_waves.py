"""Wind tracked strands into the waves that the photos show (`hairkit.imaging.waves`)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.imaging.waves import Waves
from hairkit.types.strands import Strands

FULL_HAIR = 0.003
"""Roots closer than this, metres, carry every strand its own phase; see `add_waves`."""


def add_waves(strands: Strands, waves: Waves, seed: int = 0, ramp: float = 0.03) -> Strands:
    """Wind strands of equal point counts around their own axes.

    The helix grows in over `ramp` metres from the root. Phases vary smoothly over the scalp, so
    that guides can be interpolated; strands closer than `FULL_HAIR` are no guides but hair, and are
    out of step as real ones are. Without a handedness, wisps turn either way.
    """
    if waves.radius <= 0 or waves.pitch <= 0 or len(strands) == 0:
        return strands
    points = strands.points.reshape(len(strands), -1, 3).astype(np.float64)
    arc = strands.arc_lengths().reshape(len(strands), -1)
    first, second = _transported_frames(points)
    rng = np.random.default_rng(seed)
    phase = _wisp_phase(points[:, 0], rng) + _disorder(points[:, 0]) * rng.uniform(
        -np.pi, np.pi, len(strands)
    )
    turn = waves.handedness or np.where(np.sin(_wisp_phase(points[:, 0], rng)) > 0, 1, -1)[:, None]
    angle = phase[:, None] + turn * 2 * np.pi * arc / waves.pitch
    radius = waves.radius * np.clip(arc / ramp, 0, 1)
    offset = np.cos(angle)[..., None] * first + np.sin(angle)[..., None] * second
    wound = points + radius[..., None] * offset
    return Strands(
        wound.reshape(-1, 3).astype(np.float32),
        strands.offsets,
        strands.widths,
        strands.root_uv,
        strands.group,
        strands.guide,
    )


def _transported_frames(points: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return two unit normals (S, M, 3) that do not twist along the strands (Bishop 1975)."""
    tangent = np.gradient(points, axis=1)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=2, keepdims=True), 1e-12)
    normal = np.empty_like(points)
    side = np.cross(tangent[:, 0], [0.0, 0.0, 1.0]) + 1e-3 * np.cross(
        tangent[:, 0], [1.0, 0.0, 0.0]
    )
    for k in range(points.shape[1]):
        side = side - np.sum(side * tangent[:, k], axis=1, keepdims=True) * tangent[:, k]
        side = side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
        normal[:, k] = side
    return normal, np.cross(tangent, normal)


def _disorder(roots: Float64Array) -> float:
    """Return 0 for roots further apart than guides' 2 `FULL_HAIR`, 1 for those closer than
    `FULL_HAIR`."""
    if len(roots) < 2:
        return 0.0
    spacing = float(np.median(cKDTree(roots).query(roots, k=2)[0][:, 1]))
    return float(np.clip(2 - spacing / FULL_HAIR, 0, 1))


def _wisp_phase(roots: npt.NDArray[np.float64], rng: np.random.Generator) -> Float64Array:
    """Return phases (S,) that vary by about a turn over some centimetres of scalp."""
    phase = np.full(len(roots), rng.uniform(0, 2 * np.pi))
    for wavelength in (0.11, 0.07, 0.05):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        shift = rng.uniform(0, 2 * np.pi)
        phase += 2.5 * np.sin(2 * np.pi * (roots @ direction) / wavelength + shift)
    return phase
