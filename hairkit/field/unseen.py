"""Directions of hair that photos see from one side only, or not at all.

One view tells a strand's direction but for its slope in depth. Hair that is seen lies on the
surface of the hull, so that the surface is the second plane. Hair that no photo sees runs the way
to the tips through the hull, as hair does that nobody combed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, unit_vectors
from hairkit.cameras.depth_raster import SPLAT_CELLS, depth_behind, head_depth, point_depth
from hairkit.field.cell_shells import dense_surface
from hairkit.field.growth_prior import mix_directions
from hairkit.field.hanging_hair import hanging_axes
from hairkit.field.smooth_volume import smooth_volume
from hairkit.types.evidence import Evidence
from hairkit.types.head import Head
from hairkit.types.strands import CONTINUED, SEEN, Strands
from hairkit.types.volume import Hull, cell_slopes, outer_products

SURFACE_CELLS = 3.0
"""Standard deviation in cells over which the hull's surface is smoothed."""
SURFACE_WEIGHT = 0.5
"""Weight of the surface's plane over that of the views' planes."""
SEEN_DEPTH, SEEN_SHARE = 0.01, 0.25
"""Depth behind the first hair of a view at which a point still counts as seen, metres; and share
of its points by which a strand does."""
FLOW_WEIGHT = 0.05
"""Weight of the way to the tips, against the certainty of fused cells."""


def add_surface_planes(planes: Float64Array, hull: Hull, share: float) -> Float64Array:
    """Return the planes (N, 6) of the loose cells with a share of the hull's surface's."""
    filled = (hull.dense | (hull.head_distance < 0)).astype(np.float32)
    slopes = cell_slopes(smooth_volume(filled, SURFACE_CELLS), hull.loose)
    normal = unit_vectors(slopes.astype(np.float64))
    seen = planes[:, :3].sum(axis=1, keepdims=True)
    return np.asarray(planes + share * SURFACE_WEIGHT * seen * outer_products(normal), np.float64)


def add_flow(
    head: Head,
    hull: Hull,
    growth: Float32Array,
    share: float,
    tensor: Float32Array,
    certainty: Float32Array,
) -> tuple[Float32Array, Float32Array]:
    """Return tensors (N, 6) and certainty (N,) of the loose cells with the way to the tips added.

    `growth` (X, Y, Z) is the potential that rises to the tips of long hair, whose `share` is 1. The
    tips of short hair are all of the hull's surface, and it lies as gravity has it.
    """
    data, weight = tensor.copy(), certainty.copy()
    flow = share * unit_vectors(cell_slopes(growth, hull.loose).astype(np.float64))
    if share < 1:
        at, height = hull.grid.centres_of(hull.loose), hull.head_distance[hull.loose]
        flow = unit_vectors(flow + (1 - share) * hanging_axes(head, at, height))
    every = np.ones(len(flow), bool)
    mix_directions(data, weight, every, flow, np.where(flow.any(axis=1), FLOW_WEIGHT, 0.0))
    return data, weight


def group_seen(strands: Strands, evidence: Evidence) -> Strands:
    """Return the strands in two groups, `SEEN` and `CONTINUED`; as they are of a whole turn.

    Of those seen `SEEN_SHARE` of the points lie where a view sees hair, at most `SEEN_DEPTH` behind
    its front.
    """
    scene, hull = evidence.scene, evidence.hull
    if not scene.one_sided:
        return strands
    surface = dense_surface(hull)
    seen = np.zeros(len(strands.points), bool)
    for camera, mask in zip(scene.cameras, evidence.masks, strict=True):
        hair = point_depth(camera, surface, SPLAT_CELLS * hull.grid.spacing)
        front = np.minimum(hair, head_depth(scene.head, camera))
        front[~mask.hair] = -np.inf
        seen |= depth_behind(camera, front, strands.points) < SEEN_DEPTH
    shares = np.add.reduceat(seen.astype(np.float64), strands.offsets[:-1]) / strands.counts
    group = np.where(shares >= SEEN_SHARE, SEEN, CONTINUED).astype(np.int32)
    return replace(strands, group=group)
