"""Pictures for benchmarks and the gallery, drawn from random numbers: skin, maps, filters."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int64Array, UInt8Array

GROUNDS = np.array([[92, 150, 214], [88, 140, 62], [206, 182, 128], [40, 78, 150]], np.float32)
"""Sky, meadow, sand, sea: their colours, of 255."""
LABELS = np.array([[0, 255, 255], [0, 255, 0], [255, 255, 0], [0, 0, 255]], np.uint8)
"""The same as labels of a map."""


def noise(rng: np.random.Generator, size: int, sigma: float) -> Float32Array:
    """Return smooth noise (size, size) of mean 0 and deviation 1."""
    field = cv2.GaussianBlur(rng.standard_normal((size, size)).astype(np.float32), (0, 0), sigma)
    return np.asarray((field - field.mean()) / field.std(), np.float32)


def draw_skin(size: int, seed: int, scale: float = 1.0) -> UInt8Array:
    """Return skin (size, size, 3): cells between furrows, pores, blotches; `scale` enlarges."""
    rng = np.random.default_rng(seed)
    count = max(int((size / (7 * scale)) ** 2), 8)
    cells = _distances(rng.random((count, 2)) * size, size, 2)
    furrow = np.clip((cells[..., 1] - cells[..., 0]) / (3.5 * scale), 0, 1)
    pores = _distances(rng.random((max(count // 6, 4), 2)) * size, size, 1)[..., 0]
    pore = 1 - 0.5 * np.exp(-((pores / (1.4 * scale)) ** 2))
    tone = 1 + 0.05 * noise(rng, size, 0.06 * size) + 0.03 * noise(rng, size, 2 * scale)
    fine = 1 + 0.012 * noise(rng, size, 0.7)
    light = (0.78 + 0.22 * furrow) * pore * tone * fine
    red = 1 + 0.02 * noise(rng, size, 0.04 * size)[..., None] * [1, -0.6, -0.5]
    return np.clip(np.array([222, 168, 142]) * light[..., None] * red, 0, 255).astype(np.uint8)


def draw_map(size: int, seed: int) -> tuple[UInt8Array, UInt8Array]:
    """Return labels (size, size, 3) of a landscape, and the landscape."""
    rng = np.random.default_rng(seed)
    column = np.arange(size)
    relief = noise(rng, size, size / 10)[size // 2]
    horizon = size * (0.38 + 0.05 * relief)
    shore = size * (0.68 + 0.06 * np.roll(relief, size // 3))
    row = np.arange(size)[:, None]
    kind = np.where(row < horizon, 0, np.where(row < shore, 1, 2))
    lake = ((column - 0.6 * size) / 0.25) ** 2 + ((row - 0.85 * size) / 0.09) ** 2 < size**2
    kind = np.where(lake & (kind == 2), 3, kind)
    grain = np.stack([
        noise(rng, size, size / 30), noise(rng, size, 1.0), noise(rng, size, 0.6),
        cv2.GaussianBlur(noise(rng, size, 0.6), (0, 0), sigmaX=5, sigmaY=0.5) * 3,
    ])  # fmt: skip
    strength = np.array([10, 26, 9, 14])[kind]
    value = GROUNDS[kind] + (strength * np.take_along_axis(grain, kind[None], 0)[0])[..., None]
    return LABELS[kind], np.clip(value, 0, 255).astype(np.uint8)


def draw_scene(size: int, seed: int) -> UInt8Array:
    """Return overlapping shaded discs on a ground, (size, size, 3): edges, ramps and texture."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:size, :size] / size
    picture = np.full((size, size, 3), 120.0) + 30 * row[..., None]
    for _ in range(25):
        (y, x), radius = rng.random(2), rng.uniform(0.05, 0.2)
        distance = np.hypot(row - y, column - x) / radius
        shade = 0.6 + 0.5 * np.sqrt(np.clip(1 - distance**2, 0, 1))
        inside = distance < 1
        picture[inside] = (rng.uniform(60, 230, 3) * shade[..., None])[inside]
    picture *= 1 + 0.06 * noise(rng, size, 1.2)[..., None]
    return np.clip(picture, 0, 255).astype(np.uint8)


def blur(picture: UInt8Array, sigma: float = 1.5) -> UInt8Array:
    """Return a picture under a Gaussian."""
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma), np.uint8)


def emboss(picture: UInt8Array) -> UInt8Array:
    """Return a picture as a relief lit from the upper left."""
    kernel = np.array([[-2, -1, 0], [-1, 0, 1], [0, 1, 2]], np.float32)
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    relief = cv2.filter2D(blur(grey, 1.0), cv2.CV_32F, kernel, borderType=cv2.BORDER_REPLICATE)
    return np.repeat(np.clip(128 + relief, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def paint(picture: UInt8Array) -> UInt8Array:
    """Return a picture in flat strokes with dark outlines: medians, few tones, edges."""
    flat = cv2.medianBlur(cv2.medianBlur(picture, 7), 7)
    flat = np.clip(flat // 32 * 32 + 16, 0, 255).astype(np.uint8)
    grey = cv2.GaussianBlur(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), (0, 0), 1.5)
    edge = cv2.Laplacian(grey.astype(np.float32), cv2.CV_32F, ksize=3)
    dark = np.clip(1 - np.clip(edge - 3, 0, 12) / 16, 0, 1)[..., None]
    return np.asarray(flat * dark, np.uint8)


def _distances(points: Float64Array, size: int, nearest: int) -> Float64Array:
    grid: Int64Array = np.stack(np.mgrid[:size, :size], axis=-1)
    found = cKDTree(points).query(grid + 0.5, k=[*range(1, nearest + 1)])[0]
    return np.asarray(found)
