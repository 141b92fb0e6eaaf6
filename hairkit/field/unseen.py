"""Directions of hair that photos see from one side only, or not at all.

One view tells a strand's direction but for its slope in depth. Hair that is seen lies on the
surface of the hull, so that the surface is the second plane. Hair that no photo sees runs the way
to the tips through the hull, as hair does that nobody combed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, unit_vectors
from hairkit.cameras.depth_raster import depth_behind, head_depth, point_depth
from hairkit.field.cell_shells import dilate_cells
from hairkit.field.growth_prior import (
    LONG_HAIR,
    chamfer_distance,
    measure_scalp_distance,
    mix_directions,
    whorl_direction,
)
from hairkit.field.hanging_hair import hanging_axes
from hairkit.field.scalp_sight import ScalpSight, scalp_places, see_scalp
from hairkit.field.smooth_volume import smooth_volume
from hairkit.head_model.torso import Torso
from hairkit.types.evidence import Evidence
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.scene import Scene
from hairkit.types.strands import CONTINUED, SEEN, Strands
from hairkit.types.volume import Hull, ScalpDistance, cell_slopes, outer_products

SURFACE_CELLS = 3.0
"""Standard deviation in cells over which the hull's surface is smoothed."""
SURFACE_WEIGHT = 0.5
"""Weight of the surface's plane over that of the views' planes."""
SEEN_DEPTH, SEEN_SHARE, STRAND_REACH = 0.01, 0.25, 0.006
"""Depth behind the first hair of a view at which a point still counts as seen, metres; share of its
points by which a strand does; and half the width of the hair that a guide stands for, metres."""
BESIDE, LEAST_SHOWN = 0.03, 0.01
"""Metres from the middle at which hair lies beside the crown; least share of the scalp, facing the
view, whose hair is seen there."""
COMBED_BACK = -0.6
"""Mean cosine of twice the angle between the hair there and the way down, below which it is combed
back: -0.66 to -0.85 on four portraits of tied or slicked hair, -0.47 to 0.88 on 17 of short."""
FLOW_WEIGHT = 0.05
"""Weight of the way to the tips, against the certainty of fused cells."""
FALLS, FALLING = 4.0, 0.03
"""Part of the direction down of long hair that is not seen, against 1 to the tips, between nape and
shoulders, and metres over which it begins and ends. F at 4 mm/40 of nine fronts is 67.6 without it,
70.4 with 1 and 71.0 with 4 down to the tips (visible hair 36.5, 38.6, 39.8)."""


def measure_ways(
    scene: Scene, hull: Hull, masks: Sequence[Mask], orientations: Sequence[OrientationMap]
) -> ScalpDistance:
    """Return the ways from the scalp through the hair, or those of combed-back hair to its tie.

    A front photo does not see the tie, which is taken to be at the hindmost place of the scalp.
    """
    head, found = scene.head, measure_scalp_distance(scene.head, hull)
    if found.hair_length >= LONG_HAIR or not scene.one_sided:
        return found
    if not combed_back(see_scalp(masks, orientations, scene.cameras, head), head):
        return found
    places = scalp_places(head)[0]
    tie = np.zeros(hull.grid.shape, bool)
    tie[tuple(hull.grid.nearest_cell(places[np.argmin(places[:, 2])]))] = True
    left = chamfer_distance(hull.loose, dilate_cells(tie, 2) & hull.loose, hull.grid.spacing)
    left = np.where(np.isfinite(left), left, 0)
    return ScalpDistance(left.max() - left, float(left.max()))


def combed_back(sight: ScalpSight, head: Head) -> bool:
    """Return whether hair beside the crown runs across the way down from the whorl."""
    beside = sight.at(np.abs(sight.places[:, 0]) > BESIDE)
    down = whorl_direction(head, beside.places, beside.normals)
    enough = beside.weight.sum() > LEAST_SHOWN * np.count_nonzero(head.scalp > 0.5)
    return bool(enough and beside.agreement(down) < COMBED_BACK)


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
    at, height = hull.grid.centres_of(hull.loose), hull.head_distance[hull.loose]
    flow = share * unit_vectors(cell_slopes(growth, hull.loose).astype(np.float64))
    nape = head.vertices[head.scalp > 0.5, 1].min()
    above = (at[:, 1] - Torso.under(head).joint[1]) / FALLING
    falls = np.clip(np.minimum(above, (nape - at[:, 1]) / FALLING + 1), 0, 1)
    flow[:, 1] -= share * FALLS * falls
    flow = unit_vectors(flow + (1 - share) * hanging_axes(head, at, height))
    every = np.ones(len(flow), bool)
    mix_directions(data, weight, every, flow, np.where(flow.any(axis=1), FLOW_WEIGHT, 0.0))
    return data, weight


def group_seen(strands: Strands, evidence: Evidence) -> Strands:
    """Return the strands in two groups, `SEEN` and `CONTINUED`; as they are of a whole turn.

    Of those seen `SEEN_SHARE` of the points lie where a view sees hair, at most `SEEN_DEPTH` behind
    the first strand.
    """
    scene = evidence.scene
    if not scene.one_sided:
        return strands
    seen = np.zeros(len(strands.points), bool)
    for camera, mask in zip(scene.cameras, evidence.masks, strict=True):
        hair = point_depth(camera, strands.points, STRAND_REACH)
        front = np.minimum(hair, head_depth(scene.head, camera))
        front[~mask.hair] = -np.inf
        seen |= depth_behind(camera, front, strands.points) < SEEN_DEPTH
    shares = np.add.reduceat(seen.astype(np.float64), strands.offsets[:-1]) / strands.counts
    group = np.where(shares >= SEEN_SHARE, SEEN, CONTINUED).astype(np.int32)
    return replace(strands, group=group)
