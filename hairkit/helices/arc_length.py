"""Strands as smooth curves over arc length: points and tangents anywhere along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.types.strands import Strands


@dataclass(frozen=True, eq=False)
class Path:
    """Strands in float64 with arc lengths and tangents at their points."""

    points: Float64Array
    """(P, 3) metres."""
    tangents: Float64Array
    """(P, 3) unit, of the parabola through each point and its neighbours."""
    arc: Float64Array
    """(P,) metres from the root."""
    key: Float64Array
    """(P,) arc length plus where the strand starts among all: ascending over all strands."""
    offsets: Int64Array
    """(S + 1,) of the points."""

    @classmethod
    def of(cls, strands: Strands) -> Path:
        """Measure strands."""
        points, offsets = strands.points.astype(np.float64), strands.offsets
        arc = strands.arc_lengths()
        base = np.concatenate([[0.0], np.cumsum(arc[offsets[1:] - 1] + 1.0)])[:-1]
        key = arc + np.repeat(base, strands.counts)
        return cls(points, _tangents(points, arc, offsets), arc, key, offsets)

    @property
    def lengths(self) -> Float64Array:
        """(S,) metres."""
        return self.arc[self.offsets[1:] - 1]

    def at(self, strand: Int64Array, arc: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Return points and unit tangents (N, 3) at arc lengths (N,) of strands (N,).

        Points lie on the cubic that has the points' positions and tangents (Hermite).
        """
        target = arc + self.key[self.offsets[:-1]][strand]
        low, high = self.offsets[strand], self.offsets[strand + 1] - 2
        before = np.clip(np.searchsorted(self.key, target, side="right") - 1, low, high)
        span = np.maximum(self.arc[before + 1] - self.arc[before], 1e-12)
        u = np.clip((arc - self.arc[before]) / span, 0, 1)[:, None]
        p, q = self.points[before], self.points[before + 1]
        a, b = self.tangents[before] * span[:, None], self.tangents[before + 1] * span[:, None]
        chord = q - p
        bent = p + u * (a + u * (3 * chord - 2 * a - b + u * (a + b - 2 * chord)))
        slope = a + u * (2 * (3 * chord - 2 * a - b) + 3 * u * (a + b - 2 * chord))
        return bent, unit(slope)


def dot(a: Float64Array, b: Float64Array) -> Float64Array:
    """Return the inner products (...) of vectors (..., 3)."""
    return np.asarray(np.einsum("...i,...i->...", a, b))  # many times faster than a sum


def unit(vector: Float64Array) -> Float64Array:
    """Return vectors (..., 3) at length 1; zeros stay."""
    length = np.sqrt(dot(vector, vector))[..., None]
    return vector / np.where(length > 0, length, 1.0)


def _tangents(points: Float64Array, arc: Float64Array, offsets: Int64Array) -> Float64Array:
    """Return unit tangents of parabolas over arc length; at ends the parabola goes on."""
    step = np.maximum(np.diff(arc), 1e-12)[:, None]
    slope = np.diff(points, axis=0) / step
    result = np.empty_like(points)
    result[1:-1] = (step[1:] * slope[:-1] + step[:-1] * slope[1:]) / (step[1:] + step[:-1])
    first, last = offsets[:-1], offsets[1:] - 1
    result[first], result[last] = slope[first], slope[last - 1]
    longer = np.diff(offsets) > 2
    first, last = first[longer], last[longer]
    result[first] = 2 * slope[first] - result[first + 1]
    result[last] = 2 * slope[last - 1] - result[last - 1]
    return unit(result)
