"""Strands smoothed by helix arcs, and arcs in the travelling frames of super-helices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.helices.arc_counts import adaptive_counts
from hairkit.helices.arc_length import Path, unit
from hairkit.helices.floating_tangents import Arcs, fit_arcs
from hairkit.helices.helix import rotation
from hairkit.types.strands import Strands


def smooth_strands(strands: Strands, tolerance: float) -> Strands:
    """Return the strands on helix arcs within `tolerance` metres on average along each.

    Point counts, roots, widths and groups stay; every tracker's strands can be smoothed by it.
    """
    counts = adaptive_counts(strands, tolerance)
    path = Path.of(strands)
    arcs = fit_arcs(path, counts)
    strand = strands.strand_of_point
    place = path.arc / np.maximum(path.lengths, 1e-12)[strand] * counts[strand]
    rank = np.minimum(place.astype(np.int64), counts[strand] - 1)
    points, _ = arcs.at(arcs.offsets[:-1][strand] + rank, place - rank)
    points[strands.offsets[:-1]] = strands.roots
    return replace(strands, points=points.astype(np.float32))


def travelling(arcs: Arcs) -> tuple[Float64Array, Float64Array]:
    """Return frames (S, 3, 3) at the roots and Darboux vectors (A, 3) in frames that travel along.

    Columns of the frames: tangent and two normals; so the vectors are torsion and two curvatures.
    """
    root = first_frames(arcs.tangents[arcs.offsets[:-1]])
    turns = rotation(arcs.darboux * arcs.lengths[:, None])
    frames = np.empty((len(arcs.lengths), 3, 3))
    for here, before, strand in _ranks(arcs.offsets):
        frames[here] = root[strand] if before is None else turns[before] @ frames[before]
    return root, np.einsum("aji,aj->ai", frames, arcs.darboux)


def first_frames(tangents: Float64Array) -> Float64Array:
    """Return right-handed frames (S, 3, 3) whose first columns are unit tangents (S, 3)."""
    spare = np.eye(3)[np.argmin(np.abs(tangents), axis=-1)]
    normal = unit(np.cross(tangents, spare))
    return np.stack([tangents, normal, np.cross(tangents, normal)], axis=-1)


def _ranks(offsets: Int64Array) -> list[tuple[Int64Array, Int64Array | None, Int64Array]]:
    """Return, root to tip, the k-th arcs of all strands that have one, those before, strands."""
    counts = np.diff(offsets)
    steps: list[tuple[Int64Array, Int64Array | None, Int64Array]] = []
    for rank in range(int(counts.max(initial=0))):
        strand = np.flatnonzero(counts > rank)
        here = offsets[:-1][strand] + rank
        steps.append((here, None if rank == 0 else here - 1, strand))
    return steps
