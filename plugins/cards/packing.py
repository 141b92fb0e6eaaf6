"""Places for the cards of all levels in one square atlas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import InputError

from .strips import Cards

SLENDER = 4.0
"""Length of hair in a texel along the card, of its width in a texel across."""
COARSER = 1.5
"""Size of a level's texels, of those of the level before."""
GAP = 2
"""Texels between cards, so that the first mipmaps do not mix them."""
LEAST = 3
"""Texels of a card at least, each way."""
GROWTH = 1.02
"""Factor of the texels' size from one attempt to the next."""


@dataclass(frozen=True, eq=False)
class Places:
    """The rectangles of one level's cards."""

    corner: Int64Array
    """(K, 2) first column and row, texels."""
    size: Int64Array
    """(K, 2) columns and rows."""
    texel: float
    """Width of hair in a column, metres."""


def pack(levels: list[Cards], edge: int) -> list[Places]:
    """Return places for the cards of all levels in a square of `edge` texels, on shelves."""
    area = sum(
        float((2 * c.half.max(axis=1) * c.lengths()).sum()) / COARSER ** (2 * n)
        for n, c in enumerate(levels)
    )
    texel = np.sqrt(area / SLENDER) / edge
    while texel < 1:
        sizes = [_sizes(cards, texel * COARSER**n) for n, cards in enumerate(levels)]
        corner = _shelves(np.concatenate(sizes), edge)
        if corner is not None:
            corners = np.split(corner, np.cumsum([len(size) for size in sizes])[:-1])
            return [
                Places(at, size, texel * COARSER**n)
                for n, (at, size) in enumerate(zip(corners, sizes, strict=True))
            ]
        texel *= GROWTH
    raise InputError("the cards do not fit into the atlas: fewer cards or a larger atlas")


def _sizes(cards: Cards, texel: float) -> Int64Array:
    width = 2 * cards.half.max(axis=1) / texel
    height = cards.lengths() / (SLENDER * texel)
    size: Float64Array = np.stack([width, height], axis=1)
    return np.maximum(np.ceil(size).astype(np.int64), LEAST)


def _shelves(size: Int64Array, edge: int) -> Int64Array | None:
    """Return corners (N, 2) on shelves, the highest first; None where they do not fit."""
    corner = np.empty_like(size)
    column, row, height = 0, 0, 0
    for number in np.lexsort((size[:, 0], -size[:, 1])):
        width, tall = size[number] + GAP
        if column + width > edge:
            column, row = 0, row + height
            height = 0
        height = max(height, int(tall))
        if row + height > edge or width > edge:
            return None
        corner[number] = column, row
        column += int(width)
    return corner
