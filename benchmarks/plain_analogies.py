"""A plain twin of Image Analogies: Hertzmann's pseudo-code in NumPy, a pixel at a time.

Features are cut from padded images and compared whole; the search is either exhaustive or by
SciPy's k-d tree, which `eps` makes approximate. The pixels that are synthesised can be limited, so
that a benchmark may time some rows of a large picture.
"""

from __future__ import annotations

import itertools
import math

import cv2
import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int64Array

RADIUS, COARSE_RADIUS = 2, 1
SIGMA = {RADIUS: 1.2, COARSE_RADIUS: 0.8}
"""Gaussian over a window by its radius, pixels."""
PADDING = 2


def plain_analogy(
    source: Float32Array,
    filtered: Float32Array,
    target: Float32Array,
    levels: int,
    kappa: float,
    eps: float | None = None,
    alpha: float | None = None,
) -> Float64Array:
    """Return B' (h, w, C); A, A' (H, W, C) and B (h, w, C); `eps` None searches exhaustively."""
    pyramids = [pyramid(image, levels) for image in (source, filtered, target)]
    made: Float64Array | None = None
    for level in range(levels - 1, -1, -1):
        coarse = [p[level + 1] if level + 1 < levels else None for p in pyramids]
        twin = PlainLevel(pyramids, level, made, coarse, alpha)
        twin.prepare(eps)
        weaker = 1 + kappa * 2.0**-level if alpha is None else 1.0
        for row, column in itertools.product(*map(range, twin.given.shape[:2])):
            twin.fill(row, column, weaker)
        made = twin.made[PADDING:-PADDING, PADDING:-PADDING]
    assert made is not None
    return made


class PlainLevel:
    """One level: the padded images, all features of the example, and what is made so far."""

    def __init__(
        self,
        pyramids: list[list[Float32Array]],
        level: int,
        result: Float64Array | None,
        coarse: list[Float32Array | None],
        alpha: float | None,
    ) -> None:
        self.source, self.filtered, self.given = (p[level].astype(np.float64) for p in pyramids)
        start = self.given
        if result is not None:
            size = self.given.shape[1::-1]
            start = cv2.resize(result.astype(np.float32), size).reshape(self.given.shape)
        self.made = pad(start)
        self.images = [pad(self.source), padded(coarse[0]), pad(self.filtered), padded(coarse[1])]
        self.others = [pad(self.given), padded(coarse[2]), self.made, padded(result)]
        self.alpha = alpha
        self.places = np.full((*self.given.shape[:2], 2), -1)
        self.trees: list[cKDTree] = []

    def prepare(self, eps: float | None) -> None:
        """Compute the example's features, and trees over them."""
        self.eps = eps
        cells = itertools.product(*map(range, self.source.shape[:2]))
        self.features = np.array([self.feature(self.images, *cell) for cell in cells])
        middle = len(self.feature(self.images, 0, 0, filtered=False))
        whole = slice(0, self.features.shape[1])
        self.parts = [whole] if self.alpha is None else [slice(0, middle), slice(middle, None)]
        if eps is not None:
            self.trees = [cKDTree(self.features[:, part]) for part in self.parts]

    def feature(
        self, images: list[Float64Array | None], row: int, column: int, *, filtered: bool = True
    ) -> Float64Array:
        """Return the weighted feature of a pixel."""
        channels = self.source.shape[2]
        fine, coarse = gaussian(RADIUS), gaussian(COARSE_RADIUS)
        before = len(fine) // 2
        share = (1.0, 1.0) if self.alpha is None else (1 - self.alpha, self.alpha)
        parts = []
        for half in (0, 1) if filtered else (0,):
            window = cut(images[2 * half], row, column, RADIUS)
            weights = fine
            if half:
                window, weights = window[:before], fine[:before] / fine[:before].sum()
            parts.append(np.sqrt(share[half] * weights / channels)[:, None] * window)
            if images[2 * half + 1] is not None:
                window = cut(images[2 * half + 1], row // 2, column // 2, COARSE_RADIUS)
                parts.append(np.sqrt(share[half] * coarse / channels)[:, None] * window)
        return np.concatenate([part.ravel() for part in parts])

    def fill(self, row: int, column: int, weaker: float) -> None:
        """Synthesise one pixel."""
        wanted = self.feature(self.others, row, column)
        best, place = self.coherent(wanted, row, column)
        limit = best / weaker
        for number, part in enumerate(self.parts):
            if self.trees:
                _, nearest = self.trees[number].query(wanted[part], eps=self.eps)
            else:
                nearest = ((self.features[:, part] - wanted[part]) ** 2).sum(axis=1).argmin()
            distance = ((self.features[nearest] - wanted) ** 2).sum()
            if distance < limit:
                limit, place = distance, np.array(divmod(int(nearest), self.source.shape[1]))
        self.places[row, column] = place
        self.made[row + PADDING, column + PADDING] = self.filtered[tuple(place)]

    def coherent(self, wanted: Float64Array, row: int, column: int) -> tuple[float, Int64Array]:
        """Return the best of the places that the pixels around propose."""
        best, place = math.inf, np.array([-1, -1])
        for v, u in itertools.product(range(-RADIUS, 1), range(-RADIUS, RADIUS + 1)):
            inside = row + v >= 0 and 0 <= column + u < self.places.shape[1]
            if (v == 0 and u >= 0) or not inside or self.places[row + v, column + u, 0] < 0:
                continue
            there = self.places[row + v, column + u] - (v, u)
            if (there < 0).any() or (there >= self.source.shape[:2]).any():
                continue
            number = there[0] * self.source.shape[1] + there[1]
            distance = ((self.features[number] - wanted) ** 2).sum()
            if distance < best:
                best, place = distance, there
        return best, place


def pyramid(image: Float32Array, levels: int) -> list[Float32Array]:
    """Return an image (H, W, C) and its halvings."""
    images = [image]
    for _ in range(levels - 1):
        half = cv2.pyrDown(images[-1])
        images.append(half.reshape(*half.shape[:2], image.shape[2]))
    return images


def cut(image: Float64Array | None, row: int, column: int, radius: int) -> Float64Array:
    """Return the pixels (n, C) of a window of a padded image."""
    assert image is not None
    y, x = row + PADDING, column + PADDING
    window = image[y - radius : y + radius + 1, x - radius : x + radius + 1]
    return window.reshape(-1, image.shape[2])


def gaussian(radius: int) -> Float64Array:
    """Return the weights (n,) of a window, sum 1."""
    along = np.exp(-(np.arange(-radius, radius + 1) ** 2) / (2 * SIGMA[radius] ** 2))
    weights = np.outer(along, along).ravel()
    return np.asarray(weights / weights.sum())


def pad(image: Float64Array) -> Float64Array:
    """Return an image with its edge repeated."""
    return np.pad(image, ((PADDING, PADDING), (PADDING, PADDING), (0, 0)), "edge")


def padded(image: Float64Array | Float32Array | None) -> Float64Array | None:
    """Return a coarser image padded, None at the coarsest level."""
    return None if image is None else pad(image.astype(np.float64))
