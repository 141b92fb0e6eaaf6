"""Random colours, noise and textures; all colours are Lab with L from 0 to 100."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from hairkit.arrays import BoolArray

Array = npt.NDArray[Any]


def to_lab(image: Array) -> Array:
    """Return (H, W, 3) the Lab colours of an RGB picture of 8 bits."""
    return np.asarray(cv2.cvtColor(image.astype(np.float32) / 255, cv2.COLOR_RGB2Lab))


def to_rgb(lab: Array) -> Array:
    """Return (H, W, 3) RGB, 0 to 1."""
    lab = lab.astype(np.float32)
    lab[..., 0] = np.clip(lab[..., 0], 0, 100)
    return np.asarray(np.clip(cv2.cvtColor(lab, cv2.COLOR_Lab2RGB), 0, 1))


def noise(
    rng: Generator, shape: tuple[int, int], down: float, across: float | None = None
) -> Array:
    """Return (h, w) smooth noise of mean 0 and deviation 1; scales down and across in pixels."""
    height, width = shape
    cells = [max(int(n / s) + 3, 3) for n, s in ((height, down), (width, across or down))]
    rough = rng.standard_normal(cells).astype(np.float32)
    smooth = cv2.resize(rough, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.asarray((smooth - smooth.mean()) / (smooth.std() + 1e-6))


def turn(rng: Generator, field: Array) -> Array:
    """Return a field (h, w), enlarged and turned by a random angle."""
    height, width = field.shape
    matrix = cv2.getRotationMatrix2D((width / 2, height / 2), rng.uniform(0, 180), 1.5)
    mode = cv2.BORDER_REFLECT
    return np.asarray(cv2.warpAffine(field, matrix, (width, height), borderMode=mode))


def hair_colour(rng: Generator) -> Array:
    """Return a colour of hair: dark, brown, blond, red, grey or dyed."""
    low, high = np.array(_HAIR[rng.choice(len(_HAIR), p=_HAIR_SHARES)], np.float64).T
    if rng.random() < 0.12:
        angle, chroma = rng.uniform(0, 2 * np.pi), rng.uniform(15, 55)
        return np.array([rng.uniform(20, 65), chroma * np.cos(angle), chroma * np.sin(angle)])
    return np.asarray(rng.uniform(low, high))


_HAIR = (
    ((8, 24), (0, 6), (-1, 8)),
    ((22, 42), (5, 15), (8, 22)),
    ((48, 78), (0, 10), (12, 34)),
    ((30, 50), (15, 35), (15, 35)),
    ((40, 82), (-2, 2), (-4, 5)),
)
_HAIR_SHARES = np.array([0.35, 0.20, 0.15, 0.08, 0.10]) / 0.88


def skin_colour(rng: Generator) -> Array:
    """Return a colour of skin, dark to light."""
    return np.array(
        [25 + 55 * rng.random() + rng.uniform(-5, 5), rng.uniform(7, 17), rng.uniform(9, 24)]
    )


def recolour(lab: Array, region: BoolArray, target: Array, gain: float) -> Array:
    """Return a picture whose region has the mean colour `target`.

    What is lighter or darker there stays so; `gain` and the ratio of the lightnesses scale it.
    """
    if np.count_nonzero(region) < 20:
        return lab
    mean = lab[region].mean(axis=0)
    offset = lab[region] - mean
    offset[:, 0] *= gain * np.clip(target[0] / max(mean[0], 8), 0.5, 2.2)
    offset[:, 0] = np.minimum(offset[:, 0], max((97 - target[0]) * 0.9, 0))
    offset[:, 1:] *= 0.6
    result = lab.copy()
    result[region] = np.maximum(offset + target, (1, -90, -90))
    return result


def texture(rng: Generator, shape: tuple[int, int]) -> Array:
    """Return (h, w, 3) a pattern for cloth or backdrop: plain, stripes, spots, boxes, leaves."""
    base, other = (np.array([rng.uniform(5, 95), *rng.normal(0, 16, 2)]) for _ in range(2))
    share: Array = np.zeros(shape, np.float32)
    kind, width = rng.integers(8), shape[1]
    if kind == 1:
        stripes = np.sin(np.arange(width, dtype=np.float32) / rng.uniform(2, 30))
        share = turn(rng, np.tile(stripes, (shape[0], 1))) > rng.uniform(-0.8, 0.8)
    elif kind == 2:
        share = noise(rng, shape, rng.uniform(5, 80)) > rng.uniform(-0.5, 1)
    elif kind == 3:
        share = np.clip(0.5 + 0.5 * noise(rng, shape, shape[0] / rng.uniform(1, 4)), 0, 1)
    lab = base + share[..., None] * (other - base)
    if kind == 4:
        threads = turn(rng, noise(rng, shape, rng.uniform(30, 100), rng.uniform(2, 6)))
        lab += threads[..., None] * (rng.uniform(2, 14), rng.uniform(0, 2), rng.uniform(0, 2))
    elif kind == 5:
        grain = noise(rng, shape, rng.uniform(1.2, 4))
        lab += grain[..., None] * (rng.uniform(2, 14), rng.uniform(0, 3), rng.uniform(0, 3))
    elif kind == 6:
        for _ in range(rng.integers(3, 25)):
            lab[random_box(rng, shape, 0.6)] = (rng.uniform(5, 98), *rng.normal(0, 16, 2))
    elif kind == 7:  # leaves, stone or fur: detail of all sizes, along a direction or not
        stretch = rng.uniform(1, 6)
        for scale in 2.0 ** np.arange(1, 7):
            field = turn(rng, noise(rng, shape, scale * stretch, scale))
            lab += field[..., None] * rng.normal(0, (7, 2.5, 2.5))
    lab += noise(rng, shape, shape[0] / 2)[..., None] * (rng.uniform(0, 12), 1.5, 1.5)
    lab[..., 0] += noise(rng, shape, rng.uniform(1, 3)) * rng.uniform(0, 3)
    return np.asarray(lab, np.float32)


def random_box(rng: Generator, shape: tuple[int, int], most: float) -> tuple[slice, slice]:
    """Return rows and columns of a box that may reach over the edges."""
    sides = []
    for length in shape:
        start = rng.uniform(-0.2, 0.95) * length
        sides.append(
            slice(max(int(start), 0), max(int(start + rng.uniform(0.03, most) * length), 0))
        )
    return sides[0], sides[1]
