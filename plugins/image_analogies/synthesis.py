"""Image Analogies (Hertzmann et al. 2001): B' such that A is to A' as B is to B'.

Coarse to fine, pixel by pixel in scan order (CREATEIMAGEANALOGY there):

1. coherent match: each pixel around q that is done already proposes the neighbour of its own match
   (Ashikhmin 2001); the best has the distance d_coh;
2. approximate match: the nearest feature in the tree, at the distance d_app;
3. the coherent one is taken where d_coh <= d_app (1 + 2^(l - L) kappa), l the level, L the finest.

The search of step 2 only looks for what would win in step 3, which takes nothing from its result:
it starts with the limit d_coh / (1 + 2^(l - L) kappa).

With `alpha` (Graham et al. 2013) a distance is (1 - alpha) times that of the source windows plus
alpha times that of the filtered windows; either part has a tree of its own, the better of the two
candidates is taken, and kappa is 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Int32Array
from hairkit.parallel import compiled_with

from .features import (
    Pair,
    feature_weights,
    filtered_image,
    gather_feature,
    make_pair,
    source_size,
    squared_distance,
)
from .pyramid import RADIUS, build_pyramid, count_levels, enlarge
from .search_tree import Heap, Tree, build_tree, new_heap, search_tree

NOWHERE = -1
"""Row and column of the match of a pixel that has none."""
_ROW, _COLUMN = 0, 1
"""Columns of places."""


class Search(NamedTuple):
    """How matches are looked for."""

    trees: tuple[Tree, ...]
    """Of the example's features."""
    heap: Heap
    """Working memory."""
    leaves: int
    """Leaves of a tree that are looked at, at most."""
    weaker: float
    """Factor by which a coherent match may be worse, in squared distance."""


@dataclass(frozen=True)
class Settings:
    """How an analogy is synthesised."""

    levels: int
    """Levels of the pyramid at most."""
    kappa: float
    """Preference for coherent matches."""
    alpha: float | None
    """Weight of the filtered windows; None for Hertzmann's distance."""
    leaves: int
    """Leaves of a tree that a search looks at, at most."""


def synthesise(
    example_source: Float32Array,
    example_filtered: Float32Array,
    target: Float32Array,
    settings: Settings,
    allowed: BoolArray | None = None,
    wanted: BoolArray | None = None,
) -> tuple[Float32Array, Int32Array]:
    """Return B' and, for every pixel of it, the place in the example that it comes from.

    Parameters
    ----------
    example_source, example_filtered
        (H, W, C) A and A'.
    target
        (h, w, C) B.
    settings
        Levels, coherence, search.
    allowed
        (H, W) pixels of the example that may be used; None for all.
    wanted
        (h, w) pixels that are synthesised, the others are those of `target`; None for all.

    Returns
    -------
    (h, w, C) and (h, w, 2); row and column are `NOWHERE` where a pixel is not wanted.
    """
    levels = count_levels(settings.levels, example_source, target)
    pyramids = [build_pyramid(i, levels) for i in (example_source, example_filtered, target)]
    able = _mask_pyramid(allowed, pyramids[0])
    asked = _mask_pyramid(wanted, pyramids[2])
    result: Float32Array | None = None
    for level in range(levels - 1, -1, -1):
        source, filtered, given = (pyramid[level] for pyramid in pyramids)
        coarser = [p[level + 1] if level + 1 < levels else None for p in pyramids]
        example = make_pair(source, filtered, coarser[0], coarser[1])
        start = given if result is None else enlarge(result, given.shape)
        start = np.where(asked[level][..., None], start, given)
        made = make_pair(given, start, coarser[2], result)
        roots = feature_weights(given.shape[2], settings.alpha, coarsest=result is None)
        weaker = 1 + settings.kappa * 2.0**-level if settings.alpha is None else 1.0
        places = _run_level(example, made, roots, settings, able[level], asked[level], weaker)
        result = filtered_image(made, *given.shape[:2])
    assert result is not None
    return result, places


def _mask_pyramid(mask: BoolArray | None, images: list[Float32Array]) -> list[BoolArray]:
    """Return a mask for every level; a coarser pixel is set where any of its pixels is."""
    masks = [np.ones(images[0].shape[:2], np.bool_) if mask is None else mask]
    for image in images[1:]:
        height, width = image.shape[:2]
        missing = 2 * height - len(masks[-1]), 2 * width - masks[-1].shape[1]
        even = np.pad(masks[-1], ((0, missing[0]), (0, missing[1])))
        masks.append(np.asarray(even.reshape(height, 2, width, 2).any(axis=(1, 3)), np.bool_))
    return masks


def _run_level(
    example: Pair,
    made: Pair,
    roots: Float32Array,
    settings: Settings,
    allowed: BoolArray,
    wanted: BoolArray,
    weaker: float,
) -> Int32Array:
    """Fill the filtered image of `made`; return the places (h, w, 2) that its pixels are from."""
    where = np.argwhere(allowed).astype(np.int32)
    size, middle = len(roots), source_size(example.channels)
    parts = [(0, size)] if settings.alpha is None else [(0, middle), (middle, size)]
    trees = tuple(build_tree(example, where, roots, *part) for part in parts)
    places = np.full((*wanted.shape, 2), NOWHERE, np.int32)
    heap = new_heap(settings.leaves, trees)
    search = Search(trees, heap, settings.leaves, weaker)
    fill_level(example, made, search, roots, allowed, wanted, places)
    return places


@compiled_with(allocates=True)
def fill_level(
    example: Pair,
    made: Pair,
    search: Search,
    roots: Float32Array,
    allowed: BoolArray,
    wanted: BoolArray,
    places: Int32Array,
) -> None:
    """Synthesise one level, in scan order.

    Parameters
    ----------
    example
        A and A'.
    made
        B and B', whose pixels are written.
    roots
        (D,) square roots of the weights.
    allowed, wanted
        (H, W) and (h, w) masks of the example and the target.
    places
        (h, w, 2) matches; written.
    """
    feature, scratch = np.empty_like(roots), np.empty_like(roots)
    place, found = np.empty(2, np.int32), np.empty(2, np.int32)
    height, width = wanted.shape
    for row in range(height):
        for column in range(width):
            if not wanted[row, column]:
                continue
            gather_feature(made, row, column, roots, feature)
            coherent = find_coherent(
                example, roots, feature, scratch, allowed, places, (row, column), place
            )
            limit = coherent / search.weaker
            for tree in search.trees:
                if search_tree(tree, search.heap, feature, search.leaves, limit, found):
                    gather_feature(example, found[_ROW], found[_COLUMN], roots, scratch)
                    distance = squared_distance(scratch, feature)
                    if distance < limit:
                        limit = distance
                        place[:] = found
            places[row, column] = place
            here = made.filtered + row * made.row + column * made.channels
            there = example.filtered + place[_ROW] * example.row + place[_COLUMN] * made.channels
            for c in range(made.channels):
                made.values[here + c] = example.values[there + c]


@compiled_with(inside=True)
def find_coherent(
    example: Pair,
    roots: Float32Array,
    feature: Float32Array,
    scratch: Float32Array,
    allowed: BoolArray,
    places: Int32Array,
    pixel: tuple[int, int],
    place: Int32Array,
) -> float:
    """Write the best place (2,) that neighbours propose; return its squared distance or inf.

    `feature` (D,) is that of the `pixel`, a row and column, `scratch` (D,) working memory, `places`
    (h, w, 2) the matches so far, `allowed` (H, W) the pixels of the example that may be used.
    """
    (row, column), best, last_y, last_x = pixel, np.inf, NOWHERE, NOWHERE
    place[:] = NOWHERE
    for v in range(-RADIUS, 1):
        for u in range(-RADIUS, RADIUS + 1 if v < 0 else 0):
            if row + v < 0 or not 0 <= column + u < places.shape[1]:
                continue
            if places[row + v, column + u, _ROW] == NOWHERE:
                continue
            y = places[row + v, column + u, _ROW] - v
            x = places[row + v, column + u, _COLUMN] - u
            if not (0 <= y < allowed.shape[0] and 0 <= x < allowed.shape[1] and allowed[y, x]):
                continue
            if (y == last_y and x == last_x) or (y == place[_ROW] and x == place[_COLUMN]):
                continue  # neighbours of one piece propose the same
            last_y, last_x = y, x
            gather_feature(example, y, x, roots, scratch)
            distance = squared_distance(scratch, feature)
            if distance < best:
                best = distance
                place[_ROW], place[_COLUMN] = y, x
    return best
