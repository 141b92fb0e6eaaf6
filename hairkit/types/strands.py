"""Packed strands: every point of every strand in one array, with offsets."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import SupportsIndex

import numpy as np
import numpy.typing as npt

from hairkit.arrays import (
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    UInt8Array,
    freeze,
)
from hairkit.errors import DataError
from hairkit.storage import Stored
from hairkit.types.preview import Previewed, draw_turn

SEEN, CONTINUED = 0, 1
"""Groups of strands that photos show, and of those continued from them where photos show one side
of the head only. Photos from all around make one group."""
PLANTED = {"brows": 101, "lashes": 102, "beard": 103}
"""Groups of hair that brushes plant on the face, by name; all others are hair of the head."""
GROUP_NAMES = {number: name for name, number in PLANTED.items()}


@dataclass(frozen=True, eq=False)
class Strands(Previewed, Stored):
    """Polylines, root first, packed: strand s is `points[offsets[s]:offsets[s + 1]]`."""

    points: Float32Array
    """(P, 3) metres, head frame."""
    offsets: Int64Array
    """(S + 1,) ascending, first 0, last P; every strand has at least two points."""
    widths: Float32Array | None = None
    """(P,) diameters in metres."""
    root_uv: Float32Array | None = None
    """(S, 2) texture coordinates of the root on the head."""
    group: Int32Array | None = None
    """(S,) group number, for engines that shade or simulate groups apart."""
    guide: BoolArray | None = None
    """(S,) true for guides, false for interpolated hair."""
    colours: Float32Array | None = None
    """(P, 3) linear RGB in [0, 1]; None: the ramp of the groom's material."""

    def __post_init__(self) -> None:
        points = freeze(self, "points", np.float32, (None, 3), "strand points")
        offsets = freeze(self, "offsets", np.int64, (None,), "strand offsets")
        if not len(offsets) or offsets[0] != 0 or offsets[-1] != len(points):
            raise DataError(f"strand offsets must run from 0 to {len(points)}")
        if (np.diff(offsets) < 2).any():
            raise DataError(
                f"{np.count_nonzero(np.diff(offsets) < 2)} strands have fewer than two points"
            )
        count, total = len(offsets) - 1, len(points)
        freeze(self, "widths", np.float32, (total,))
        freeze(self, "root_uv", np.float32, (count, 2))
        freeze(self, "group", np.int32, (count,))
        freeze(self, "guide", np.bool_, (count,))
        freeze(self, "colours", np.float32, (total, 3))

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, index: SupportsIndex) -> Float32Array:
        """Return the points (n, 3) of one strand, root first; negative counts from the last."""
        number = range(len(self))[operator.index(index)]
        return self.points[self.offsets[number] : self.offsets[number + 1]]

    def __repr__(self) -> str:
        mean = f", {100 * self.lengths().mean():.1f} cm mean length" if len(self) else ""
        return f"Strands({len(self)} strands, {len(self.points)} points{mean})"

    def preview(self) -> UInt8Array | None:
        """Return front, left and back, (H, W, 3) uint8 RGB; None without strands."""
        return draw_turn(None, self)

    @property
    def counts(self) -> Int64Array:
        """(S,) points of each strand."""
        return np.diff(self.offsets)

    @property
    def roots(self) -> Float32Array:
        """(S, 3) first points."""
        return self.points[self.offsets[:-1]]

    @property
    def tips(self) -> Float32Array:
        """(S, 3) last points."""
        return self.points[self.offsets[1:] - 1]

    @property
    def planted(self) -> BoolArray:
        """(S,) true for brows, lashes and beard."""
        group = np.zeros(len(self), np.int32) if self.group is None else self.group
        return np.isin(group, [*PLANTED.values()])

    @property
    def strand_of_point(self) -> Int64Array:
        """(P,) number of the strand that each point belongs to."""
        return np.repeat(np.arange(len(self)), self.counts)

    def segments(self) -> tuple[Float32Array, Int64Array]:
        """Return segment vectors (P - S, 3) and the index (P - S,) of each one's first point."""
        first = np.delete(np.arange(len(self.points)), self.offsets[1:] - 1)
        return self.points[first + 1] - self.points[first], first

    def arc_lengths(self) -> Float64Array:
        """Return (P,) the distance of every point from its root along the strand, metres."""
        total = np.cumsum(self._steps())
        return total - np.repeat(total[self.offsets[:-1]], self.counts)

    def lengths(self) -> Float64Array:
        """Return (S,) strand lengths, metres."""
        return np.add.reduceat(self._steps(), self.offsets[:-1])

    def _steps(self) -> Float64Array:
        """Return (P,) the distance of every point from the one before it, 0 at roots, metres."""
        edges = np.diff(self.points.astype(np.float64), axis=0)
        steps = np.zeros(len(self.points))
        steps[1:] = np.sqrt(np.einsum("pk,pk->p", edges, edges))
        steps[self.offsets[:-1]] = 0
        return steps

    def tangents(self) -> Float32Array:
        """Return (P, 3) unit directions root to tip: forward differences, repeated at the tip."""
        difference = np.zeros((len(self.points), 3))
        difference[:-1] = np.diff(self.points.astype(np.float64), axis=0)
        last = self.offsets[1:] - 1
        difference[last] = difference[last - 1]
        length = np.linalg.norm(difference, axis=1, keepdims=True)
        return np.asarray((difference / np.maximum(length, 1e-12)).astype(np.float32))

    def select(self, keep: npt.ArrayLike) -> Strands:
        """Return the strands that a mask (S,) or an index array picks, in that order."""
        index = np.asarray(keep)
        index = np.flatnonzero(index) if index.dtype == bool else index.astype(np.int64)
        counts = self.counts[index]
        offsets = np.concatenate([[0], np.cumsum(counts)])
        rows = np.arange(offsets[-1]) + np.repeat(self.offsets[:-1][index] - offsets[:-1], counts)
        return Strands(
            self.points[rows],
            offsets,
            None if self.widths is None else self.widths[rows],
            None if self.root_uv is None else self.root_uv[index],
            None if self.group is None else self.group[index],
            None if self.guide is None else self.guide[index],
            None if self.colours is None else self.colours[rows],
        )

    def resampled(self, count: int) -> Strands:
        """Return strands of `count` points at equal arc length; ends stay, the rest is mixed."""
        if count < 2:
            raise DataError(f"a strand needs at least 2 points, got {count}")
        return self._at(np.full(len(self), count))

    def resampled_at(self, shares: Float64Array) -> Strands:
        """Return strands with points at rising shares (m,) or (S, m), 0 to 1, of their length."""
        count = shares.shape[-1]
        own = np.broadcast_to(shares, (len(self), count))
        return self._at(np.full(len(self), count), own.ravel())

    def resampled_by_length(self, step: float) -> Strands:
        """Return strands with points about `step` metres apart, equal in a strand; ends stay."""
        if not step > 0:
            raise DataError(f"resampling step is {step}, expected metres above 0")
        return self._at(np.maximum(np.ceil(self.lengths() / step - 1e-9).astype(np.int64), 1) + 1)

    def _at(self, counts: Int64Array, shares: Float64Array | None = None) -> Strands:
        offsets = np.concatenate([[0], np.cumsum(counts)])
        after, t = self.places(counts, shares)
        points = _mix(self.points, after, t[:, None])
        widths = None if self.widths is None else _mix(self.widths, after, t)
        colours = None if self.colours is None else _mix(self.colours, after, t[:, None])
        return replace(self, points=points, offsets=offsets, widths=widths, colours=colours)

    def moved_and_resampled(self, frames: Float32Array, count: int) -> Float32Array:
        """Return frames (T, P, 3) of these strands at the points (T, S count, 3) of `resampled`.

        The points are the same matter in every frame, wherever it has moved.
        """
        after, t = self.places(np.full(len(self), count))
        return _mix(frames.swapaxes(0, 1), after, t[:, None, None]).swapaxes(0, 1)

    def places(
        self, counts: Int64Array, shares: Float64Array | None = None
    ) -> tuple[Int64Array, Float64Array]:
        """Return the point after each new one, and how far on the new one lies between both.

        There are `counts` (S,) of them, at `shares` of their strand's length; None: evenly spaced.
        """
        offsets = np.concatenate([[0], np.cumsum(counts)])
        arc = self.arc_lengths()
        length = arc[self.offsets[1:] - 1]
        if shares is None:
            rank = np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts)
            shares = rank / np.repeat(counts - 1, counts)
        wanted = shares * np.repeat(length, counts)
        # a strictly ascending key over all strands
        base = np.concatenate([[0.0], np.cumsum(length + 1.0)])[:-1]
        key = arc + np.repeat(base, self.counts)
        target = wanted + np.repeat(base, counts)
        after = np.clip(
            np.searchsorted(key, target, side="right"),
            np.repeat(self.offsets[:-1], counts) + 1,
            np.repeat(self.offsets[1:], counts) - 1,
        )
        span = np.maximum(key[after] - key[after - 1], 1e-12)
        return after, np.clip((target - key[after - 1]) / span, 0, 1)

    @staticmethod
    def from_list(strands: Sequence[npt.ArrayLike]) -> Strands:
        """Pack arrays of shape (n, 3), one a strand, root first."""
        arrays = [np.asarray(strand, np.float32).reshape(-1, 3) for strand in strands]
        offsets = np.concatenate([[0], np.cumsum([len(array) for array in arrays])])
        points = np.concatenate(arrays) if arrays else np.zeros((0, 3), np.float32)
        return Strands(points, offsets)


def _mix(values: npt.NDArray[np.float32], after: Int64Array, t: Float64Array) -> Float32Array:
    return (values[after - 1] * (1 - t) + values[after] * t).astype(np.float32)
