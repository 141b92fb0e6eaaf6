"""A groom at one frame of a simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import InputError
from hairkit.grooming.guide_weights import follow, guide_mask
from hairkit.head_model.skinning import HEAD_JOINT, head_weights
from hairkit.simulation.guide_simulator import drawn_at_rest, keep_out
from hairkit.simulation.obstacles import groom_bodies
from hairkit.simulation.rigid_motion import follow_head, inverse_motion, transform_points
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands


def pose_groom(groom: Groom, cache: PointCache, frame: int) -> Groom:
    """Return the groom, hair and head, as it is at a frame of its simulation.

    The head's vertices follow head and torso by their skin weights: the neck bends. Joints stay.
    Negative frames count from the last. Raises `InputError` where the cache has no such frame or
    is of another groom.
    """
    strands = pose_hair(groom, groom.strands, cache, frame)
    rest, weight = groom.head.vertices, head_weights(groom.head)[:, HEAD_JOINT, None]
    moved = transform_points(cache.head_from_rest[frame], rest)
    below = transform_points(pose_torso(groom, cache, frame), rest)
    vertices = (below + weight * (moved - below)).astype(np.float32)
    return replace(groom, strands=strands, head=replace(groom.head, vertices=vertices))


def pose_torso(groom: Groom, cache: PointCache, frame: int) -> Float64Array:
    """Return the motion (4, 4) of the torso since rest at a frame of the groom's simulation."""
    joint = groom.head.joints[1].astype(np.float64)
    return follow_head(np.eye(4), cache.head_from_rest[frame], joint)


def pose_hair(groom: Groom, hair: Strands, cache: PointCache, frame: int) -> Strands:
    """Return hair that goes with the groom's guides as it is at a frame of their simulation.

    Negative frames count from the last. Raises `InputError` where the cache has no such frame.
    """
    if not -len(cache) <= frame < len(cache):
        raise InputError(f"frame {frame} of a cache of {len(cache)} frames, 0 to {len(cache) - 1}")
    at = [frame]
    one = PointCache(cache.points[at], cache.times[at], cache.head_from_rest[at])
    return replace(hair, points=pose_frames(groom, hair, one)[0])


def pose_frames(groom: Groom, hair: Strands, cache: PointCache) -> Float32Array:
    """Return (T, P, 3) hair that goes with the groom's guides in all frames of their simulation.

    `hair` is at rest: the groom's strands, then any that `densify` put between them. Locks stay
    the locks they are; made anew in every frame they would not. Strands that follow keep their
    length, and out of head and torso. Raises `InputError` where the cache is of another groom.
    """
    simulated = guide_mask(groom.strands)
    guides, points = groom.strands.select(simulated), cache.points
    if points.shape[1] != len(guides.points):
        raise InputError(
            f"a cache of {points.shape[1]} points, the groom's guides have {len(guides.points)};"
            " give the groom that was simulated"
        )
    mask = np.zeros(len(hair), bool)
    mask[np.flatnonzero(simulated)] = True
    if (hair.counts[mask] != guides.counts).any():
        points = guides.moved_and_resampled(points, int(hair.counts[0]))
    moved = follow(replace(hair, guide=mask), points, cache.head_from_rest)
    if mask.all():
        return moved
    bodies, moved = groom_bodies(groom), moved.astype(np.float32)
    drawn = drawn_at_rest(hair, bodies)
    for place, motion in zip(moved, cache.head_from_rest, strict=True):
        own = transform_points(inverse_motion(motion), place)
        torso = follow_head(np.eye(4), motion, bodies.joint)
        keep_out(drawn, bodies, inverse_motion(torso) @ motion, own)
        place[:] = transform_points(motion, own)
    return moved
