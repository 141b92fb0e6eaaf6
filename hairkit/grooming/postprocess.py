"""Last steps of trackers: lead the strands to their tie, smooth, wave, push them outside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from hairkit.arrays import Float32Array, across, unit_vectors
from hairkit.grooming.head_collision import push_out_of_head
from hairkit.grooming.lead_to_ties import lead_to_ties
from hairkit.grooming.smooth_curves import smooth_curves
from hairkit.grooming.wind_waves import LARGEST_RADIUS, add_waves, grown_share
from hairkit.options import option
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.volume import Hull, OrientationField, cell_slopes
from hairkit.types.waves import Waves


@dataclass(frozen=True)
class FinishOptions:
    """Options that trackers share; plugins inherit them."""

    clearance: float = option(0.001, low=0, high=0.02, unit="m", doc="Distance kept from the head.")
    waves: bool = option(True, doc="Wind the strands into the waves measured in the photos.")
    stiffness: float = option(
        0.006, low=0, high=0.1, unit="m", doc="Sigma of the smoothing along strands; 0: none."
    )
    points: int = option(64, low=2, high=255, doc="Points of every strand; equal segments.")


ROUNDS, SHARE = 3, 0.6
"""Times that points are moved, each time by this share of the depth that they lack: 94 % of it."""
DEPTH_BLUR = 1.0
"""Standard deviation in cells that makes the depth under the hull's surface smooth."""
PATH_BLUR = 1.5
"""Standard deviation in points, along a strand, that keeps its axis smooth."""
STIFF_SHARE = 0.05
"""Standard deviation of the smoothing along a strand, in shares of its length at most."""
SHARPEST, AGAIN = 0.015, 5
"""Metres of the least radius of a bend, and times that sharper ones are smoothed again. Of true
strands 99 of 100 bend with more than 12 mm on the crown."""


def finish(
    strands: Strands,
    waves: Waves,
    tied: TiedHair,
    hull: Hull,
    field: OrientationField,
    options: FinishOptions,
) -> Strands:
    """Lead strands to their ties, smooth and wave them as the options ask, push them outside."""
    strands = _smooth(lead_to_ties(strands, tied, hull, field), tied, options.stiffness)
    if options.waves:
        strands = add_waves(make_room(strands, waves, hull), waves)
    return push_out_of_head(strands, hull.grid, hull.head_distance, options.clearance)


def _smooth(strands: Strands, tied: TiedHair, stiffness: float) -> Strands:
    """Return strands of equal point counts without sudden bends; braids stay as they are.

    Growth bends at once where it meets a surface or a tie, stiff hair over some millimetres. Loose
    strands that still bend too sharply, as in a parting, are smoothed again and more.
    """
    if not len(strands) or not stiffness:
        return strands
    sigma = np.minimum(stiffness / np.maximum(strands.lengths(), 1e-9), STIFF_SHARE)
    loose = np.ones(len(strands), np.bool_)
    if strands.group is not None:
        loose = strands.group == 0
        plaited = np.array([False, *(tail.crossing > 0 for tail in tied.tails)])
        sigma[plaited[strands.group]] = 0
    points = smooth_curves(strands.points.reshape(len(strands), -1, 3), sigma)
    for _ in range(AGAIN):
        bent = np.flatnonzero((_sharpest_bends(points) > 1 / SHARPEST) & loose)
        points[bent] = smooth_curves(points[bent], sigma[bent])
        sigma[bent] *= np.sqrt(2)  # twice the variance
    return replace(strands, points=points.reshape(-1, 3))


def _sharpest_bends(points: Float32Array) -> Float32Array:
    """Return (S,) the greatest curvature of curves (S, m, 3) of about equal steps, 1 / metres."""
    steps = np.diff(points, axis=1)
    lengths = np.maximum(np.linalg.norm(steps, axis=2), 1e-9)
    turns = np.linalg.norm(np.diff(steps / lengths[..., None], axis=1), axis=2)
    return np.asarray(turns.max(axis=1, initial=0) / lengths.mean(axis=1), np.float32)


def make_room(strands: Strands, waves: Waves, hull: Hull) -> Strands:
    """Return strands of equal point counts whose axes lie a radius under the hull's surface.

    Tracked strands slide along that surface, and a helix about such an axis stands half outside of
    the hair. The radius is that of the widest wisps and grows from 0 at the root. Where the hair is
    thinner than two radii, axes lie in its middle. Roots stay; other points move across the strands
    only.
    """
    if waves.radius <= 0 or len(strands) == 0:
        return strands
    depth = _depth(hull)
    slope = unit_vectors(cell_slopes(depth))
    known = np.concatenate([slope, depth[..., None], hull.head_distance[..., None]], axis=3)
    points = strands.points.reshape(len(strands), -1, 3)
    arc = strands.arc_lengths().reshape(len(strands), -1)
    wanted = LARGEST_RADIUS * waves.radius * grown_share(arc, waves)
    for _ in range(ROUNDS):
        found = hull.grid.sample(known, points.reshape(-1, 3)).reshape(*arc.shape, 5)
        here, over_head = found[..., 3], np.maximum(found[..., 4], 0)
        middle = np.maximum(here + over_head, 0) / 2
        lacking = np.clip(np.minimum(wanted, middle) - here, 0, None)
        along = unit_vectors(np.asarray(np.gradient(points, axis=1)))
        move = across(along, found[..., :3] * lacking[..., None])
        move = ndimage.gaussian_filter1d(move, PATH_BLUR, axis=1, mode="nearest")
        move[:, 0] = 0
        points = points + (SHARE * move).astype(np.float32)
    return replace(strands, points=np.ascontiguousarray(points.reshape(-1, 3)))


def _depth(hull: Hull) -> Float32Array:
    """Return the depth (X, Y, Z) under the surface of hair and head, metres, negative outside."""
    filled = hull.dense | (hull.head_distance < 0)
    inside = ndimage.distance_transform_edt(filled) - 0.5
    outside = ndimage.distance_transform_edt(~filled) - 0.5
    depth = hull.grid.spacing * np.where(filled, inside, -outside)
    return np.asarray(ndimage.gaussian_filter(depth, DEPTH_BLUR), np.float32)
