"""Guides as chains of as many nodes each, with the guides' own points on these.

Curls finer than the nodes move and turn with them: each point keeps its offset in the frame at its
arc length; it is exact at rest. A held point is pulled to its hand, at the nearest node, as hair is
to its captured shape.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.parallel import compiled
from hairkit.simulation import quaternion
from hairkit.simulation import vectors as v
from hairkit.simulation.rigid_motion import transform_points
from hairkit.simulation.vectors import Floats, Frame, Vector, inlined
from hairkit.types.strands import Strands

SHORTEST = 0.015
"""Length, metres, of the straight chains that shorter guides are part of: between nodes that are
much less than a millimetre apart, what a head moves in a substep is more than a segment."""
LARGEST_TURN = 0.7
"""Largest angle between segments at rest, radians; beyond, the coupling to twist is stiff."""
_ROUNDS = 60
FIRM = 4e5
"""1/s^2: squared frequency, of 100 Hz, of the pull to a hand: a strand's weight moves it 0.3 mm."""
TAUT = 0.999
"""Largest distance of a hand from the root, as a share of the strand's length."""


class Embedding(NamedTuple):
    """Guide points on rods, or on other chains of nodes with a frame for each segment."""

    rod: Int64Array
    """(P,) rod index."""
    segment: Int64Array
    """(P,) segment index in the rod."""
    share: Float64Array
    """(P,) fraction along the segment."""
    offset: Float64Array
    """(P, 3) offset from the rod, in its frame there, metres."""


def node_points(strands: Strands, nodes: int) -> Float64Array:
    """Return (S, n, 3) nodes at equal distances along the guides.

    If the turn at a node exceeds `LARGEST_TURN` (a fold, or curls finer than the nodes), the guide
    is smoothed; roots stay.
    """
    points = strands.resampled(nodes).points.reshape(len(strands), nodes, 3).astype(np.float64)
    for _ in range(_ROUNDS):
        sharp = largest_turn(points) > LARGEST_TURN
        if not sharp.any():
            break
        some = points[sharp]
        some[:, 1:-1] = 0.25 * some[:, :-2] + 0.5 * some[:, 1:-1] + 0.25 * some[:, 2:]
        offsets = np.arange(len(some) + 1) * nodes
        even = Strands(some.reshape(-1, 3).astype(np.float32), offsets).resampled(nodes)
        points[sharp] = even.points.reshape(some.shape)
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    bad = (length.min(axis=1) < SHORTEST / nodes) | (largest_turn(points) > LARGEST_TURN)
    if bad.any():
        step = np.maximum(length.mean(axis=1), SHORTEST / nodes)[bad, None, None]
        way = points[bad, -1] - points[bad, 0]
        way[np.linalg.norm(way, axis=1) < 1e-9] = [0.0, 1.0, 0.0]
        along = np.arange(nodes)[None, :, None] * step
        points[bad] = points[bad, :1] + along * quaternion.normalize(way)[:, None]
    return points


def directions(points: Floats) -> Float64Array:
    """Return the directions (..., n - 1, 3) of segments between points (..., n, 3)."""
    return quaternion.normalize(np.diff(points, axis=-2).astype(np.float64))


def largest_turn(points: Float64Array) -> Float64Array:
    """Return the largest turn (S,) at a node, radians."""
    direction = directions(points)
    cosine = (direction[:, 1:] * direction[:, :-1]).sum(axis=-1)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)).max(axis=1))


def embed_points(strands: Strands, position: Float64Array, frames: Float64Array) -> Embedding:
    """Embed guide points in rods at rest, (S, n, 3) with segment frames (S, n - 1, 4)."""
    segments = position.shape[1] - 1
    rod = strands.strand_of_point
    arc = strands.arc_lengths()
    length = np.linalg.norm(np.diff(position, axis=1), axis=-1).sum(axis=1)
    total = np.maximum(arc[strands.offsets[1:] - 1], length)[rod]
    along = arc / total * segments
    segment = np.minimum(along.astype(np.int64), segments - 1)
    own = strands.points.astype(np.float64)
    made = Embedding(rod, segment, along - segment, np.zeros_like(own))
    measure_offsets(made, position[:, None], frames[:, None], own)
    return made


def hand_goals(
    on: Embedding, rest: Float64Array, hands: dict[int, Float64Array], back: Float64Array
) -> tuple[Int64Array, Int64Array, Float64Array]:
    """Return rod and node (G,) of each held point, and where it is pulled to (G, 3), head axes.

    `rest` (S, n, 3) are the nodes at rest, `hands` the places (3,) of those that hold points,
    world, and `back` (4, 4) transforms the world to the head axes. A hand that the strand does not
    reach pulls to the nearest point that it does.
    """
    rod, node = held_nodes(on, tuple(hands))
    root = rest[rod, 0]
    away = transform_points(back, np.array([*hands.values()]).reshape(-1, 3)) - root
    length = np.linalg.norm(np.diff(rest[rod], axis=1), axis=-1)
    reach = TAUT * np.cumsum(length, axis=1)[np.arange(len(rod)), node - 1]
    away *= np.minimum(1.0, reach / np.maximum(np.linalg.norm(away, axis=1), 1e-12))[:, None]
    return rod, node, root + away


def held_nodes(embedding: Embedding, held: tuple[int, ...]) -> tuple[Int64Array, Int64Array]:
    """Return rod and node (G,) nearest to the held points; roots are not held."""
    index = np.array(held, np.int64)
    node = embedding.segment[index] + (embedding.share[index] >= 0.5)
    return embedding.rod[index], np.maximum(node, 1)


@compiled
def carry_points(
    first: int, last: int, on: Embedding, position: Floats, frames: Floats, points: Floats
) -> None:
    """Write where rods carry points `first` to before `last` of (P, 3) to.

    Rods stand in blocks, (B, L, n, 3) with segment frames (B, L, n - 1, 4).
    """
    lanes = position.shape[1]
    for i in range(first, last):
        rod, j, t = on.rod[i], on.segment[i], on.share[i]
        offset = (on.offset[i, 0], on.offset[i, 1], on.offset[i, 2])
        away = v.rotate(frame_on(frames[rod // lanes, rod % lanes], j, t), offset)
        a, b, c = v.plus(on_curve(position[rod // lanes, rod % lanes], j, t), away)
        points[i, 0], points[i, 1], points[i, 2] = a, b, c


@compiled
def measure_offsets(on: Embedding, position: Floats, frames: Floats, points: Float64Array) -> None:
    """Write the offsets of points (P, 3) at rest."""
    lanes = position.shape[1]
    for i in range(len(points)):
        rod, j, t = on.rod[i], on.segment[i], on.share[i]
        w, x, y, z = frame_on(frames[rod // lanes, rod % lanes], j, t)
        place = (points[i, 0], points[i, 1], points[i, 2])
        away = v.minus(place, on_curve(position[rod // lanes, rod % lanes], j, t))
        on.offset[i, 0], on.offset[i, 1], on.offset[i, 2] = v.rotate((w, -x, -y, -z), away)


@inlined
def on_curve(nodes: Floats, j: int, t: float) -> Vector:
    """Return the place on the smooth curve through the nodes, t along segment j (Catmull-Rom)."""
    a, b = _row(nodes, j), _row(nodes, j + 1)
    way = v.minus(b, a)
    slope, slope_after = way, way
    if j > 0:
        slope = v.times(0.5, v.minus(b, _row(nodes, j - 1)))
    if j + 2 < len(nodes):
        slope_after = v.times(0.5, v.minus(_row(nodes, j + 2), a))
    slopes = v.minus(v.times(1 - t, slope), v.times(t, slope_after))
    return v.plus(a, v.plus(v.times(t * t * (3 - 2 * t), way), v.times(t * (1 - t), slopes)))


@inlined
def frame_on(frames: Floats, j: int, t: float) -> Frame:
    """Return the frame t along segment j, whose own frame is at its middle."""
    other = min(max(j - 1 if t < 0.5 else j + 1, 0), len(frames) - 1)
    part = abs(t - 0.5)
    a, b, own = frames[j], frames[other], 1 - part
    cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    mix = -part if cosine < 0 else part
    w, x = own * a[0] + mix * b[0], own * a[1] + mix * b[1]
    return v.unit((w, x, own * a[2] + mix * b[2], own * a[3] + mix * b[3]))


@inlined
def _row(nodes: Floats, j: int) -> Vector:
    """Return a place in float64."""
    return 1.0 * nodes[j, 0], 1.0 * nodes[j, 1], 1.0 * nodes[j, 2]
