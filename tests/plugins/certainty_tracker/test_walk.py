"""The compiled walk against a readable one in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hairkit_plugins.certainty_tracker.walk import (
    ACROSS,
    ROOT_INERTIA,
    ROOT_STEPS,
    SKIN_LEVEL,
    Rules,
    Volumes,
    track_strand,
)

from hairkit.arrays import Float64Array
from hairkit.types.volume import VoxelGrid, outer_products, symmetric_matrices

CELLS, SPACING = 24, 0.01
GRID = VoxelGrid(np.full(3, -0.5 * CELLS * SPACING), SPACING, (CELLS,) * 3)
RULES = Rules(0.5 * SPACING, 0.5, 6, 3, 0.3, 0.9, 0.08, 0.001)


def swirl(seed: int) -> Volumes:
    """Return a field that turns about an axis and rises, in a ball of hair around a small head."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    at = GRID.centres()
    along = np.cross(axis, at) + 0.05 * axis
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    radius = np.linalg.norm(at, axis=-1)
    inside = radius < 0.1
    return Volumes(
        np.asarray(GRID.origin, np.float64),
        SPACING,
        (outer_products(along) * inside[..., None]).astype(np.float32),
        (at @ axis).astype(np.float32)[..., None],
        inside,
        np.clip((0.11 - radius) / 0.02, 0, 1).astype(np.float32)[..., None],
        (radius - 0.04).astype(np.float32)[..., None],
    )


def sample(values: np.ndarray, p: Float64Array) -> Float64Array:
    return np.asarray(GRID.sample(values, p[None])[0], np.float64)


def slope(values: np.ndarray, p: Float64Array) -> Float64Array:
    """Unit gradient by differences over two cells."""
    steps = SPACING * np.eye(3)
    rise = np.array([(sample(values, p + s) - sample(values, p - s))[0] for s in steps])
    return rise / max(np.linalg.norm(rise), 1e-9)


def direction(volumes: Volumes, p: Float64Array, near: Float64Array) -> Float64Array | None:
    tensor = symmetric_matrices(sample(volumes.tensors, p)[None])[0]
    if np.abs(tensor).max() < 1e-6:
        return None
    main = np.linalg.eigh(tensor)[1][:, 2]
    return main if main @ near >= 0 else -main


def walk(volumes: Volumes, rules: Rules, p: Float64Array, d: Float64Array) -> Float64Array:
    """The rules of the tracker, one after the other."""
    points, count, uncertain = [p, p + rules.step * d], 1, 0
    for i in range(1, 60):
        if (np.abs(p) > 0.5 * CELLS * SPACING).any():
            break
        cell = tuple(np.floor((p - GRID.origin) / SPACING).astype(int))
        first = direction(volumes, p, d)
        found = None if first is None else direction(volumes, p + 0.5 * rules.step * first, first)
        blind, cosine = i <= rules.blind_steps, -1.0
        if found is not None:
            found = found if found @ d >= 0 else -found
            if found @ d < ACROSS and found @ slope(volumes.growth, p) < 0:
                found = -found
            cosine = float(found @ d)
        certain = blind or (cosine >= rules.min_cosine and bool(volumes.inside[cell]))
        if found is not None and (cosine >= rules.min_cosine or blind):
            keep = rules.inertia if i > ROOT_STEPS else max(rules.inertia, ROOT_INERTIA)
            d = keep * d + (1 - keep) * found
        ahead = sample(volumes.skin, p + SPACING * d)[0]
        if i * rules.step < rules.slide_length and ahead < SKIN_LEVEL:
            normal = slope(volumes.skin, p)
            sine = -d @ normal
            if sine < rules.slide_sine:
                d = d + (max(sine, 0.0) + SKIN_LEVEL - ahead) * normal
        d = d / np.linalg.norm(d)
        p = p + rules.step * d
        distance = sample(volumes.head_distance, p)[0]
        if distance < rules.clearance:
            normal = slope(volumes.head_distance, p)
            p = p + (rules.clearance - distance) * normal
            d = d - min(d @ normal, 0.0) * normal
            d = d / np.linalg.norm(d)
        points[i:] = [p]
        uncertain = 0 if certain else uncertain + 1
        count = i + 1 if certain else count
        if uncertain == rules.max_score:
            break
    return np.array(points)[: max(count, 2)]


@pytest.mark.parametrize("seed", range(12))
def test_the_walk_equals_its_readable_twin(seed: int) -> None:
    """Turns, the hull's surface and the head: the same points within a hundredth of a cell."""
    rng = np.random.default_rng(100 + seed)
    volumes = swirl(seed)
    start = rng.normal(size=3)
    start *= 0.042 / np.linalg.norm(start)
    way = start / np.linalg.norm(start)
    points = np.zeros((60, 3), np.float32)
    count = track_strand(volumes, RULES, start, way, points)
    expected = walk(volumes, RULES, start, way)
    assert count == len(expected)
    np.testing.assert_allclose(points[:count], expected, atol=1e-2 * SPACING)
