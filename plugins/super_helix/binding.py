"""Bind guides to super-helices: rods from the guides' points, and points from the rods."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.helices import adaptive_counts, fit_arcs
from hairkit.helices.arc_length import Path
from hairkit.helices.helix_strands import travelling
from hairkit.parallel import compiled_with
from hairkit.types.strands import Strands

from .element_kernels import advance_frame, node, times, turns
from .rods import Rods

SHAPE, FEWEST, MOST = 0.0015, 8, 32
"""Mean distance in metres to which elements fit a guide's shape, and bounds of their number."""
SHORTEST = 1e-4
"""Length, metres, of the straight rods that shorter guides are bound to."""


class Binding(NamedTuple):
    """Position of the guides' points on the elements."""

    element: Int64Array
    """(P,) element of each point, counted over all strands."""
    arc: Float64Array
    """(P,) where on it, metres from its start."""
    offset: Float64Array
    """(P, 3) from there to the point, in the frame there."""
    bounds: Int64Array
    """(S + 1,) of the points, as the strands'."""


def bind_rods(strands: Strands, elements: int) -> tuple[Rods, Binding]:
    """Return rods of unit stiffness and density through the guides, and their binding to the rods.

    Parameters
    ----------
    strands
        The guides.
    elements
        Elements a strand; 0 for as many as each strand's shape needs.
    """
    wanted = strands.points.astype(np.float64)
    strands = _without_points(strands)
    counts = np.full(len(strands), elements)
    if not elements:
        counts = np.maximum(adaptive_counts(strands, SHAPE, most=MOST), FEWEST)
    path = Path.of(strands)
    arcs = fit_arcs(path, counts)
    frames, q = travelling(arcs)
    ones = np.ones((len(q), 3))
    rods = Rods(
        arcs.offsets,
        np.ascontiguousarray(strands.roots, np.float64),
        np.ascontiguousarray(frames),
        arcs.lengths,
        q,
        q,
        ones,
        ones[:, 0].copy(),
    )
    strand = strands.strand_of_point
    place = path.arc / path.lengths[strand] * counts[strand]
    rank = np.minimum(place.astype(np.int64), counts[strand] - 1)
    element = arcs.offsets[:-1][strand] + rank
    arc = (place - rank) * arcs.lengths[element]
    binding = Binding(element, arc, np.zeros((len(arc), 3)), strands.offsets)
    return rods, binding._replace(offset=_offsets(rods, binding, wanted))


def _without_points(strands: Strands) -> Strands:
    """Return strands of which those shorter than `SHORTEST` are straight and that long."""
    points, offsets = strands.points.copy(), strands.offsets
    for strand in np.flatnonzero(strands.lengths() < SHORTEST):
        own = slice(offsets[strand], offsets[strand + 1])
        points[own] = points[offsets[strand]]
        points[own, 1] += np.linspace(0.0, SHORTEST, offsets[strand + 1] - offsets[strand])
    return replace(strands, points=points)


def _offsets(rods: Rods, binding: Binding, wanted: Float64Array) -> Float64Array:
    bare, frames = np.empty_like(wanted), np.empty((len(wanted), 3, 3))
    carry_points(0, len(rods.roots), rods, rods.captured, binding, bare, frames)
    return np.ascontiguousarray(np.einsum("pji,pj->pi", frames, wanted - bare))


@compiled_with(allocates=True)
def carry_points(
    begin: int,
    stop: int,
    rods: Rods,
    q: Float64Array,
    binding: Binding,
    points: Float64Array,
    frames: Float64Array,
) -> None:
    """Write the points (P, 3) and frames (P, 3, 3) of strands `begin` to `stop`, head axes.

    Those off the rod's line come apart or together where it bends: see
    `hairkit.simulation.obstacle_kernels.draw_points`.
    """
    local, slope, arm = np.empty(3), np.empty((3, 3)), np.empty(3)
    turn, mean = np.empty((3, 3)), np.empty((3, 3))
    frame, root = np.empty((3, 3)), np.empty(3)
    next_frame, next_root = np.empty((3, 3)), np.empty(3)
    for strand in range(begin, stop):
        root[:], frame[:] = rods.roots[strand], rods.frames[strand]
        e = rods.offsets[strand]
        for p in range(binding.bounds[strand], binding.bounds[strand + 1]):
            while e < binding.element[p]:
                advance_frame(q[e], rods.lengths[e], frame, root, next_frame, next_root)
                frame[:], root[:] = next_frame, next_root
                e += 1
            node(q[e], binding.arc[p], local, slope)
            turns(q[e], binding.arc[p], turn, mean)
            for i in range(3):
                for j in range(3):
                    local[i] += turn[i, j] * binding.offset[p, j]
            times(frame, local, arm)
            for i in range(3):
                points[p, i] = root[i] + arm[i]
                for j in range(3):
                    frames[p, i, j] = (
                        frame[i, 0] * turn[0, j]
                        + frame[i, 1] * turn[1, j]
                        + frame[i, 2] * turn[2, j]
                    )
