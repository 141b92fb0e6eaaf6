"""The guides' own points on the rods, so that curls finer than the nodes move and turn with them.

Each point keeps its offset in the rod's frame at its arc length; it is exact at rest.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.parallel import compiled, parallel_for
from hairkit.simulation.obstacle_kernels import NO_FIELDS, Drawn, draw_points
from hairkit.simulation.vectors import Frame, Vector, inlined, minus, plus, rotate, times
from hairkit.types.strands import Strands

from .state import Contact

WORTH = 256
"""Rods that are worth another thread's while."""


class Embedding(NamedTuple):
    """Guide points embedded in rods."""

    starts: Int64Array
    """(S + 1,) where the points of each rod begin."""
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
    size = np.linalg.norm(np.diff(own, axis=0, prepend=own[:1]), axis=1)
    size[strands.offsets[:-1]] = 0.0
    made = Embedding(strands.offsets, rod, segment, along - segment, np.zeros_like(own), size)
    measure_offsets(made, position[:, None], frames[:, None], own)
    return made


def drawn_points(
    embedding: Embedding,
    position: Any,
    frames: Any,
    contact: Contact | None,
    torso_from_head: Float64Array,
) -> Any:
    """Return the guides' points (P, 3), head axes, of rods with segment frames.

    Rods stand in blocks, (B, L, n, 3) and (B, L, n - 1, 4).

    Each follows the curve that the rods carry it on, out of the obstacles; see
    `hairkit.simulation.obstacle_kernels.draw_points`.
    """
    points = np.empty((len(embedding.rod), 3), position.dtype)
    deepest = np.zeros(0) if contact is None or contact.deepest is None else contact.deepest
    fields = NO_FIELDS if contact is None else contact.bodies.fields
    drawn, rods = Drawn(embedding.starts, embedding.length, deepest), len(embedding.starts) - 1
    parallel_for(carry_points, rods, embedding, position, frames, points, min_chunk=WORTH)
    parallel_for(draw_points, rods, drawn, fields, torso_from_head, points, min_chunk=WORTH)
    return points


@compiled
def carry_points(
    first: int, last: int, on: Embedding, position: Any, frames: Any, points: Any
) -> None:
    """Write where rods `first` to before `last` carry their points (P, 3) to."""
    for rod in range(first, last):
        nodes, axes = in_block(position, rod), in_block(frames, rod)
        for i in range(on.starts[rod], on.starts[rod + 1]):
            j, t = on.segment[i], on.share[i]
            offset = (on.offset[i, 0], on.offset[i, 1], on.offset[i, 2])
            a, b, c = plus(on_curve(nodes, j, t), rotate(frame_on(axes, j, t), offset))
            points[i, 0], points[i, 1], points[i, 2] = a, b, c


@compiled
def measure_offsets(on: Embedding, position: Any, frames: Any, points: Float64Array) -> None:
    """Write the offsets of points (P, 3) at rest."""
    for i in range(len(points)):
        rod, j, t = on.rod[i], on.segment[i], on.share[i]
        a, b, c = on_curve(in_block(position, rod), j, t)
        w, x, y, z = frame_on(in_block(frames, rod), j, t)
        away = (points[i, 0] - a, points[i, 1] - b, points[i, 2] - c)
        on.offset[i, 0], on.offset[i, 1], on.offset[i, 2] = rotate((w, -x, -y, -z), away)


@inlined
def in_block(values: Any, rod: int) -> Any:
    """Return a rod's values of (B, L, n, k)."""
    return values[rod // values.shape[1], rod % values.shape[1]]


@inlined
def on_curve(nodes: Any, j: int, t: float) -> Vector:
    """Return the place on the smooth curve through the nodes, t along segment j (Catmull-Rom)."""
    a, b = _row(nodes, j), _row(nodes, j + 1)
    way = minus(b, a)
    slope, slope_after = way, way
    if j > 0:
        slope = times(0.5, minus(b, _row(nodes, j - 1)))
    if j + 2 < len(nodes):
        slope_after = times(0.5, minus(_row(nodes, j + 2), a))
    slopes = minus(times(1 - t, slope), times(t, slope_after))
    return plus(a, plus(times(t * t * (3 - 2 * t), way), times(t * (1 - t), slopes)))


@inlined
def frame_on(frames: Any, j: int, t: float) -> Frame:
    """Return the frame t along segment j, whose own frame is at its middle."""
    other = min(max(j - 1 if t < 0.5 else j + 1, 0), len(frames) - 1)
    part = abs(t - 0.5)
    a, b = frames[j], frames[other]
    cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    mix = -part if cosine < 0 else part
    own = 1 - part
    w, x = own * a[0] + mix * b[0], own * a[1] + mix * b[1]
    y, z = own * a[2] + mix * b[2], own * a[3] + mix * b[3]
    size = 1 / np.sqrt(w * w + x * x + y * y + z * z)
    return size * w, size * x, size * y, size * z


@inlined
def _row(nodes: Any, j: int) -> Vector:
    """Return a place in float64."""
    return 1.0 * nodes[j, 0], 1.0 * nodes[j, 1], 1.0 * nodes[j, 2]
