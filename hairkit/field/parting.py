"""How hair on the crown is combed from its parting (`hairkit.field.find_parting` finds it).

It is combed away to both sides, down and back; behind the line's end the nearest point of the line
is its end, which makes a whorl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from hairkit.arrays import Float64Array
from hairkit.types.head import Head
from hairkit.types.parting import Parting
from hairkit.types.volume import Hull

FADE_START, FADE_LENGTH = 0.055, 0.02
"""The comb begins this far below the top of the head and is whole `FADE_LENGTH` above, metres."""
DOWN = 1.0
"""Part of the direction down the head, against 1 away from the parting."""
SWEEP, SWEEP_SLOPE, SWEEP_AT = 0.6, 5.0, 0.02
"""Part of the direction backwards, its growth per metre towards the back of the head, and the
height z where it has its mean: hair of the fringe goes sideways."""
MOST_SWEEP = 2.0
BACKWARDS = np.array([0.0, -0.5, -1.0])
"""Direction of hair that is all combed back, before it is laid on the skin."""
THINNEST, THICKEST = 0.004, 0.03
"""Bounds of the hair's thickness over which the lift at the roots fades, metres."""
THICKNESS_BLUR, LEAST_HELD = 2.0, 0.05
"""Standard deviation in cells of the thickness over the crown, and the least share of hair in such
a neighbourhood that counts."""


def crown_share(head: Head, points: npt.ArrayLike) -> Float64Array:
    """Return how much the comb of the parting counts at points (N, 3): 1 on top, 0 below."""
    top = float(head.vertices[:, 1].max())
    rise: Float64Array = (np.asarray(points, np.float64)[:, 1] - (top - FADE_START)) / FADE_LENGTH
    share: Float64Array = np.clip(rise, 0.0, 1.0)
    return share


def comb_from_parting(
    parting: Parting, points: npt.ArrayLike, outward: Float64Array
) -> Float64Array:
    """Return unit tangents (N, 3), root to tip, of hair combed from a parting, or back without.

    Parameters
    ----------
    points
        (N, 3) near the crown, metres in the head frame.
    outward
        (N, 3) unit normals of the head there.
    """
    at = np.asarray(points, np.float64)
    if parting.line is None:
        return _unit(_tangent(np.broadcast_to(BACKWARDS, at.shape), outward))
    away = np.zeros_like(at)
    away[:, [0, 2]] = at[:, [0, 2]] - _nearest_on(parting.line, at[:, [0, 2]])
    away = _unit(_tangent(away, outward))
    back = np.clip(SWEEP + SWEEP_SLOPE * (SWEEP_AT - at[:, 2]), -MOST_SWEEP, MOST_SWEEP)
    pull = DOWN * np.array([0.0, -1.0, 0.0]) + back[:, None] * np.array([0.0, 0.0, -1.0])
    return _unit(away + _tangent(pull, outward))


def _nearest_on(line: Float64Array, at: Float64Array) -> Float64Array:
    """Return the nearest points (N, 2) of a line through (M, 2) to points (N, 2)."""
    start, way = line[:-1], np.diff(line, axis=0)
    length = np.maximum((way * way).sum(axis=1), 1e-12)
    along = np.clip(((at[:, None] - start) * way).sum(axis=2) / length, 0, 1)
    foot = start + along[..., None] * way
    best = np.linalg.norm(at[:, None] - foot, axis=2).argmin(axis=1)
    nearest: Float64Array = foot[np.arange(len(at)), best]
    return nearest


def root_lift(hull: Hull, points: npt.ArrayLike) -> Float64Array:
    """Return the outward part (N,) of hair on the crown at points (N, 3): 1 at the skin, 0 on top.

    Hair that leaves the skin flat would leave the volume empty that the photos show.
    """
    height = np.where(hull.dense, hull.head_distance, 0).max(axis=1)
    held = ndimage.gaussian_filter((height > 0).astype(np.float32), THICKNESS_BLUR)
    thickness = ndimage.gaussian_filter(height, THICKNESS_BLUR) / np.maximum(held, LEAST_HELD)
    cell = hull.grid.nearest_cell(points)
    distance = hull.grid.sample(hull.head_distance, points).astype(np.float64)
    over = np.clip(thickness[cell[:, 0], cell[:, 2]], THINNEST, THICKEST)
    lift: Float64Array = np.clip(1 - distance / over, 0.0, 1.0)
    return lift


def _tangent(vector: Float64Array, outward: Float64Array) -> Float64Array:
    tangent: Float64Array = vector - np.einsum("ij,ij->i", vector, outward)[:, None] * outward
    return tangent


def _unit(vector: Float64Array) -> Float64Array:
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    unit: Float64Array = vector / np.maximum(length, 1e-9)
    return unit
