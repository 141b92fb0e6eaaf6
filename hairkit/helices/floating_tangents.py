"""Floating tangents: a strand as helix arcs that join with common tangents (G1).

The strand is cut into n equal lengths; the tangents at the cuts are kept and the points are
released, each as little as possible, until every neighbouring pair is co-helical: <d_i, e_i> = 0
with d_i from point to point and e_i along the change of tangent. With u_i the moves of the points
(u_0 = 0) this is min sum |u_i|^2 subject to <u_{i+1} - u_i, e_i> = -<p_{i+1} - p_i, e_i>, whose
multipliers solve one banded system. One arc then goes through each pair.

Derouet-Jourdan, Bertails-Descoubes and Thollot, "Floating tangents for approximating spatial curves
with G1 piecewise helices", 2013; patent, steps 4 and 5.

Two things are added here. Tangents of nearly straight, frizzy hair say little about its course, so
they are first turned towards the chords beside them, which halves the error. And where a chord
stands so far off the mean tangent that its arc would turn more than half a turn, a second condition
on it keeps the arc at half a turn: no loops where two tangents happen to be alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded

from hairkit.arrays import Float64Array, Int64Array
from hairkit.helices.arc_between import helix_through
from hairkit.helices.arc_length import Path, dot, unit
from hairkit.helices.helix import along_arc
from hairkit.types.strands import Strands

TANGENT_STEPS = 3
"""Times that tangents are turned towards the chords."""
TANGENT_WEIGHT = 0.3
"""Weight of the previous tangents in one step; chords have weight 1."""
LIMIT_STEPS = 4
"""Times that arcs over half a turn are looked for."""
FARTHEST = 0.5
"""Radians that a chord can ask for in one step."""
_COINCIDENT = 1e-9
LEAST_ALONG = 0.3
"""Least part of a chord along the mean tangent, share of its length, by which slopes are taken."""


@dataclass(frozen=True, eq=False)
class Arcs:
    """Helix arcs of all strands, packed: strand s has arcs `offsets[s]` to `offsets[s + 1]`."""

    points: Float64Array
    """(A, 3) where each arc starts, metres."""
    tangents: Float64Array
    """(A, 3) unit tangent there."""
    darboux: Float64Array
    """(A, 3) Darboux vector in the frame of the points, radians per metre."""
    lengths: Float64Array
    """(A,) metres."""
    offsets: Int64Array
    """(S + 1,) ascending, first 0."""

    def at(self, arc: Int64Array, share: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Return points and unit tangents (N, 3) at shares (N,) of the lengths of arcs (N,)."""
        return along_arc(
            self.points[arc], self.tangents[arc], self.darboux[arc], share * self.lengths[arc]
        )


def fit_arcs(path: Path | Strands, counts: Int64Array, *, turning: bool = True) -> Arcs:
    """Return `counts` (S,) helix arcs for each strand; roots stay where they are.

    `turning=False` keeps the tangents as they are, as in the paper; then arcs may turn more than
    half a turn.
    """
    path = Path.of(path) if isinstance(path, Strands) else path
    first, offsets = cuts(counts)
    points, tangents = path.at(*even(path, counts))
    if turning:
        points, tangents = _release_points(points, tangents, first)
    else:
        frame = _frame(tangents, first)
        points = points + _release(points, frame, first, np.zeros(len(first)))
    last = first + 1
    darboux, lengths = helix_through(points[first], tangents[first], points[last], tangents[last])
    return Arcs(points[first], tangents[first], darboux, lengths, offsets)


def cuts(counts: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return each arc's first cut among all strands' cuts (A,), and the arcs' offsets (S + 1,)."""
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return np.arange(offsets[-1]) + np.repeat(np.arange(len(counts)), counts), offsets


def even(path: Path, counts: Int64Array) -> tuple[Int64Array, Float64Array]:
    """Return strand (C,) and arc length (C,) of the n + 1 equally spaced cuts of every strand."""
    strand = np.repeat(np.arange(len(counts)), counts + 1)
    start = np.cumsum(counts + 1) - (counts + 1)
    rank = np.arange(len(strand)) - start[strand]
    return strand, rank / counts[strand] * path.lengths[strand]


def _release_points(
    points: Float64Array, tangents: Float64Array, first: Int64Array
) -> tuple[Float64Array, Float64Array]:
    """Return points and tangents with co-helical pairs whose arcs turn at most half a turn."""
    for _ in range(TANGENT_STEPS):
        tangents = _turn_tangents(points, tangents, first)
    limit, frame = np.zeros(len(first)), _frame(tangents, first)
    moved = points + _release(points, frame, first, limit)
    for _ in range(LIMIT_STEPS):
        excess, bound = _excess(moved, frame, first)
        new = (limit == 0) & (excess != 0)
        if not new.any():
            break
        limit = np.where(new, np.sign(excess) * bound, limit)
        moved = points + _release(points, frame, first, limit)
    return moved, tangents


class _Frame(NamedTuple):
    """Directions of every pair of tangents."""

    e: Float64Array
    """(A, 3) unit, along the change of tangent."""
    m: Float64Array
    """(A, 3) unit, along the sum."""
    b: Float64Array
    """(A, 3) m x e."""
    bound: Float64Array
    """(A,) the chord's slope to b on an arc of half a turn, (2 / pi) tan(half the angle)."""


def _frame(tangents: Float64Array, first: Int64Array) -> _Frame:
    start, end = tangents[first], tangents[first + 1]
    m = unit(start + end)
    change = end - start
    spare = np.eye(3)[np.argmin(np.abs(m), axis=-1)]
    tiny = dot(change, change)[:, None] < _COINCIDENT**2
    e = np.where(tiny, np.cross(m, spare), change)
    e = unit(e - dot(e, m)[:, None] * m)
    half = np.sqrt(dot(change, change)) / 2
    bound = (2 / np.pi) * half / np.sqrt(np.maximum(1 - half**2, 1e-6)) + _COINCIDENT
    return _Frame(e, m, np.cross(m, e), bound)


def _excess(
    points: Float64Array, frame: _Frame, first: Int64Array
) -> tuple[Float64Array, Float64Array]:
    """Return each chord's slope to b beyond that of half a turn, signed, and that slope."""
    chord = points[first + 1] - points[first]
    slope = dot(chord, frame.b) / _along(chord, frame.m)
    return np.sign(slope) * np.maximum(np.abs(slope) - frame.bound, 0.0), frame.bound


def _along(chord: Float64Array, m: Float64Array) -> Float64Array:
    """Return the chords' parts along m, kept away from 0, by which slopes are taken."""
    least = np.maximum(LEAST_ALONG * np.sqrt(dot(chord, chord)), 1e-12)
    return np.maximum(dot(chord, m), least)


def _turn_tangents(points: Float64Array, tangents: Float64Array, first: Int64Array) -> Float64Array:
    """Return tangents turned towards the chords beside them: one linear least-squares step.

    A pair wants its mean tangent to turn by what stands in the way of a co-helical arc of up to
    half a turn: the chord's slope to e, and its excess to b.
    """
    frame = _frame(tangents, first)
    excess, _ = _excess(points, frame, first)
    e, m, b, _ = frame
    chord = points[first + 1] - points[first]
    slope = np.clip(dot(chord, e) / _along(chord, m), -FARTHEST, FARTHEST)
    wish = slope[:, None] * e + np.clip(excess, -FARTHEST, FARTHEST)[:, None] * b
    wishes, arcs = np.zeros_like(tangents), np.zeros(len(tangents))
    for corner in (first, first + 1):
        wishes[corner] += wish / 2
        arcs[corner] += 1
    band = np.zeros((2, len(tangents)))
    band[1] = TANGENT_WEIGHT + arcs / 4
    band[0, first + 1] = 0.25
    return unit(tangents + solveh_banded(band, wishes, check_finite=False))


def _release(
    points: Float64Array, frame: _Frame, first: Int64Array, limit: Float64Array
) -> Float64Array:
    """Return the smallest moves (C, 3) of the cuts that make all pairs co-helical.

    Where `limit` (A,) is not 0 the chord also gets that slope to b. Rows of the conditions are two
    an arc, the second one empty where there is no limit.
    """
    e, m, b, _ = frame
    rows = np.stack([e, unit(b - limit[:, None] * m)], axis=1)
    active = np.stack([np.ones(len(first), bool), limit != 0], axis=1)
    rows = np.where(active[..., None], rows, 0.0)
    gap = (rows @ (points[first + 1] - points[first])[..., None])[..., 0]
    rooted = np.diff(first, prepend=-2) > 1  # the root does not move
    own = np.where(rooted, 1.0, 2.0)
    band = np.zeros((4, len(first), 2))
    band[3] = np.where(active, own[:, None], 1.0)
    band[2, :, 1] = own * dot(rows[:, 0], rows[:, 1])
    joint = np.where(rooted[1:, None, None], 0.0, -rows[:-1] @ rows[1:].swapaxes(1, 2))
    band[1, 1:, 0], band[0, 1:, 1] = joint[:, 0, 0], joint[:, 0, 1]
    band[2, 1:, 0], band[1, 1:, 1] = joint[:, 1, 0], joint[:, 1, 1]
    multiplier = solveh_banded(band.reshape(4, -1), gap.ravel(), check_finite=False)
    push = (multiplier.reshape(-1, 2, 1) * rows).sum(1)
    moves = np.zeros_like(points)
    moves[first + 1] -= push
    moves[first] += np.where(rooted[:, None], 0.0, push)
    return moves
