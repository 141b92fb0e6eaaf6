"""How far hair grows from the roots of its guides: as far as guides stand near each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float64Array

_ORDER = 3
"""The spacing at a guide is the distance of its third nearest other guide: the nearest may share
its tuft, and in a row of guides the third is two places away."""
_SPACINGS = 1.5
"""Reach of a guide in spacings. Roots of Poisson discs leave no point of the scalp farther away
than this (tests/head_model/test_reach.py), so that hair of whole heads stays as it is."""
_STRAY = 3.0
"""Spacings beyond this many medians are those of stray guides, which grow no more than others."""
_LEAST, _ALONE = 0.003, 0.01
"""Metres: reach of guides that stand in tufts, and of three guides or fewer."""
_COVERING = 8
"""Guides that are asked whether they reach a point."""


@dataclass(frozen=True, eq=False)
class Reach:
    """The region in which guides are dense enough to interpolate hair between them."""

    tree: cKDTree
    """Roots of the guides."""
    radius: Float64Array
    """(G,) metres within which each guide's hair grows."""

    @classmethod
    def of(cls, roots: npt.ArrayLike) -> Reach:
        """Return the region around the roots (G, 3) of guides, metres; at least one."""
        points = np.asarray(roots, np.float64).reshape(-1, 3)
        tree = cKDTree(points)
        if len(points) <= _ORDER:
            return cls(tree, np.full(len(points), _ALONE))
        spacing = tree.query(points, k=[_ORDER + 1])[0][:, 0]
        spacing = np.minimum(spacing, _STRAY * np.median(spacing))
        return cls(tree, np.maximum(_SPACINGS * spacing, _LEAST))

    def covers(self, points: npt.ArrayLike, margin: npt.ArrayLike = 0.0) -> BoolArray:
        """Return (N,) which points (N, 3) a guide reaches, or nearly: within a margin (N,)."""
        places = np.asarray(points, np.float64).reshape(-1, 3)
        room = np.broadcast_to(np.asarray(margin, np.float64), len(places))
        distance, near = self.tree.query(places)
        covered: BoolArray = distance <= self.radius[near] + room
        rest = np.flatnonzero(~covered)  # most points lie within reach of the nearest guide
        others = range(2, min(_COVERING, len(self.radius)) + 1)
        if len(rest) and others:
            distance, near = self.tree.query(places[rest], k=[*others])
            covered[rest] = (distance <= self.radius[near] + room[rest, None]).any(axis=1)
        return covered
