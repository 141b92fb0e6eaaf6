"""Growth-direction prior: distances through the hair from the scalp and to the tips.

Both are chamfer distances through the hull (Borgefors 1986). Hair is assumed to grow from each root
along the shortest path to where the hair ends; partings and bare faces follow from that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, across, unit_vectors
from hairkit.field.cell_shells import dilate_cells
from hairkit.field.parting import comb_from_parting, crown_share, root_lift
from hairkit.field.smooth_volume import smooth_volume
from hairkit.parallel import compiled
from hairkit.types.head import Head, Roots
from hairkit.types.parting import Parting
from hairkit.types.volume import Hull, ScalpDistance, VoxelGrid, cell_slopes, outer_products

WHORL_BEHIND = 0.03
"""Metres from the head's highest point back to the vertical axis of the crown's whorl."""
WHORL_SLOPE = 0.7
"""Part of short hair's direction away from the whorl's axis, against 1 straight down."""
LEAST_WHORL = 0.05
"""Share of the direction from the crown in long hair, which decides where the flow vanishes."""
SHORT_HAIR, LONG_HAIR = 0.03, 0.06
"""Longest ways through the hair from the nearest scalp, metres: shorter hair is combed from the
crown, longer hair along the potential, up to its tips. They are 0.015 to 0.018 in hair of 3.3 cm
and 0.058 in a bob of 15 cm, whose strands end too soon where the second is 0.1 (mean length 0.80 of
the true one, not 0.86)."""
PARTED_HAIR = 0.05
"""Longest way through the hair, in metres, from which hair is combed from a parting."""
REACH = 0.02
"""Metres from the scalp within which hair is combed."""
LIFT = 0.6
"""Outward part of the direction in which it is combed, against 1 along the scalp."""
TIP_SHARE = 0.6
"""Cells this far along the longest way from the scalp count as tips."""
TIP_SLOPE = 0.2
"""Slope of the growth potential among the tips; 1 before them."""
WAY_OF_HEIGHT = 1.3
"""Way through short hair over its height: the length of four rendered heads is 0.91 to 1.25 of the
true one with photos alone. Hair that stands needs 0.9 to 1, hair that lies flat 1.3 to 1.6."""
LOWER_QUARTILE = 0.25
"""Of the heights: the median would be 1.3 to 2 of it, most where outlines fit badly."""
UNEVEN = 0.004
"""Metres by which heights differ where outlines fit badly: 0.003 to 0.008 are alike in F."""
PROBES, AROUND = 2000, 60
"""Roots over which the height is measured; those within about 2 cm of one."""
FLOW_SMOOTHING = 2.0
"""Standard deviation in cells that makes the chamfer distance's gradient smooth."""
LENGTH_PERCENTILE = 98
"""Percentile of the scalp distance that is taken as the hair's length."""
LEAST_CHANGE = 1e-7
"""Metres by which a distance must fall to count as changed: rounding."""


def combing_direction(
    head: Head,
    hull: Hull,
    growth: Float32Array,
    points: npt.ArrayLike,
    lift: float,
    parting: Parting,
    hair_length: float,
) -> Float64Array:
    """Return unit directions (N, 3), root to tip, of hair on the scalp near points (N, 3).

    Long hair: the tangential part of the growth potential's gradient. Hair of a longest way
    (`hair_length`, metres) shorter than `SHORT_HAIR`, which ends everywhere: `WHORL_SLOPE` away
    from the crown's axis and 1 down. In between a blend; made unit, plus `lift` times the outward
    normal. On the crown of long hair with a parting, `comb_from_parting` takes the place of the
    gradient.
    """
    at = np.asarray(points, np.float64)
    outward = gradient(hull.grid, hull.head_distance, at)
    flow = gradient(hull.grid, growth, at)
    return _comb(head, at, outward, flow, lift, parting, hair_length)


class ScalpComb(NamedTuple):
    """The combing direction in the loose cells near the scalp."""

    near: BoolArray
    """(N,) which loose cells these are."""
    direction: Float64Array
    """(M, 3) unit directions in them."""


def comb_cells(
    head: Head, hull: Hull, growth: Float32Array, parting: Parting, hair_length: float
) -> ScalpComb:
    """Return `combing_direction` at the centres of loose cells less than `REACH` off the head.

    Gradients at centres are differences of cells.
    """
    near = hull.head_distance[hull.loose] < REACH
    cells = hull.loose & (hull.head_distance < REACH)
    at = hull.grid.centres_of(cells).astype(np.float64)
    outward = unit_vectors(cell_slopes(hull.head_distance, cells).astype(np.float64))
    flow = unit_vectors(cell_slopes(growth, cells).astype(np.float64))
    return ScalpComb(near, _comb(head, at, outward, flow, LIFT, parting, hair_length))


def _comb(
    head: Head,
    at: Float64Array,
    outward: Float64Array,
    flow: Float64Array,
    lift: float,
    parting: Parting,
    hair_length: float,
) -> Float64Array:
    """Return the combing direction (N, 3) at points where normals and flow (N, 3) are known."""
    flow = across(outward, flow)
    share = long_share(hair_length)
    combed = share * flow + max(1 - share, LEAST_WHORL) * whorl_direction(head, at, outward)
    combed /= np.maximum(np.linalg.norm(combed, axis=1, keepdims=True), 1e-6)
    if parts(parting, hair_length):
        crown = crown_share(parting, head, at)[:, None]
        top = np.flatnonzero(crown)
        parted = comb_from_parting(parting, head, at[top], outward[top])
        combed[top] = (1 - crown[top]) * combed[top] + crown[top] * parted
        combed[top] /= np.maximum(np.linalg.norm(combed[top], axis=1, keepdims=True), 1e-6)
    return unit_vectors(combed + lift * outward)


def parts(parting: Parting, hair_length: float) -> bool:
    """Return whether the hair, of a longest way in metres, is combed as the parting says."""
    return parting.known and hair_length >= PARTED_HAIR


@dataclass(frozen=True)
class ScalpPrior:
    """Weights of the combing direction, against the certainty of fused cells, at most 1 a view."""

    weight: float
    """In the cells near the scalp."""
    crown: float = 0.0
    """Of the comb from the parting, in all the hair on the crown."""


def add_scalp_prior(
    head: Head,
    hull: Hull,
    tensor: Float32Array,
    certainty: Float32Array,
    comb: ScalpComb,
    prior: ScalpPrior,
    parting: Parting,
    hair_length: float,
) -> tuple[Float32Array, Float32Array]:
    """Add the prior to tensors (N, 6) and certainty (N,) of the loose cells; return new ones."""
    data, weight = tensor.copy(), certainty.copy()
    if prior.weight:
        mix_directions(
            data, weight, comb.near, comb.direction, np.full(len(comb.direction), prior.weight)
        )
    if prior.crown and parts(parting, hair_length):
        share = prior.crown * crown_share(parting, head, hull.grid.centres_of(hull.loose))
        top, cells = share > 0, np.zeros(hull.grid.shape, bool)
        cells[hull.loose] = top
        points = hull.grid.centres_of(cells)
        outward = unit_vectors(cell_slopes(hull.head_distance, cells).astype(np.float64))
        lift = root_lift(hull, points)[:, None]
        direction = comb_from_parting(parting, head, points, outward) + lift * outward
        mix_directions(data, weight, top, unit_vectors(direction), share[top])
    return data, weight


def mix_directions(
    data: Float32Array,
    weight: Float32Array,
    cells: BoolArray,
    direction: Float64Array,
    more: Float64Array,
) -> None:
    """Add directions (M, 3) of weights (M,) to tensors (N, 6) and weights (N,) at some cells."""
    weight[cells] += more
    share = (more / np.maximum(weight[cells], 1e-9))[:, None]
    data[cells] = (1 - share) * data[cells] + share * outer_products(direction)


def whorl_direction(head: Head, at: Float64Array, outward: Float64Array) -> Float64Array:
    """Return the tangents (N, 3) at points (N, 3), with normals, of short hair from the crown."""
    top = head.vertices[np.argmax(head.vertices[:, 1])].astype(np.float64)
    away = at - (top - [0, 0, WHORL_BEHIND])
    away[:, 1] = 0
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
    combed = WHORL_SLOPE * away + [0.0, -1.0, 0.0]
    combed = across(outward, combed)
    return np.asarray(combed / np.maximum(np.linalg.norm(combed, axis=1, keepdims=True), 1e-6))


def gradient(grid: VoxelGrid, values: Float32Array, points: npt.ArrayLike) -> Float64Array:
    """Return the unit gradient of values (X, Y, Z) at points (N, 3); zero where it vanishes."""
    at, steps = np.asarray(points, np.float64), grid.spacing * np.eye(3)[:, None]
    ends = np.stack([at + steps, at - steps]).reshape(-1, 3)
    after, before = grid.sample(values, ends).reshape(2, 3, -1)
    return unit_vectors((after - before).T.astype(np.float64))


def measure_scalp_distance(head: Head, hull: Hull) -> ScalpDistance:
    """Return the shortest paths from the scalp through loose cells."""
    start = np.zeros(hull.grid.shape, bool)
    cells = hull.grid.nearest_cell(head.vertices[head.scalp > 0.5])
    start[tuple(cells.T)] = True
    start = dilate_cells(start, 2)
    distance = chamfer_distance(hull.loose, start & hull.loose, hull.grid.spacing)
    distance = np.where(np.isfinite(distance), distance, 0).astype(np.float32)
    return ScalpDistance(distance, float(np.percentile(distance[hull.dense], LENGTH_PERCENTILE)))


def growth_potential(hull: Hull, from_scalp: ScalpDistance) -> Float32Array:
    """Return minus the distance to the tips through the hair (X, Y, Z), metres, smoothed.

    It grows from root to tip. Tips are the dense cells whose distance from the scalp is at least
    `TIP_SHARE` of the hair's length. In long hair the potential also grows among the tips, slowly,
    with the distance from the scalp, so that strands have a sign up to their ends.
    """
    length = from_scalp.hair_length
    tips = hull.dense & (from_scalp.values >= TIP_SHARE * length)
    left = chamfer_distance(hull.loose, tips, hull.grid.spacing)
    known = np.isfinite(left)
    weight = smooth_volume(known.astype(np.float32), FLOW_SMOOTHING)
    beyond = np.maximum(from_scalp.values - TIP_SHARE * length, 0)
    left -= long_share(length) * TIP_SLOPE * beyond
    total = smooth_volume(np.where(known, left, 0).astype(np.float32), FLOW_SMOOTHING)
    smooth = total / np.maximum(weight, 1e-6)
    return np.where(weight > 1e-3, -smooth, -smooth.max()).astype(np.float32)


def long_share(length: float) -> float:
    """Return 0 for short hair, 1 for long hair, of its longest way in metres."""
    return float(np.clip((length - SHORT_HAIR) / (LONG_HAIR - SHORT_HAIR), 0.0, 1.0))


def hair_ways(hull: Hull, growth: Float32Array, roots: Roots, longest: float) -> Float64Array:
    """Return the ways through the hair (N,) that strands may need, from its longest way, metres.

    In long hair that is the longest, or the root's own by the growth potential (X, Y, Z). Short
    hair ends everywhere, and its longest way is that of the tuft that stands off most, or where the
    outlines fit worst. There it is `WAY_OF_HEIGHT` of the lower quartile of the hull's height over
    the roots, since hulls are too thick, never too thin; but for `UNEVEN`, of those nearby.
    """
    share = long_share(longest)
    heights = np.arange(0, LONG_HAIR, hull.grid.spacing / 2)
    every = -(-len(roots) // PROBES)
    start, normal = (rows[::every, None] for rows in (roots.positions, roots.normals))
    above = (start + heights[:, None] * normal).reshape(-1, 3)
    dense = hull.grid.sample(hull.dense.astype(np.float32), above) > 0.5
    height = (dense.reshape(-1, len(heights)) * heights).max(axis=1)
    known = height > 0
    left = np.maximum(-hull.grid.sample(growth, roots.positions).astype(np.float64), longest)
    if share == 1 or not known.any():
        return left
    around = min(AROUND, np.count_nonzero(known))
    near = cKDTree(start[known, 0]).query(roots.positions, k=around)[1].reshape(len(roots), -1)
    low = np.quantile(height[known][near], LOWER_QUARTILE, axis=1)
    low -= np.clip(low - np.quantile(height[known], LOWER_QUARTILE), -UNEVEN, UNEVEN)
    return np.asarray(share * left + (1 - share) * WAY_OF_HEIGHT * low)


def chamfer_distance(occupied: BoolArray, start: BoolArray, spacing: float) -> Float32Array:
    """Return the shortest paths through occupied cells from the start cells, (X, Y, Z).

    Infinite where no path leads. Steps go along edges and diagonals of cells, whose neighbours are
    looked at again as long as a shorter path to them is found (Moore 1959).
    """
    result = np.full(occupied.shape, np.inf, np.float32)
    if occupied.any():
        box = tuple(slice(cells.min(), cells.max() + 1) for cells in np.nonzero(occupied))
        inside = np.pad(occupied[box], 1)  # no step leaves the padded box
        begun = inside & np.pad(start[box], 1)
        distance = np.where(begun, 0, np.inf).astype(np.float32)
        queue = np.empty(np.count_nonzero(inside), np.int32)
        first = np.flatnonzero(begun)
        queue[: len(first)] = first
        steps = np.sqrt(np.arange(4)).astype(np.float32) * np.float32(spacing)
        strides = (inside.shape[1] * inside.shape[2], inside.shape[2])
        cells = (queue, len(first), begun.ravel(), distance.ravel())
        _chamfer(inside.ravel(), strides, steps, *cells)
        result[box] = distance[1:-1, 1:-1, 1:-1]
    result[start] = 0
    return result


@compiled
def _chamfer(
    occupied: BoolArray,
    strides: tuple[int, int],
    steps: Float32Array,
    queue: Int32Array,
    waiting: int,
    queued: BoolArray,
    distance: Float32Array,
) -> None:
    """Lower distances (N,), infinite but in the first cells, to those of the shortest paths.

    Cells are numbered in C order, `strides` apart along x and y; the outermost are not occupied.
    `steps` (4,) are metres of a step to a cell across a face, an edge and a corner. The `queue`, as
    long as there are occupied cells, holds the `waiting` first ones, which are `queued` (N,).
    """
    head = 0
    while waiting > 0:
        cell = queue[head]
        head = head + 1 if head + 1 < len(queue) else 0
        waiting -= 1
        queued[cell] = False
        for a in range(-1, 2):
            for b in range(-1, 2):
                for c in range(-1, 2):
                    other = cell + a * strides[0] + b * strides[1] + c
                    way = distance[cell] + steps[abs(a) + abs(b) + abs(c)]
                    if occupied[other] and way < distance[other] - LEAST_CHANGE:
                        distance[other] = way
                        if not queued[other]:
                            queued[other] = True
                            queue[(head + waiting) % len(queue)] = other
                            waiting += 1
