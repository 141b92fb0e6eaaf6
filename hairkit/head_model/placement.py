"""Place a head under strands: fit its scalp to the roots and their directions of growth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.types.head import Head
from hairkit.types.strands import Strands

_ROUNDS, _STILL = 40, 1e-6
"""Iterations of closest points at most, and the move in metres at which they end."""
_INNERMOST = 0.9
"""Share of the roots nearest to the scalp that an iteration fits; the others may be outliers."""
_SAMPLES, _POINTS = 600, 5
"""Strands at most that are fitted, and points of each."""
_PATCH = 0.6
"""Roots that spread over less than this share of the scalp leave the head's size unknown."""
_SMALLEST, _LARGEST = 0.7, 1.4
"""Least and greatest scale of a head."""
_BURIED, _BURIED_COST = 0.003, 0.03
"""Depth in the head, metres, from which hair counts as buried, and the cost of burying all hair, as
a distance of the roots from the scalp in metres."""
_INWARD_COST = 0.01
"""Cost of roots that all grow into the head, as a distance of the roots in metres."""


@dataclass(frozen=True)
class Placing:
    """A head's scale about its origin, its translation after that, and the quality of the fit."""

    scale: float
    shift: Float64Array
    """(3,) metres."""
    distance: float
    """Mean distance of the roots from the scalp, metres."""
    cost: float
    """Distance plus the costs of hair in the head and of roots that grow into it, metres."""


def place_head(head: Head, scale: float, shift: Float64Array) -> Head:
    """Return the head scaled about the origin, then moved by `shift` (3,), metres."""
    factor, shift32 = np.float32(scale), shift.astype(np.float32)
    return head.carried(lambda points: factor * points + shift32, scale)


def find_place(head: Head, strands: Strands, *, scaled: bool = True) -> Placing:
    """Return the best placing of the head under the strands, without rotation.

    Iterative closest points with scale and translation (Zinsser et al. 2005), the farthest tenth of
    the roots left out in each round, from several starts: the head as it is, the scalp's middle at
    the roots', and the scalp's point that faces the growth there. The result with the least cost is
    returned. The size is kept where the roots are only a patch, or if `scaled` is false.
    """
    sample = strands.select(np.unique(np.linspace(0, len(strands) - 1, _SAMPLES).astype(np.int64)))
    hair = sample.resampled(_POINTS).points.reshape(-1, _POINTS, 3)
    fit = _Fit(head, hair.astype(np.float64))
    starts = [fit.improve(start, scaled) for start in fit.starts()]
    return min(starts, key=lambda place: place.cost)


class _Fit:
    """The head's surface and scalp, and five points of each sampled strand."""

    def __init__(self, head: Head, hair: Float64Array) -> None:
        self.hair, self.roots = hair, hair[:, 0]
        grown = hair[:, 1] - hair[:, 0]
        self.grown = grown / np.maximum(np.linalg.norm(grown, axis=1, keepdims=True), 1e-12)
        self.vertices, self.normals = head.vertices.astype(np.float64), head.normals()
        on_scalp = head.scalp > 0.5
        self.scalp, self.scalp_normals = self.vertices[on_scalp], self.normals[on_scalp]
        self.scalp_tree, self.tree = cKDTree(self.scalp), cKDTree(self.vertices)

    def starts(self) -> Iterable[tuple[float, Float64Array]]:
        """Yield scales and shifts to start from."""
        middle = self.roots.mean(axis=0)
        yield 1.0, np.zeros(3)
        yield 1.0, middle - self.scalp.mean(axis=0)
        ratio = np.ptp(self.roots, axis=0).max() / np.ptp(self.scalp, axis=0).max()
        scale = float(np.clip(ratio, _SMALLEST, _LARGEST))
        yield scale, middle - scale * self.scalp.mean(axis=0)
        facing = self.scalp_normals @ self.grown.mean(axis=0)
        yield 1.0, middle - self.scalp[facing.argmax()]

    def improve(self, start: tuple[float, Float64Array], scaled: bool) -> Placing:
        """Return the placing after iterative closest points from a start."""
        scale, shift = start
        patch = np.ptp(self.roots, axis=0).max() < _PATCH * np.ptp(self.scalp, axis=0).max()
        scale = 1.0 if patch or not scaled else scale
        for _ in range(_ROUNDS):
            distance, near = self.scalp_tree.query((self.roots - shift) / scale)
            inner = distance <= np.quantile(distance, _INNERMOST)
            wanted, have = self.roots[inner], self.scalp[near[inner]]
            offset = have - have.mean(axis=0)
            spread = float((offset**2).sum())
            if scaled and not patch and spread > 1e-9:
                fit = float((offset * (wanted - wanted.mean(axis=0))).sum()) / spread
                scale = float(np.clip(fit, _SMALLEST, _LARGEST))
            before, shift = shift, wanted.mean(axis=0) - scale * have.mean(axis=0)
            if np.abs(shift - before).max() < _STILL:
                break
        return self._evaluate(scale, shift)

    def _evaluate(self, scale: float, shift: Float64Array) -> Placing:
        """Return a placing with its distance and cost."""
        distance, near = self.scalp_tree.query((self.roots - shift) / scale)
        off = scale * float(distance.mean())
        outward = (self.grown * self.scalp_normals[near]).sum(axis=1)
        local = (self.hair[:, 1:].reshape(-1, 3) - shift) / scale
        _, at = self.tree.query(local)
        depth = ((self.vertices[at] - local) * self.normals[at]).sum(axis=1)
        buried = float((depth > _BURIED).mean())
        cost = off + _BURIED_COST * buried + _INWARD_COST * float((outward < 0).mean())
        return Placing(scale, shift, off, cost)
