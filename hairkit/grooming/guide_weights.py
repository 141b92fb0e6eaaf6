"""Attach hair to guides: the nearest guides of each strand, and motion interpolated from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.errors import InputError
from hairkit.types.strands import Strands

CLOSEST = 3
"""Guides that a hair follows, as Unreal's groom schema has it."""


@dataclass(frozen=True, eq=False)
class GuideWeights:
    """The guides of every strand."""

    guides: Int32Array
    """(S, 3) strand numbers of guides, nearest root first; a lone guide is repeated."""
    weights: Float32Array
    """(S, 3) not negative, sum 1; a guide follows itself with weight 1."""


def guide_mask(strands: Strands) -> BoolArray:
    """Return (S,) which strands are guides: all of them where nothing is said."""
    return np.ones(len(strands), bool) if strands.guide is None else strands.guide


def closest_guides(strands: Strands) -> GuideWeights:
    """Return the guides with the nearest roots, weighted by the inverse of the distance.

    Raises
    ------
    InputError
        No strand is a guide.
    """
    index = np.flatnonzero(guide_mask(strands))
    if not len(index):
        raise InputError("the groom has no guides; export it with strands=hair")
    roots = strands.roots.astype(np.float64)
    count = min(CLOSEST, len(index))
    distance, near = cKDTree(roots[index]).query(roots, k=[1, 2, 3][:count], workers=-1)
    near = index[near]
    # a guide comes first in its own list even where another guide shares its root
    own = np.zeros(len(strands), bool)
    own[index] = True
    near[own, 0] = np.flatnonzero(own)
    distance[own, 0] = 0.0
    weight = 1.0 / np.maximum(distance, 1e-6)
    weight[own] = np.eye(count)[0]
    weight /= weight.sum(axis=1, keepdims=True)
    guides = np.repeat(near[:, :1], CLOSEST, axis=1)
    guides[:, :count] = near
    weights = np.zeros((len(strands), CLOSEST), np.float32)
    weights[:, :count] = weight
    return GuideWeights(guides.astype(np.int32), weights)


def follow(
    strands: Strands, guide_frames: Float32Array, head_from_rest: Float64Array | None = None
) -> Float32Array:
    """Return (T, P, 3) all strands moved with their guides.

    Each hair keeps its offset, seen from the head, from the weighted guides at the same distance
    from the root; hair that is longer than a guide, at the same share of its length.

    Parameters
    ----------
    strands
        Guides and hair at rest; equal counts of points are not needed.
    guide_frames
        (T, G, 3) the guides' points only, in their order in `strands`.
    head_from_rest
        (T, 4, 4) rigid motion of the head; None: it rests. Hair goes along with it whole.
    """
    guide = guide_mask(strands)
    rows = np.flatnonzero(guide[strands.strand_of_point])
    if guide_frames.shape[1] != len(rows):
        raise InputError(f"{guide_frames.shape[1]} cached points, the guides have {len(rows)}")
    if guide.all():
        return guide_frames
    frames = np.repeat(strands.points[None], len(guide_frames), axis=0)
    at, share = _places_on_guides(strands, closest_guides(strands))
    first = np.zeros(len(strands.points), np.int64)
    first[rows] = np.arange(len(rows))
    low = first[at]
    rest = strands.points[rows]
    still = np.eye(4)[None].repeat(len(guide_frames), axis=0)
    motions = still if head_from_rest is None else head_from_rest
    for frame, moved, motion in zip(frames, guide_frames, motions, strict=True):
        seen = _move(moved, np.linalg.inv(motion))
        shift = np.concatenate([seen - rest, np.zeros((1, 3), np.float32)])
        for k in range(CLOSEST):
            frame += share[:, k, :1] * shift[low[:, k]] + share[:, k, 1:] * shift[low[:, k] + 1]
        frame[:] = _move(frame, motion)
        frame[rows] = moved
    return frames


def _move(points: Float32Array, motion: Float64Array) -> Float32Array:
    """Return points (P, 3) under a rigid motion (4, 4); as they are where it is none."""
    if np.array_equal(motion, np.eye(4)):
        return points
    return (points @ motion[:3, :3].T + motion[:3, 3]).astype(np.float32)


def _places_on_guides(strands: Strands, mix: GuideWeights) -> tuple[Int64Array, Float32Array]:
    """Return (P, 3) the point before each point's place on each guide, and (P, 3, 2) weights."""
    counts, owner = strands.counts, strands.strand_of_point
    rank = np.arange(len(strands.points)) - strands.offsets[:-1][owner]
    along = rank / (counts[owner] - 1)
    guide = mix.guides[owner]
    length = np.maximum(strands.lengths(), 1e-9)
    # short hair goes with the first part of a long guide, whose tip moves much further
    part_of = np.minimum(length[owner][:, None] / length[guide], 1)
    place = along[:, None] * part_of * (counts[guide] - 1)
    before = np.minimum(place.astype(np.int64), counts[guide] - 2)
    part = (place - before).astype(np.float32)
    weight = mix.weights[owner]
    return strands.offsets[guide] + before, np.stack([weight * (1 - part), weight * part], axis=2)
