"""How hair on the crown is combed (`hairkit.field.find_parting` finds which way).

From a parting it is combed away to both sides, down and back; behind the line's end the nearest
point of the line is its end, which makes a whorl. Other hair is combed as the views see it
(`hairkit.field.scalp_comb`), or all back. A fringe is combed forward.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array, across, unit_vectors
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
DROP = np.array([0.0, -0.25, 0.0])
"""Part of the direction down of hair that is combed back or forward over the head, against 1."""
FRONT_DEPTH, FRONT_WIDTH, FRONT_FADE = 0.035, 0.05, 0.01
"""The fringe's depth behind the foremost scalp and half its width; metres over which it fades."""
NEAREST, BETWEEN, LEAST_WEIGHT = 8, 0.012, 1e-9
"""Places of a comb that count at a point, standard deviation in metres of their weight, and weight
of places far away."""
THINNEST, THICKEST = 0.004, 0.03
"""Bounds of the hair's thickness over which the lift at the roots fades, metres."""
THICKNESS_BLUR, LEAST_HELD = 2.0, 0.05
"""Standard deviation in cells of the thickness over the crown, and the least share of hair in such
a neighbourhood that counts."""


def crown_share(parting: Parting, head: Head, points: npt.ArrayLike) -> Float64Array:
    """Return how much the comb counts at points (N, 3): 1 on top and in a fringe, 0 below."""
    at = np.asarray(points, np.float64)
    top = float(head.vertices[:, 1].max())
    share: Float64Array = np.clip((at[:, 1] - (top - FADE_START)) / FADE_LENGTH, 0.0, 1.0)
    if parting.fringe or parting.swept_back:
        share = np.maximum(share, front_share(head, at))
    return share


def front_share(head: Head, points: npt.ArrayLike) -> Float64Array:
    """Return how far points (N, 3) are where a fringe grows: 1 behind the hairline, 0 elsewhere."""
    at = np.asarray(points, np.float64)
    scalp = head.vertices[head.scalp > 0.5]
    foremost = float(scalp[:, 2].max())
    lowest = float(scalp[scalp[:, 2] > foremost - FRONT_FADE, 1].min())
    margins = [at[:, 2] - foremost + FRONT_DEPTH, FRONT_WIDTH - np.abs(at[:, 0]), at[:, 1] - lowest]
    return np.asarray(np.clip(np.min(margins, axis=0) / FRONT_FADE + 1, 0.0, 1.0))


def comb_from_parting(
    parting: Parting, head: Head, points: npt.ArrayLike, outward: Float64Array
) -> Float64Array:
    """Return unit tangents (N, 3), root to tip, of hair as it is combed on the crown.

    Parameters
    ----------
    points
        (N, 3) near the crown, metres in the head frame.
    outward
        (N, 3) unit normals of the head there.
    """
    at = np.asarray(points, np.float64)
    combed = _comb_behind_front(parting, at, outward)
    if parting.fringe:
        share = front_share(head, at)[:, None]
        forward = _over_head(outward, -1.0)
        combed = unit_vectors((1 - share) * combed + share * forward)
    return combed


def _comb_behind_front(parting: Parting, at: Float64Array, outward: Float64Array) -> Float64Array:
    """Return the comb without a fringe: from the line, as the views see it, or back."""
    if parting.places is not None and parting.directions is not None:
        gap, near = cKDTree(parting.places).query(at, k=min(NEAREST, len(parting.places)))
        weight = np.exp(-0.5 * (gap / BETWEEN) ** 2) + LEAST_WEIGHT
        seen = np.einsum("nk,nki->ni", weight, parting.directions[near])
        return unit_vectors(across(outward, seen))
    if parting.line is None:
        return _over_head(outward, 1.0)
    flat, away = at[:, [0, 2]], np.zeros_like(at)
    away[:, [0, 2]] = flat - _nearest_on(parting.line, flat)
    back = np.clip(SWEEP + SWEEP_SLOPE * (SWEEP_AT - at[:, 2]), -MOST_SWEEP, MOST_SWEEP)
    pull = DOWN * np.array([0.0, -1.0, 0.0]) + back[:, None] * np.array([0.0, 0.0, -1.0])
    return unit_vectors(unit_vectors(across(outward, away)) + across(outward, pull))


def _over_head(outward: Float64Array, back: float) -> Float64Array:
    """Return unit tangents (N, 3) over the head from the face to the nape, or for -1 against it."""
    return unit_vectors(across(outward, back * np.cross(outward, [1.0, 0.0, 0.0]) + DROP))


def _nearest_on(line: Float64Array, at: Float64Array) -> Float64Array:
    """Return the nearest points (N, 2) of a line through (M, 2) to points (N, 2)."""
    start, way = line[:-1], np.diff(line, axis=0)
    length = np.maximum((way * way).sum(axis=1), 1e-12)
    along = np.clip(((at[:, None] - start) * way).sum(axis=2) / length, 0, 1)
    foot = start + along[..., None] * way
    best = np.linalg.norm(at[:, None] - foot, axis=2).argmin(axis=1)
    return np.asarray(foot[np.arange(len(at)), best])


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
    return np.asarray(np.clip(1 - distance / over, 0.0, 1.0))
