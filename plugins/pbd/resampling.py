"""Resampling of guides to rods, and the embedding of guide points in rods.

All rods have the same number of nodes, so that they can be solved in parallel. Each guide point
keeps its offset in the rod's frame at its arc length, so that curls finer than the nodes move and
rotate with the rod and are exact at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.simulation import quaternion
from hairkit.types.strands import Strands

SHORTEST = 0.015
"""Length, metres, of the straight rods that shorter guides are part of: between nodes that are much
less than a millimetre apart, what a head moves in a substep is more than a segment."""
LARGEST_TURN = 0.7
"""Largest angle between segments at rest, radians; beyond, the coupling to twist is stiff."""
_ROUNDS = 60
FOLLOWED = 10.0
"""Bending of curled rods is stable in steps of h up to EI / (rho A) h^2 c^3 / l^4 of 10 to 20; here
l is a segment's length and c the turn from one to the next: measured on coils of 0.1 to 0.7."""


def node_points(strands: Strands, nodes: int) -> Float64Array:
    """Return (S, n, 3) nodes at equal distances along the guides.

    If the turn at a node exceeds `LARGEST_TURN` (a fold, or curls finer than the nodes), the guide
    is smoothed; roots stay.
    """
    points = strands.resampled(nodes).points.reshape(len(strands), nodes, 3).astype(np.float64)
    for _ in range(_ROUNDS):
        sharp = _largest_turn(points) > LARGEST_TURN
        if not sharp.any():
            break
        some = points[sharp]
        some[:, 1:-1] = 0.25 * some[:, :-2] + 0.5 * some[:, 1:-1] + 0.25 * some[:, 2:]
        offsets = np.arange(len(some) + 1) * nodes
        even = Strands(some.reshape(-1, 3).astype(np.float32), offsets).resampled(nodes)
        points[sharp] = even.points.reshape(some.shape)
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    bad = (length.min(axis=1) < SHORTEST / nodes) | (_largest_turn(points) > LARGEST_TURN)
    if bad.any():
        step = np.maximum(length.mean(axis=1), SHORTEST / nodes)[bad, None, None]
        way = points[bad, -1] - points[bad, 0]
        way[np.linalg.norm(way, axis=1) < 1e-9] = [0.0, 1.0, 0.0]
        along = np.arange(nodes)[None, :, None] * step
        points[bad] = points[bad, :1] + along * quaternion.normalize(way)[:, None]
    return points


def max_stiffness(points: Float64Array, step: float) -> Float64Array:
    """Return the largest stable EI over mass per length (S,), m^4/s^2, for a time step.

    Natural curvature uses the frames of the previous step, which limits short, stiff and sharply
    curled rods only; their lowest mode is far above visible motion of hair.
    """
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1).mean(axis=1)
    curl = np.maximum(_largest_turn(points), 1e-3)
    result: Float64Array = FOLLOWED * length**4 / (step**2 * curl**3)
    return result


def overhang(points: Float64Array) -> Float64Array:
    """Return the largest product along rods (S, n, 3) of lever and length squared (S,), m^3.

    At each node, what lies beyond it has a length, and its middle is off to the side, by the lever.
    """
    edge = np.diff(points, axis=1)
    length = np.linalg.norm(edge, axis=-1)
    level = 0.5 * (points[:, 1:] + points[:, :-1])[..., [0, 2]]
    beyond = np.cumsum(length[:, ::-1], axis=1)[:, ::-1]
    moment = np.cumsum((length[..., None] * level)[:, ::-1], axis=1)[:, ::-1]
    moment = moment - beyond[..., None] * points[:, :-1, [0, 2]]
    result: Float64Array = (np.linalg.norm(moment, axis=-1) * beyond).max(axis=1)
    return result


def _largest_turn(points: Float64Array) -> Float64Array:
    """Return the largest turn (S,) at a node, radians."""
    direction = quaternion.normalize(np.diff(points, axis=1))
    cosine = (direction[:, 1:] * direction[:, :-1]).sum(axis=-1)
    result: Float64Array = np.arccos(np.clip(cosine, -1.0, 1.0)).max(axis=1)
    return result


@dataclass(frozen=True, eq=False)
class Embedding:
    """Guide points embedded in rods."""

    identity: bool
    """True where the guides' points are the nodes themselves."""
    rod: Int64Array
    """(P,) rod index."""
    segment: Int64Array
    """(P,) segment index in the rod."""
    share: Float64Array
    """(P,) fraction along the segment."""
    offset: Float64Array
    """(P, 3) offset from the rod, in its frame there, metres."""
    length: Float64Array
    """(P,) distance to the point before, metres; 0 at roots."""
    starts: Int64Array
    """(S + 1,) where the points of each rod begin."""

    def curve(self, position: Float64Array, frames: Float64Array) -> Float64Array:
        """Return the places (P, 3) that rods at `position` (S, n, 3) carry the points to.

        They are farther apart or closer than the points where a rod bends; see
        `drawn_points.draw_points`.
        """
        if self.identity:
            return position.reshape(-1, 3)
        place, frame = _places(position, frames, self.rod, self.segment, self.share)
        return place + quaternion.rotate(frame, self.offset)


def embed_points(strands: Strands, position: Float64Array, frames: Float64Array) -> Embedding:
    """Embed guide points in rods at rest, (S, n, 3) with segment frames (S, n - 1, 4)."""
    segments = position.shape[1] - 1
    rod = strands.strand_of_point
    arc = strands.arc_lengths()
    length = np.linalg.norm(np.diff(position, axis=1), axis=-1).sum(axis=1)
    total = np.maximum(arc[strands.offsets[1:] - 1], length)[rod]
    along = arc / total * segments
    segment = np.minimum(along.astype(np.int64), segments - 1)
    share = along - segment
    place, frame = _places(position, frames, rod, segment, share)
    apart = strands.points - place
    same = (strands.counts == segments + 1).all() and float(np.abs(apart).max(initial=0)) < 1e-7
    offset = quaternion.rotate(quaternion.inverse(frame), apart)
    own = strands.points.astype(np.float64)
    size = np.linalg.norm(np.diff(own, axis=0, prepend=own[:1]), axis=1)
    size[strands.offsets[:-1]] = 0.0
    return Embedding(same, rod, segment, share, offset, size, strands.offsets)


def _places(
    position: Float64Array,
    frames: Float64Array,
    rod: Int64Array,
    segment: Int64Array,
    share: Float64Array,
) -> tuple[Float64Array, Float64Array]:
    """Return positions on the Catmull-Rom curve through the nodes, and interpolated frames."""
    last = position.shape[1] - 1
    t = share[:, None]
    a, b = position[rod, segment], position[rod, segment + 1]
    before, after = (
        position[rod, np.maximum(segment - 1, 0)],
        position[rod, np.minimum(segment + 2, last)],
    )
    slope_a = np.where((segment == 0)[:, None], b - a, (b - before) / 2)
    slope_b = np.where((segment == last - 1)[:, None], b - a, (after - a) / 2)
    one, two = t * t * (3 - 2 * t), t * (1 - t)
    place = a + (b - a) * one + two * ((1 - t) * slope_a - t * slope_b)
    # a segment's frame is at its middle
    towards = np.where(share < 0.5, -1, 1)
    other = np.clip(segment + towards, 0, last - 1)
    part = np.abs(share - 0.5)[:, None]
    here, there = frames[rod, segment], frames[rod, other]
    sign = np.where((here * there).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    return place, quaternion.normalize((1 - part) * here + part * sign * there)
