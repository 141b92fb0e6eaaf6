"""Put a head under strands: where the scalp must be, as the roots and the way they grow tell."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.types.head import Capsules, Head
from hairkit.types.strands import Strands

_ROUNDS, _STILL = 40, 1e-6
_INNERMOST = 0.9
_SAMPLES = 600
_PATCH = 0.6
"""Roots that spread over less than this share of the scalp tell nothing about the head's size."""
_SMALLEST, _LARGEST = 0.7, 1.4
_BURIED, _BURIED_COST = 0.003, 0.03
"""Hair deeper than this in the head (m) counts as buried; wholly buried hair costs as much as
roots this far (m) from the scalp."""
_ASLANT_COST = 0.01
"""Roots that grow into the head cost as much as roots this far (m) from the scalp."""


@dataclass(frozen=True)
class Placing:
    """A head's scale about its origin, then its move, and how well it fits."""

    scale: float
    shift: Float64Array
    """(3,) metres."""
    distance: float
    """Mean distance of the roots from the scalp, metres."""
    cost: float
    """Distance, and metres for hair that lies in the head or grows into it."""


def placed(head: Head, scale: float, shift: Float64Array) -> Head:
    """Return the head scaled about the origin, then moved by `shift` (3,), metres."""
    shapes, shift32 = head.capsules, shift.astype(np.float32)
    return replace(
        head,
        vertices=scale * head.vertices + shift32,
        joints=scale * head.joints + shift32,
        capsules=Capsules(
            scale * shapes.first + shift32, scale * shapes.second + shift32, scale * shapes.radius
        ),
    )


def find_place(head: Head, strands: Strands, *, scaled: bool = True) -> Placing:
    """Return where the head fits under the strands best; it is never turned.

    Iterated closest points with a similarity without turning (Zinsser et al. 2005), the farthest
    tenth of the roots left out in each round, from several starts: as the head is, its scalp's
    middle at the roots', and its scalp where it faces the way the strands grow. Of these the one
    with the roots nearest and the least hair inside the head is taken. The size is kept where the
    roots are only a patch, or `scaled` is false.
    """
    sample = strands.select(np.unique(np.linspace(0, len(strands) - 1, _SAMPLES).astype(np.int64)))
    fit = _Fit(head, sample.resampled(5).points.reshape(-1, 5, 3).astype(np.float64))
    starts = [fit.improved(start, scaled) for start in fit.starts()]
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

    def improved(self, start: tuple[float, Float64Array], scaled: bool) -> Placing:
        """Return where iterated closest points lead from a start."""
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
        return self._judged(scale, shift)

    def _judged(self, scale: float, shift: Float64Array) -> Placing:
        distance, near = self.scalp_tree.query((self.roots - shift) / scale)
        off = scale * float(distance.mean())
        outward = (self.grown * self.scalp_normals[near]).sum(axis=1)
        local = (self.hair[:, 1:].reshape(-1, 3) - shift) / scale
        _, at = self.tree.query(local)
        depth = ((self.vertices[at] - local) * self.normals[at]).sum(axis=1)
        buried = float((depth > _BURIED).mean())
        cost = off + _BURIED_COST * buried + _ASLANT_COST * float((outward < 0).mean())
        return Placing(scale, shift, off, cost)
